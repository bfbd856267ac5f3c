"""Levels over the speed of a run-up: by orders of a shaft and by frequency."""
