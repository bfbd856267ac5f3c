"""Records against a sound record of the same machine: which tooth changed, band by band; for
machines with a history.

A model that is given what a monitored machine has and a new one has not.
``docs/howto/engine_faults.md``.
"""

from __future__ import annotations

from typing import final

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.base import Input, MethodText, Parts, Role, Source
from diagnose.baselines.chosen_model import ChosenModelBaseline
from diagnose.baselines.features import GEARS, FeatureTable, known_rotation
from diagnose.data.windows import Segments, Task, read_signal
from gensig.errors import ConfigError
from gensig.signals.resampling import PASS_SHARE
from gensig.signals.tooth_levels import changed_teeth, tooth_levels

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]

BANDS = (
    (0.01, 0.125),
    (0.125, 0.25),
    (0.25, 0.5),
    (0.5, 0.999),
)  # of what the recorder passes, `PASS_SHARE` of the rate
OF_CHANNEL = (
    "rise",
    "fall",
)  # largest and smallest change of a tooth, in standard deviations
OF_ALL = "outstanding"  # of the channels' mean square changes: logarithm of the largest tooth over the median one
NEEDED = (
    "unit_id",
    "fault_gear",
    "start_phase",
    "start_tooth_pinion",
    "start_tooth_wheel",
)
_BANDS = range(len(BANDS))
Levels = dict[
    tuple[tuple[str, ...], int, int, int], dict[str, FloatArray]
]  # by channels, record, first and last sample


def references(task: Task) -> IntArray:
    """(record,) another sound record of the same unit, nearest in speed; -1 in units of fewer
    than two.

    Raises
    ------
    ConfigError    for a data set that does not tell its units and the places of its teeth
    """
    if missing := [name for name in NEEDED if name not in task.dataset.column_names]:
        raise ConfigError(
            f"baseline reference: the data set does not say {missing[0]}; leave that baseline out"
        )
    unit = np.asarray(task.dataset.column("unit_id"))
    speed = np.asarray(task.dataset.column("speed_rpm"), dtype=float)
    sound = np.flatnonzero(
        (np.asarray(task.dataset.column("fault_gear")) == "")
        & np.asarray(task.dataset.usable, dtype=bool)
    )
    found = np.full(unit.size, -1)
    for record in range(unit.size):
        own = sound[unit[sound] == unit[record]]
        if (
            own.size >= 2
        ):  # of one alone its own sound record would have no reference, which tells the class
            others = own[own != record]
            found[record] = others[np.argmin(np.abs(speed[others] - speed[record]))]
    return found


def reference_table(task: Task, segments: Segments, known: Levels) -> FeatureTable:
    """Changes of the teeth of both gears, stretch by stretch, columns as of `_names`.

    The reference is the whole sound record, also where a stretch is a part of one. ``known`` is
    filled and used.

    Raises
    ------
    ConfigError    as `references`, and where no unit has a second sound record
    """
    reference = references(task)
    if (reference[segments.record] < 0).all():
        raise ConfigError(
            "baseline reference: no machine has a sound record beside the one that is judged; make the data set with "
            "plan.n_repeats=2, or leave that baseline out"
        )
    rows = []
    for key in zip(
        segments.record.tolist(),
        segments.start.tolist(),
        segments.stop.tolist(),
        strict=True,
    ):
        other = int(reference[key[0]])
        own = _levels(task, known, *key)
        if other < 0:
            rows.append(np.full(len(_names(task)), np.nan))
            continue
        whole = _levels(task, known, other, 0, int(task.dataset.n_samples))
        rows.append(
            np.concatenate(
                [_measures(changed_teeth(own[gear], whole[gear])) for gear in GEARS]
            )
        )
    return FeatureTable(
        values=np.array(rows),
        names=_names(task),
        label=task.labels()[segments.record],
        record=segments.record,
    )


def reference_tables(source: Source) -> Parts:
    """Changes of the teeth in every subset."""
    known: Levels = {}

    def table(subset: str) -> FeatureTable:
        return reference_table(source.part(subset), source.segments(subset), known)

    return Parts(
        train=table("train"), validation=table("validation"), test=table("test")
    )


TOOTH_INPUT = Input(name="tooth_changes", make=reference_tables)


@final
class Reference(ChosenModelBaseline):
    """Logistic regression or gradient boosting on changes of teeth against a sound record."""

    text = MethodText(
        name="reference",
        label="against a sound record",
        card_label=None,
        meaning="logistic regression or gradient boosting (chosen on validation units) on which "
        "tooth is louder or quieter than in a sound record of the same machine; it is given that "
        "record, which the others are not.",
    )
    role = Role.RIVAL
    reads = TOOTH_INPUT


def _names(task: Task) -> tuple[str, ...]:
    """Of the columns, in the order of `_measures`, gear by gear."""
    names = []
    for gear in GEARS:
        names += [
            f"{name}/{gear}/{band}/{one}"
            for one in OF_CHANNEL
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
    columns = np.concatenate(
        [changes.max(axis=-1).ravel(), changes.min(axis=-1).ravel(), outstanding]
    )
    return np.where(np.isfinite(columns), columns, np.nan)


def _levels(
    task: Task, known: Levels, record: int, start: int, stop: int
) -> dict[str, FloatArray]:
    """Levels (channel, band, tooth) of either gear, tooth 0 first.

    NaN for one that makes no turn in the stretch.
    """
    key = (task.channel_names, record, start, stop)
    if key not in known:
        column = {name: float(task.dataset.column(name)[record]) for name in NEEDED[2:]}
        speed, n_teeth = known_rotation(task)
        rate, signal = (
            float(task.dataset.sampling_rate),
            read_signal(task, record, start, stop),
        )
        passed = (
            column["start_phase"]
            + start / rate * float(speed["pinion"][record]) * n_teeth["pinion"]
        )
        known[key] = {
            gear: _of_gear(
                signal,
                rate,
                float(speed[gear][record]),
                n_teeth[gear],
                column[f"start_tooth_{gear}"] + passed,
            )
            for gear in GEARS
        }
    return known[key]


def _of_gear(
    signal: FloatArray, rate: float, rotation: float, n_teeth: int, start: float
) -> FloatArray:
    shares = [
        (low * PASS_SHARE * rate, high * PASS_SHARE * rate) for low, high in BANDS
    ]
    try:
        levels = [
            tooth_levels(signal, rate, rotation, n_teeth, band=band, start=start)
            for band in shares
        ]
    except ValueError:
        return np.full((len(signal), len(BANDS), n_teeth), np.nan)
    return np.stack(levels, axis=1)
