"""Figures of the verbs."""
