"""Faults as pure functions from tooth to tooth; the mesh knows none of them."""
