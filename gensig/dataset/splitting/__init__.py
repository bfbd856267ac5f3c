"""Splits of a data set: protocols, dealing of groups, tables and their check."""
