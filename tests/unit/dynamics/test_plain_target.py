"""The compiled step is that of the same source on arrays of NumPy, a row an array.

Meshes with chords have compiled functions of their own, which take no arrays. Nothing is rounded
once where the compiled code multiplies and adds in one operation.
"""

from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from core_runs import MISSING, CoreRun
from side_by_side_lines import run_of

from gensig.driveline.reading import read_line_machine
from gensig.dynamics import _written
from gensig.dynamics._vector import EIGHT, n_lanes
from gensig.plan.request import read_request
from gensig.systems.registry import read_system

STEP, N_STEPS = 1.0 / (51200 * 5), 60
RAMP = "operating.speed_profile=[[0,1],[0.001,1.4]]"
RIPPLE = "excitation.motor.torque_ripple={share: 0.05, order: 12}"
# overrides, reader of the machine, and its equations
CASES = {
    "pair": (
        ["experiment=quickstart", RAMP],
        read_system,
    ),
    "two_stage": (
        ["experiment=two_stage", RIPPLE],
        read_line_machine,
    ),
}


def width(array):
    return n_lanes(array.dtype.name)


def get_row(array, row):
    n = width(array)
    return array[row * n : (row + 1) * n].copy()


def set_row(array, row, value):
    n = width(array)
    array[row * n : (row + 1) * n] = value


def load_wide(array, index):
    return array[index : index + EIGHT].astype(np.float64)


def store(array, index, value):
    array[index : index + len(value)] = value


def cells(table, low, high):
    """Eight numbers from an index on for every lane, in float64, as eight rows."""
    starts = low.astype(np.int64)
    return tuple(np.stack([table[start : start + EIGHT] for start in starts], axis=-1))


PLAIN = {
    "width": width,
    "get_row": get_row,
    "set_row": set_row,
    "load_wide": load_wide,
    "store": store,
    "cells": cells,
    "spread": lambda array, value: np.full(width(array), value),
    "where_above": lambda a, b, yes, no: np.where(a > b, yes, no),
    "any_above": lambda a, b: bool(np.any(a > b)),
    "chosen": lambda condition, yes, no: yes if condition else no,
    "fused": lambda a, b, total: a * b + total,
    "joined": lambda array, low, high: low,
    "lower": lambda value: value,
    "upper": lambda value: value,
    "truncated": np.trunc,
    "tail": lambda array, first: array[first:],
    "rows_of": lambda array, n: len(array) // n,
    "is_filled": lambda array: len(array) > 0,
    "number_at": lambda numbers, place: int(numbers[place]),
}


def plain(monkeypatch, core):
    """The integration of a core as Python on arrays of float64."""
    for name, calculation in PLAIN.items():
        monkeypatch.setitem(_written.PLAIN, name, calculation)
    return core.integrate.py_func


def machines(kind):
    """A machine with a missing tooth and one under a light load, whose teeth part."""
    words, read = CASES[kind]
    machine = read(read_request(words).config)
    light = replace(machine.operating, torque=0.1 * machine.operating.torque)
    runs = run_of(machine, MISSING), run_of(replace(machine, operating=light))
    return [run.system.ready(run).dynamics for run in runs]


@pytest.mark.parametrize("kind", CASES)
def test_the_compiled_step_is_that_on_arrays(kind, monkeypatch):
    lanes = machines(kind)
    compiled, other = (CoreRun(lanes, STEP, channels=(0, 1, 2)) for _ in range(2))
    expected = compiled.means(N_STEPS)
    other.core = replace(other.core, integrate=plain(monkeypatch, other.core))
    found = other.means(N_STEPS)

    level = np.abs(expected).max(axis=0)
    assert level.min() > 0.0
    assert_close(found / level, expected / level, atol=1e-6)
    assert_close(
        other.whole, compiled.whole, atol=1e-9 * np.abs(compiled.whole[0]).max()
    )
    assert other.lost.tobytes() == compiled.lost.tobytes()
