"""A data set whose test units are canaries, and the test that no method knows their labels."""

from dataclasses import replace

import numpy as np
from fake_dataset import CompleteDataset
from scipy.stats import binomtest

from diagnose.baselines.features import FeatureTable

TRAIN, VALIDATION, CANARIES = 2, 1, 13  # units
A_UNIT = 16  # records
DURATION = 0.3
UNLIKELY = 1e-3


class Canaries(CompleteDataset):
    """Three units of known classes, and 208 records of other units with random labels.

    Their signals have faults like any others: only what they are called is left to chance.
    """

    def __init__(self):
        n_units = TRAIN + VALIDATION + CANARIES
        sizes = {"n_units": n_units, "records_per_unit": A_UNIT}
        super().__init__(**sizes, duration=DURATION, n_channels=1)
        self.fault = self.columns["label"]
        self.is_canary = np.arange(self.n_records) >= A_UNIT * (TRAIN + VALIDATION)
        label = np.where(self.is_canary, random_labels(self.n_records), self.fault)
        self.columns |= {
            "label": label,
            "label_name": np.array(self.class_names)[label],
        }

    def signals(self, record_index, *args, **which):
        called = self.columns["label"]
        self.columns["label"] = self.fault
        signal = super().signals(record_index, *args, **which)
        self.columns["label"] = called
        return signal

    def split(self, protocol):
        unit = np.arange(self.n_records) // A_UNIT
        part = np.digitize(unit, [TRAIN, TRAIN + VALIDATION])
        return {
            subset: [
                (int(record), 0.0, 1.0) for record in np.flatnonzero(part == index)
            ]
            for index, subset in enumerate(("train", "validation", "test"))
        }


def random_labels(n_records, draw=0, n_classes=4):
    """Labels (record,) by chance, others for each draw."""
    return np.random.default_rng([20260101, draw]).integers(n_classes, size=n_records)


def chance_of(n_right, n_records, n_classes=4):
    """Probability that guesses are as far from chance as this, two-sided."""
    return binomtest(int(n_right), int(n_records), 1 / n_classes).pvalue


def joined(first, second):
    """Rows of two tables, or windows of two sets, as one."""
    names = ["label", "record"]
    changes = {}
    if isinstance(first, FeatureTable):
        names.append("values")
    else:
        n_signals = len(first.signals)
        names.append("start")
        changes = {
            "signals": (*first.signals, *second.signals),
            "segment": np.concatenate([first.segment, n_signals + second.segment]),
            "targets": {},
        }
    for name in names:
        columns = [getattr(part, name) for part in (first, second)]
        changes[name] = np.concatenate(columns)
    return replace(first, **changes)
