"""A fake data set with the interface of ``gensig.stream``: any process makes the same records."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from fake_dataset import FakeDataset


@dataclass(frozen=True)
class FakeRecord:
    signals: dict[str, np.ndarray]
    values: dict[str, Any]


@dataclass(frozen=True)
class FakeStream:
    """Four classes for each condition; an epoch is a seed; records in ``failed`` are marked so."""

    epoch: int = 0
    numbers: tuple[int, ...] = tuple(range(16))
    failed: tuple[int, ...] = ()
    noise: float = 0.5

    @property
    def dataset(self):
        shape = {"n_units": 4, "records_per_unit": 4, "n_channels": 2}
        return FakeDataset(**shape, noise=self.noise, seed=self.epoch)

    def __getattr__(self, name):
        if name in (
            "class_names",
            "channel_names",
            "column_names",
            "gear_names",
            "n_samples",
            "protocols",
            "sampling_rate",
        ):
            return getattr(self.dataset, name)
        raise AttributeError(name)

    @property
    def seed(self):
        return self.epoch

    @property
    def usable(self):
        return np.ones(len(self), dtype=bool)

    def column(self, name):
        return self.dataset.column(name)[list(self.numbers)]

    def split(self, protocol):
        assert len(self) == 16
        return self.dataset.split(protocol)

    def take(self, places):
        return replace(self, numbers=tuple(self.numbers[place] for place in places))

    def shard(self, index, count):
        numbers = tuple(n for n in self.numbers if n // 4 % count == index)
        return replace(self, numbers=numbers)

    def at_epoch(self, epoch):
        return replace(self, epoch=epoch)

    def __len__(self):
        return len(self.numbers)

    def __iter__(self):
        dataset = self.dataset
        for number in self.numbers:
            status = "failed" if number in self.failed else "ok"
            values = {
                name: dataset.column(name)[number] for name in dataset.column_names
            }
            values["record_id"] = str(values["record_id"])
            yield FakeRecord(
                signals={"acceleration": dataset.signals(number)},
                values={**values, "status": status},
            )
