"""The version, which is part of every data set's identity.

A change of bits is a change of version.
"""

__version__ = "0.26.0"
