"""Training of networks, and trained networks on disk."""
