"""A machine like a measured one.

What healthy recordings tell of it, as a configuration whose faults can be made.
"""
