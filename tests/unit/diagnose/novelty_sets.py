"""A data set in memory with open protocols."""

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
