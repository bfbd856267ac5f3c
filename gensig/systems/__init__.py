"""Whole machines, each reading like a method section."""
