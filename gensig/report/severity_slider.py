"""Severity sweep of the page: records of one class by severity, each with its healthy signal."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.dataset.reader import Dataset
from gensig.report.conditions import (
    TWIN,
    Healthy,
    Shown,
    by_condition,
    healthy_beside,
)
from gensig.report.examples import read_signals
from gensig.report.packing import pack_signal
from gensig.report.rotation_frequencies import Rotation
from gensig.report.signal_views import BESIDE, faulty_tooth, turn_view
from gensig.report.turns import aligned, averaged_turn, conspicuity, gear_teeth
from gensig.text.escaping import plain
from gensig.text.parameters import size_words

IntArray = NDArray[np.integer]

LEAST_SEVERITIES = 3
MOST_STEPS = 15  # of a class
MOST_STEPS_IN_ALL = 36  # about 1.5 MB
WAVE_SAMPLES = 4096
SIZES = "params/fault."
# least rank correlation with the severity of a parameter that is a fault's size
SIZE_FOLLOWS_SEVERITY = 0.95


@dataclass(frozen=True, slots=True, kw_only=True)
class Sweep:
    """Records of a class by severity.

    Parameters
    ----------
    name : the class
    gear : the gear that has the fault in all of them
    records : (step,)
    size : column of a parameter that grows with the severity, or ""
    """

    name: str
    gear: str
    records: IntArray
    size: str


def find_sweeps(data: Dataset, rotation: Rotation) -> list[Sweep]:
    """Classes whose severity can be stepped through.

    Records of one condition come first: of the class's conditions with a healthy signal the one
    with most severities. Where none has `LEAST_SEVERITIES`, and twins are stored, all records of
    the class are taken. All faults of a sweep are on one gear.
    """
    label, is_example = data.column("label_name"), data.usable & ~data.is_reference
    sweeps = []
    for name in data.class_names:
        mine: IntArray = np.flatnonzero((label == name) & is_example)
        if name == "healthy" or not mine.size:
            continue
        mine, gear = _of_one_gear(data, rotation, mine)
        records = _stepped(data, mine)
        if records.size:
            size = _size(data, records)
            sweeps.append(Sweep(name=name, gear=gear, records=records, size=size))
    most = max(min(MOST_STEPS, MOST_STEPS_IN_ALL // max(len(sweeps), 1)), 2)
    return [_thinned(sweep, most) for sweep in sweeps]


def sweep_content(
    data: Dataset, rotation: Rotation, sweep: Sweep, channel: str
) -> dict[str, Any]:
    """A sweep for the page: its class and steps, on one channel."""
    return {
        "class": plain(sweep.name),
        "gear": sweep.gear,
        "steps": [
            _step(data, rotation, sweep, index, channel)
            for index in sweep.records.tolist()
        ],
    }


def step_healthy(data: Dataset, index: int) -> Healthy | None:
    """The healthy signal of a step: the record's twin where it is stored."""
    if TWIN in data.signal_names:
        return Healthy(shown=Shown(index=index, is_twin=True), kind="twin")
    return healthy_beside(data, index)


def _of_one_gear(
    data: Dataset, rotation: Rotation, records: IntArray
) -> tuple[IntArray, str]:
    """Records with the fault on the gear that has it most often, and that gear; "" if unknown."""
    if "fault_gear" not in data.column_names:
        return records, ""
    gears, counts = np.unique(data.column("fault_gear")[records], return_counts=True)
    gear = str(gears[np.argmax(counts)])
    kept = records[data.column("fault_gear")[records] == gear]
    if gear not in (*rotation.n_teeth, *rotation.further):
        gear = ""
    return kept, gear


def _stepped(data: Dataset, records: IntArray) -> IntArray:
    """Records to step through in the order of severity; empty where there is no sweep."""
    severity = data.column("severity")
    records = records[np.isfinite(severity[records])]
    beside = [k for k in records.tolist() if step_healthy(data, k) is not None]

    def n_severities(group: IntArray) -> int:
        return len(np.unique(severity[group]))

    chosen = max(by_condition(data, beside), key=n_severities, default=records[:0])
    if n_severities(chosen) < LEAST_SEVERITIES and TWIN in data.signal_names:
        chosen = records
    if n_severities(chosen) < LEAST_SEVERITIES:
        return records[:0]
    _, first = np.unique(severity[chosen], return_index=True)
    return chosen[first]


def _thinned(sweep: Sweep, most: int) -> Sweep:
    ranks = np.linspace(0, sweep.records.size - 1, min(most, sweep.records.size))
    kept = sweep.records[np.rint(ranks).astype(int)]
    return replace(sweep, records=kept)


def _size(data: Dataset, records: IntArray) -> str:
    """Column of a fault parameter that grows with the severity of these records, or ""."""
    from scipy.stats import spearmanr

    severity = data.column("severity")[records]
    for name in data.column_names:
        if not name.startswith(SIZES):
            continue
        values = data.column(name)[records]
        if values.ndim != 1 or values.dtype.kind != "f":
            continue
        if not np.isfinite(values).all() or len(np.unique(values)) < LEAST_SEVERITIES:
            continue
        if spearmanr(values, severity).statistic >= SIZE_FOLLOWS_SEVERITY:
            return name
    return ""


def _step(
    data: Dataset, rotation: Rotation, sweep: Sweep, index: int, channel: str
) -> dict[str, Any]:
    healthy = step_healthy(data, index)
    shown = [Shown(index=index)]
    if healthy is not None:
        shown.append(healthy.shown)
    signals = [read_signals(data, one, [channel]) for one in shown]
    severity = float(data.column("severity")[index])
    step: dict[str, Any] = {
        "record": str(data.column("record_id")[index]),
        "severity": severity,
        "label": _label(data, sweep, index),
        "beside": "",
        "tooth": faulty_tooth(data, shown[0]),
        "turns": [],
        "change": None,
    }
    if healthy is None:
        return step
    step["beside"] = BESIDE[healthy.kind]
    n_teeth = gear_teeth(data, rotation, sweep.gear, index)
    pairs = zip(reversed(shown), reversed(signals), strict=True)
    averages = [averaged_turn(data, rotation, *pair, sweep.gear) for pair in pairs]
    turns = aligned(averages, n_teeth or 1)[::-1]
    known = [turn for turn in turns if turn is not None]
    if n_teeth is not None and len(known) == len(shown):
        step["turns"] = [turn_view(turn, n_teeth) for turn in known]
        step["change"] = conspicuity(*(turn.values[0] for turn in known))
    if healthy.kind == "twin":
        difference = (signals[0] - signals[1])[0, :WAVE_SAMPLES]
        step["wave"] = {**pack_signal(difference), "step": 1.0 / data.sampling_rate}
    return step


def _label(data: Dataset, sweep: Sweep, index: int) -> str:
    """Size with its unit, severity and set-point of a step in words."""
    parts = [f"severity {data.column('severity')[index]:.3g}"]
    if sweep.size:
        words, unit = size_words(sweep.size.removeprefix(SIZES))
        size = float(data.column(sweep.size)[index])
        parts.insert(0, f"{words} {size:.3g} {unit}".strip())
    speed, torque = data.column("speed_rpm")[index], data.column("torque_nm")[index]
    parts += [f"{speed:.0f} r/min", f"{torque:.3g} N m"]
    return ", ".join(parts)
