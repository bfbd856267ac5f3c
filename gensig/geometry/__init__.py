"""Geometry of teeth: involute, root curve, line of action. No elasticity, no time."""
