"""A machine like a measured one: what healthy recordings tell of it, as a configuration whose faults can be made."""
