"""Temperatures of gears and what they change of flanks and mesh."""
