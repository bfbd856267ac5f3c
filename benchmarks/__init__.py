"""Comparisons with peers and long campaigns, each one command; nothing here is part of the installed package."""
