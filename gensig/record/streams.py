"""Random streams of a data set.

One for each cause, so that changing one cause leaves the others alone.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np


class Stream(IntEnum):
    """Causes of randomness. The numbers are part of the bits of every data set."""

    CONDITION = 0
    FAULT = 1
    ORDER = 2
    SPECIMEN = 3
    GEARBOX = 4
    START = 5
    TWIN = 6
    NOISE = 7
    PATH = 8
    SENSOR = 9
    NUISANCE = 10
    NUISANCE_RECORD = 11
    DRIFT = 12
    ENCODER = 13
    SUPPORT = 14
    DROPPED = 15
    TACHO = 16
    HEALTHY_TWIN = 17
    LIFE = 18
    LIFE_HISTORY = 19
    TOOTHED_WHEEL = 20
    FAULT_GEAR = 21
    REFERENCE = 22
    GEAR_DESIGN = 23


def stream(seed: int, cause: Stream, index: int = 0) -> np.random.Generator:
    """Generator of one cause and one index; it depends on nothing else."""
    sequence = np.random.SeedSequence(seed, spawn_key=(int(cause), index))
    return np.random.Generator(np.random.SFC64(sequence))
