"""Comparisons with peers and long campaigns, each one command.

Nothing here is part of the installed package.
"""
