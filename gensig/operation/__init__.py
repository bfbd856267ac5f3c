"""Speed and load of a machine, and their courses over time."""
