"""Verbs on drive lines."""
