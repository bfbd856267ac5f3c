"""Torques on a drive line: engine, motor, and what they drive."""
