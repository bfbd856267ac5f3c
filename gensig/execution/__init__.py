"""Executors, which compute the shards of a data set."""
