"""Public measured sets, and folders of a user's own recordings, read where they lie.

Nothing of a set is stored here: `sets/*.yaml` hold what a readable source says of its files, with
that source. What no source says is empty, and asked of the user.
"""

from gensig.measured.loading import load, sets
from gensig.measured.measured_set import GearTrain, MeasuredRecording, MeasuredSet
from gensig.measured.measured_signal import read_signal, read_signals

__all__ = [
    "GearTrain",
    "MeasuredRecording",
    "MeasuredSet",
    "load",
    "read_signal",
    "read_signals",
    "sets",
]
