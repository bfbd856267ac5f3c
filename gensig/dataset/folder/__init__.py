"""The folder of a data set from its beginning to its verification."""
