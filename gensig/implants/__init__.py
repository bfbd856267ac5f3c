"""A labelled data set of a machine's healthy recordings plus faults of a simulated set."""
