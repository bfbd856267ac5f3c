"""Computed quantities of the validation rows, one module a subject."""
