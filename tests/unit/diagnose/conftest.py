"""Modules of this folder are importable from its subfolders."""
