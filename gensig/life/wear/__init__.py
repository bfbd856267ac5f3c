"""Wear of flanks over a life."""
