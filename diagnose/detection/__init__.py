"""Detection of changes of a machine by its own healthy recordings, without any training."""
