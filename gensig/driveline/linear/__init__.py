"""Linear vibration of a drive line: matrices, modes, forced response, dampers."""
