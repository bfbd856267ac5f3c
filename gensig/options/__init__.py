"""Hydra's door: overrides in, a plain resolved configuration out, and its typed sections."""
