"""Files of recordings, read in a process of their own: formats, sizes, limits."""
