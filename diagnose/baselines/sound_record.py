"""Changes of teeth against a healthy record of the same machine, band by band.

The model needs a history, which a monitored machine has and a new one lacks.
``docs/howto/engine_faults.md``.
"""

from __future__ import annotations

from typing import final

import numpy as np

from diagnose.baselines.base import Input, MethodText, Parts, Role, Source
from diagnose.baselines.chosen_model import ChosenModelBaseline
from diagnose.baselines.features import (
    GEARS,
    Cache,
    FeatureTable,
    Key,
    keys_of,
    known_rotation,
)
from diagnose.data.references import ReferenceKind, references
from diagnose.data.teeth import START
from diagnose.data.windows import FloatArray, IntArray, Segments, Task, read_signal
from gensig.errors import ConfigError
from gensig.signals.resampling import PASS_SHARE
from gensig.signals.tooth_levels import changed_teeth, tooth_levels

# Shares of the band that the recorder passes, `PASS_SHARE` of the rate.
BANDS = ((0.01, 0.125), (0.125, 0.25), (0.25, 0.5), (0.5, 0.999))
_BANDS = range(len(BANDS))
# Largest and smallest change of a tooth, in standard deviations.
OF_CHANNEL = ("rise", "fall")
# Log ratio of the largest tooth and the median one, of the channels' mean square changes.
OF_ALL = "outstanding"


def chosen_references(task: Task) -> IntArray:
    """(record,) the healthy record that each is compared with, by one rule for all classes.

    It is one at another condition of the same unit. Data sets with one condition a unit give the
    next repeat at the same condition; see `diagnose.data.references.references`.

    Raises
    ------
    ConfigError    for a data set that has neither, or not the positions of the teeth
    """
    if missing := [name for name in START if name not in task.dataset.column_names]:
        raise ConfigError(
            f"baseline sound_record: the data set does not say {missing[0]}; "
            "leave that baseline out"
        )
    reasons = []
    for kind in (ReferenceKind.OTHER_CONDITION, ReferenceKind.SAME_CONDITION):
        try:
            return references(task, kind)
        except ConfigError as reason:
            reasons.append(str(reason))
    text = "; and ".join(dict.fromkeys(reasons))
    raise ConfigError(f"baseline sound_record: {text}, or leave that baseline out")


def sound_record_table(task: Task, segments: Segments, known: Cache) -> FeatureTable:
    """Changes of the teeth of both gears, stretch by stretch, with the columns `_names`.

    The reference is the whole healthy record, also for a stretch that is part of a record.
    ``known`` is filled and used.

    Raises
    ------
    ConfigError    as `chosen_references`, and for records that all have none
    """
    reference = chosen_references(task)
    if (reference[segments.record] < 0).all():
        raise ConfigError(
            "baseline sound_record: no record of a part has a healthy record to compare with; "
            "leave that baseline out"
        )
    names = _names(task)
    values = np.full((segments.record.size, len(names)), np.nan)
    for row, key in zip(values, keys_of(task, segments), strict=True):
        other = int(reference[key[1]])
        if other >= 0:
            here = _levels(task, known, key)
            whole = (task.channel_names, other, 0, int(task.dataset.n_samples))
            there = _levels(task, known, whole)
            changes = [changed_teeth(here[gear], there[gear]) for gear in GEARS]
            row[:] = np.concatenate([_measures(change) for change in changes])
    return FeatureTable(
        values=values,
        names=names,
        label=task.labels()[segments.record],
        record=segments.record,
    )


def sound_record_tables(source: Source) -> Parts:
    """Changes of the teeth in every subset."""
    return source.tables(TOOTH_INPUT.name, sound_record_table)


TOOTH_INPUT = Input(name="tooth_changes", make=sound_record_tables)


@final
class SoundRecord(ChosenModelBaseline):
    """Logistic regression or gradient boosting on changes of teeth against a healthy record."""

    text = MethodText(
        name="sound_record",
        label="against a healthy record",
        card_label=None,
        meaning="logistic regression or gradient boosting (chosen on validation machines) on which "
        "tooth is louder or quieter than in a healthy record of the same machine at another "
        "condition (at the same one where the data set has one a machine); it is given that "
        "record, which the others are not.",
    )
    role = Role.RIVAL
    reads = TOOTH_INPUT


def _names(task: Task) -> tuple[str, ...]:
    """Names of the columns, in the order of `_measures`, gear by gear."""
    names = []
    for gear in GEARS:
        names += [
            f"{name}/{gear}/{band}/{extreme}"
            for extreme in OF_CHANNEL
            for name in task.channel_names
            for band in _BANDS
        ]
        names += [f"{OF_ALL}/{gear}/{band}" for band in (*_BANDS, "all")]
    return tuple(names)


def _measures(changes: FloatArray) -> FloatArray:
    """Columns of one gear, from its changes (channel, band, tooth)."""
    power = np.square(changes)
    joint = np.concatenate([power.mean(axis=0), power.mean(axis=(0, 1))[None]])
    with np.errstate(divide="ignore", invalid="ignore"):
        outstanding = np.log(joint.max(axis=-1) / np.median(joint, axis=-1))
    rise, fall = changes.max(axis=-1), changes.min(axis=-1)
    columns = np.concatenate([rise.ravel(), fall.ravel(), outstanding])
    return np.where(np.isfinite(columns), columns, np.nan)


def _levels(task: Task, known: Cache, key: Key) -> dict[str, FloatArray]:
    """Levels (channel, band, tooth) of either gear, tooth 0 first.

    NaN for a gear that makes no turn in the stretch.
    """
    if key not in known:
        _, record, start, _ = key
        column = {name: float(task.dataset.column(name)[record]) for name in START}
        rotation = known_rotation(task)
        n_teeth, frequency = rotation.n_teeth(record), rotation.frequencies(record)
        rate, signal = float(task.dataset.sampling_rate), read_signal(task, *key[1:])
        passages = start / rate * rotation.mesh_frequency(record)
        passed = column["start_phase"] + passages
        known[key] = {}
        for gear in GEARS:
            first = column[f"start_tooth_{gear}"] + passed
            known[key][gear] = _of_gear(
                signal, rate, frequency[gear], n_teeth[gear], first
            )
    levels: dict[str, FloatArray] = known[key]
    return levels


def _of_gear(
    signal: FloatArray, rate: float, rotation: float, n_teeth: int, start: float
) -> FloatArray:
    """Levels (channel, band, tooth) of one gear, whose tooth `start` is in mesh first."""
    bands = [(low * PASS_SHARE * rate, high * PASS_SHARE * rate) for low, high in BANDS]
    try:
        levels = [
            tooth_levels(signal, rate, rotation, n_teeth, band=band, start=start)
            for band in bands
        ]
    except ValueError:
        return np.full((len(signal), len(BANDS), n_teeth), np.nan)
    return np.stack(levels, axis=1)
