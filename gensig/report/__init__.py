"""The page of a data set: what is in it, to be looked at in a browser."""
