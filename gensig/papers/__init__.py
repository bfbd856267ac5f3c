"""Figures of the five papers that simulation can draw, as curves beside printed numbers."""
