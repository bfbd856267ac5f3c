"""Machines in motion: nominal rotation, torques and the deflection at rest."""
