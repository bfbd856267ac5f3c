"""The path from a machine's bearings to a sensor, as a healthy recording shows it."""
