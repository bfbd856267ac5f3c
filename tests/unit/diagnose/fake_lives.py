"""A data set in memory whose records are snapshots of machines that run to failure."""

import numpy as np
from fake_dataset import FakeDataset

SHOWS_H = 100.0  # remaining life from which on the fault grows


class FakeLives(FakeDataset):
    """One class, whose impulses depend on the remaining life below `SHOWS_H` alone."""

    def __init__(self, *, n_lives=20, n_snapshots=8, n_censored=0, **changes):
        shape = {"n_units": n_lives, "records_per_unit": n_snapshots}
        super().__init__(**shape, classes=("missing_tooth",), **changes)
        rng = np.random.default_rng([self.seed, 7])
        length = rng.uniform(80.0, 400.0, n_lives)
        censored = np.zeros(n_lives, dtype=bool)
        censored[rng.permutation(n_lives)[:n_censored]] = True
        seen = np.where(censored, rng.uniform(0.4, 0.8, n_lives) * length, length)
        life = np.repeat(np.arange(n_lives), n_snapshots)
        age = (seen[:, None] * np.linspace(0, 1, n_snapshots)).ravel()
        progress = 1 - (length[life] - age) / SHOWS_H
        self.columns |= {
            "severity": 2.0 * np.clip(progress, 0, 1),
            "torque_nm": np.full(self.n_records, 20.0),
            "life_id": self.columns["unit_id"],
            "life_time_h": age,
            "remaining_life_h": seen[life] - age,
            "life_failed": (~censored[life]).astype(np.int8),
        }

    def without(self, *names):
        """The same set without some columns."""
        for name in names:
            del self.columns[name]
        return self
