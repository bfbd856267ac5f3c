"""Verbs on one gear pair."""
