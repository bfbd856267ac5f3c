"""One module a family of verbs: each takes parsed arguments, prints, and returns an exit status."""
