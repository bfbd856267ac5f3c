"""Simulated records that several tests look at, and runs of the command."""

from functools import lru_cache

import h5py
import numpy as np

from gensig.cli import main
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader
from gensig.record.simulate import forget_twins, simulate_records


def rows_of(config):
    plan = make_plan(config)
    return [plan.record(place) for place in range(plan.n_records)]


def simulated(config, rows=None, *, sham=False):
    """Records of rows of a plan, those of the configuration's own by default."""
    forget_twins()
    reader = InputReader(config.with_keys("plan", sham=sham))
    return simulate_records(reader, rows or rows_of(config))


@lru_cache(maxsize=32)
def records(*overrides):
    """Configuration, rows and records of a small plan; not to be changed."""
    small = ("plan.n_records=4", "plan.classes=[healthy,missing_tooth]")
    config = read_request([*small, *overrides]).config
    rows = rows_of(config)
    return config, rows, simulated(config, rows)


def run(*words):
    assert main([str(word) for word in words]) == 0


def refused(capsys, *words):
    """The one line with which the command refuses words."""
    assert main([str(word) for word in words]) != 0
    error = capsys.readouterr().err.strip()
    assert "\n" not in error
    return error


def shard(folder):
    return h5py.File(folder / "shards" / "shard-00000.h5", locking=False)


def texts(values):
    """Texts of a dataset or attribute of a file."""
    return [value.decode() for value in values]


def check_labels(file, classes, n_teeth):
    """One record of each class is there and ok; a faulty one names a gear and a tooth of it.

    ``n_teeth`` of each gear that may be faulty, by name.
    """
    names = texts(file["label_name"][:])
    assert set(texts(file["status"][:])) == {"ok"}
    assert set(names) == set(classes)
    assert np.all(file["integration_error"][:] < 1e-3)
    gears, teeth = texts(file["fault_gear"][:]), file["fault_tooth"][:]
    for name, gear, tooth in zip(names, gears, teeth, strict=True):
        if name == "healthy":
            assert (gear, tooth) == ("", -1)
        else:
            assert 0 <= tooth < n_teeth[gear]
    signals = file["acceleration"][:]
    assert np.isfinite(signals).all()
    assert np.all(signals.std(axis=-1) > 0.0)
