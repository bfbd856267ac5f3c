"""Data sets made from plans: on disk, as a stream, once more, and as contrasts."""
