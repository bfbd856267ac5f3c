"""The version, which is part of every data set's identity: a change of bits is a change of version."""

__version__ = "0.9.0"
