"""gensig: labelled gear-fault vibration data sets from physics."""

__version__ = "0.1.0"
