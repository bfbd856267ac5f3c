"""The oracle on teeth: a classifier of the difference between each record and its healthy twin."""

from __future__ import annotations

import itertools
from typing import final

import numpy as np

from diagnose.baselines.base import Input, MethodText, Parts, Role, Source
from diagnose.baselines.chosen_model import ChosenModelBaseline
from diagnose.baselines.features import (
    GEARS,
    Cache,
    FeatureTable,
    Key,
    known_rotation,
    stretch_table,
)
from diagnose.baselines.oracle import TWIN
from diagnose.baselines.tooth_features import LEVELS, NEIGHBORS, levels_of_teeth
from diagnose.baselines.tooth_models import turns_of, why_no_turns
from diagnose.data.windows import FloatArray, Segments, Task

N_LARGEST = 3


def _names() -> tuple[str, ...]:
    """Names of the features of one gear, in the order of `difference_features`."""
    at_teeth = [f"tooth{offset:+d}" for offset in NEIGHBORS]
    return (
        *("/".join(pair) for pair in itertools.product(LEVELS, at_teeth)),
        *(f"{name}/largest" for name in LEVELS),
        *(f"{name}/over_twin" for name in LEVELS),
        *(f"largest_{index}" for index in range(N_LARGEST)),
        "spread",
        *(f"{name}/median_over_twin" for name in LEVELS),
    )


GEAR_FEATURES = _names()


def difference_features(record: FloatArray, twin: FloatArray) -> FloatArray:
    """Levels of the difference of one gear's teeth, at the tooth where it is largest.

    The median tooth of the difference is the floor, which noise makes; the median tooth of the
    twin is the level of ordinary errors.

    Parameters
    ----------
    record, twin : (channel, tooth, sample) deviations from the mean passage

    Returns
    -------
    (feature,) of `GEAR_FEATURES`; NaN for a gear of which fewer teeth passed than they need
    """
    passed = np.any(record != 0, axis=(0, 2))
    if passed.sum() <= len(NEIGHBORS):
        return np.full(len(GEAR_FEATURES), np.nan)
    levels = levels_of_teeth((record - twin)[:, passed])
    median = np.median(levels, axis=-1)
    ordinary = np.median(levels_of_teeth(twin[:, passed]), axis=-1)
    above = levels - median[:, None]
    joint = levels.mean(axis=0)
    largest = int(joint.argmax())
    near = (largest + np.array(NEIGHBORS)) % joint.size
    return np.concatenate(
        [
            above[:, near].ravel(),
            above.max(axis=-1),
            levels[:, largest] - ordinary,
            np.sort(joint)[: -N_LARGEST - 1 : -1] - np.median(joint),
            [joint.std()],
            median - ordinary,
        ]
    )


def difference_table(task: Task, segments: Segments, cache: Cache) -> FeatureTable:
    """`difference_features` of both gears in every stretch; ``cache`` is filled and used."""
    rotation = known_rotation(task)

    def values(key: Key) -> FloatArray:
        record = turns_of(task, rotation, key)
        twin = turns_of(task, rotation, key, name=TWIN)
        gears = zip(record, twin, strict=True)
        return np.concatenate([difference_features(*both) for both in gears])

    names = tuple(f"{gear}/{name}" for gear in GEARS for name in GEAR_FEATURES)
    return stretch_table(task, segments, names, values, cache)


def difference_tables(source: Source) -> Parts:
    """Differences from the twins in every subset."""
    return source.tables(DIFFERENCE_INPUT.name, difference_table)


DIFFERENCE_INPUT = Input(
    name="teeth_against_twins", make=difference_tables, why_not=why_no_turns
)


@final
class OracleTeeth(ChosenModelBaseline):
    """Logistic regression or gradient boosting on `difference_features`."""

    text = MethodText(
        name="oracle_teeth",
        label="teeth",
        card_label=None,
        meaning="logistic regression or gradient boosting (chosen on validation machines) on the "
        "difference of record and healthy twin tooth by tooth: its levels in bands and places of "
        "the passage at the tooth where it is largest, above the median tooth.",
    )
    role = Role.BOUND
    reads = DIFFERENCE_INPUT
