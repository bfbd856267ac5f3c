"""Data sets in memory with open protocols, and one whose channels are copies."""

import numpy as np
from fake_dataset import FakeDataset


class OpenDataset(FakeDataset):
    """Twelve units with the open protocols; `withheld` is new in open_set."""

    withheld = "missing_tooth"

    def __init__(self, **changes):
        sizes = {"n_units": 12, "records_per_unit": 8, "duration": 0.3, "noise": 0.3}
        super().__init__(**{**sizes, **changes})
        self.protocols = ("by_unit", "healthy_only", "open_set")

    def split(self, protocol):
        subsets = super().split("by_unit")
        names = self.columns["label_name"]
        if protocol == "healthy_only":
            hidden = names != "healthy"
        elif protocol == "open_set":
            hidden = names == self.withheld
        else:
            return subsets
        return {
            subset: [row for row in rows if subset == "test" or not hidden[row[0]]]
            for subset, rows in subsets.items()
        }


class CopiedChannels(FakeDataset):
    """Two pairs of sensors that hear the same."""

    def __init__(self):
        super().__init__(
            n_units=8,
            records_per_unit=8,
            duration=0.3,
            n_channels=2,
            classes=("healthy", "missing_tooth"),
        )
        self.channel_names = ("near_x", "near_y", "far_x", "far_y")

    def signals(self, record_index, start=0, stop=None, channels=None, **which):
        near = super().signals(record_index, start, stop)[:2]
        both = np.concatenate([near, near])
        return both if channels is None else both[channels]
