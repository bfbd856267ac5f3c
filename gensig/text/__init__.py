"""Texts: nearest names, HTML pages, tables of users, options as files."""
