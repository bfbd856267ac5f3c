"""Content of the section of signals: records of whole conditions, averaged turns and sound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gensig.arrays import FloatArray
from gensig.dataset.cards.class_figures import first_channel
from gensig.dataset.reader import Dataset
from gensig.report.conditions import Choice, Condition, HealthyKind, Shown
from gensig.report.examples import example, read_signals
from gensig.report.packing import pack_signal
from gensig.report.rotation_frequencies import Rotation
from gensig.report.sound import heard, sounds
from gensig.report.turns import (
    Turn,
    aligned,
    averaged_turn,
    conspicuity,
    gear_teeth,
    turned_gears,
)

LEAST_TURNS = 3  # of an average that decides the opening record; assumed
BESIDE: dict[HealthyKind, str] = {
    "own": "healthy record of the same condition",
    "twin": "healthy twin: the same record without its fault, in noise of its own",
    "earlier": "least damaged record of the same life and condition",
    "near": "healthy record of another condition of the same machine: there is none of its own, "
    "and this is the nearest in speed",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Read:
    """Views, sounds and turns of a condition's signals, in the order of its `shown`.

    Parameters
    ----------
    views : of `gensig.report.examples.example`
    parts : of `gensig.report.sound.heard`
    turns : averaged turns by gear
    """

    condition: Condition
    views: list[dict[str, Any]]
    parts: list[FloatArray]
    turns: dict[str, list[Turn | None]]


def signal_views(
    data: Dataset, chosen: Choice, rotation: Rotation
) -> list[dict[str, Any]]:
    """Every shown record and twin with its views, condition by condition.

    Keys beside those of `gensig.report.examples.example`:

    - ``set``, the number of its condition on the page, and ``of``, the condition_id of that;
    - ``compare``, numbers of the others of its condition;
    - ``healthy``, number of the healthy signal beside it, or None, and ``beside``, the same in
      words;
    - ``turns``, averaged turns by gear, ``turned``, the gear whose turn is shown, and ``tooth``,
      the faulty one or None;
    - ``conspicuity`` of its averaged turn, or None;
    - ``sound``, a data URI.
    """
    channel = first_channel(chosen.channels)
    result: list[dict[str, Any]] = []
    for number, condition in enumerate(chosen.conditions):
        read = _read(data, condition, chosen.channels, rotation)
        for view in _views_of(data, read, rotation, len(result), channel):
            result.append(view | {"set": number, "of": condition.name})
    return result


def opening_view(views: Sequence[dict[str, Any]]) -> int:
    """Number of the record that the page opens on.

    It is of the class with the largest median conspicuity, and of middle severity among its
    records that have one. Averages of fewer than `LEAST_TURNS` turns are left out where there
    are others. Where no record has a conspicuity, it is the last one with a healthy signal, or
    the last.
    """
    known = [k for k, view in enumerate(views) if view["conspicuity"] is not None]
    many = [k for k in known if _n_turns(views[k]) >= LEAST_TURNS]
    by_class: dict[str, list[int]] = {}
    for number in many or known:
        by_class.setdefault(views[number]["class"], []).append(number)
    if not by_class:
        beside = [k for k, view in enumerate(views) if view["healthy"] is not None]
        return [len(views) - 1, *beside][-1]

    def median(name: str) -> float:
        return float(np.median([views[k]["conspicuity"] for k in by_class[name]]))

    numbers = by_class[max(by_class, key=median)]
    numbers.sort(key=lambda number: views[number]["severity"] or 0.0)
    return numbers[len(numbers) // 2]


def _n_turns(view: dict[str, Any]) -> int:
    """Turns in the average of the gear that is shown first."""
    return int(view["turns"][view["turned"]]["n_turns"])


def _read(
    data: Dataset, condition: Condition, channels: Sequence[str], rotation: Rotation
) -> _Read:
    """Views, sounds and averaged turns of a condition; its signals are read one at a time."""
    channel = first_channel(channels)
    gears = turned_gears(data, rotation, condition.shown)
    views, parts = [], []
    averages: dict[str, list[Turn | None]] = {gear: [] for gear in gears}
    for shown in condition.shown:
        signals = read_signals(data, shown, channels)
        views.append(example(data, shown, signals, rotation))
        parts.append(heard(signals[channel], data.sampling_rate))
        for gear in gears:
            turn = averaged_turn(data, rotation, shown, signals, gear)
            averages[gear].append(turn)
    turns = {}
    for gear in gears:
        n_teeth = gear_teeth(data, rotation, gear, condition.shown[0].index)
        turns[gear] = aligned(averages[gear], n_teeth or 1)
    return _Read(condition=condition, views=views, parts=parts, turns=turns)


def _views_of(
    data: Dataset, read: _Read, rotation: Rotation, first: int, channel: int
) -> list[dict[str, Any]]:
    """Views of one condition, whose first has the number `first` on the page."""
    condition = read.condition
    files = sounds(read.parts)
    numbers = range(first, first + len(condition.shown))
    result = []
    for at, shown in enumerate(condition.shown):
        beside = condition.healthy.get(shown)
        healthy, words = None, ""
        if beside is not None:
            healthy = first + condition.shown.index(beside.shown)
            words = BESIDE[beside.kind]
        gear = _turned_gear(data, read, shown)
        view: dict[str, Any] = {
            "compare": [other for other in numbers if other != first + at],
            "healthy": healthy,
            "beside": words,
            "turned": gear,
            "turns": _turn_views(data, read, rotation, at),
            "tooth": faulty_tooth(data, shown),
            "sound": files[at],
            "conspicuity": None,
        }
        if healthy is not None:
            pair = (at, healthy - first)
            view["conspicuity"] = _conspicuity(read, gear, pair, channel)
        result.append(read.views[at] | view)
    return result


def _turned_gear(data: Dataset, read: _Read, shown: Shown) -> str:
    """Gear of a record's fault where its turn is averaged, else the first such gear, or ""."""
    gears = list(read.turns)
    if "fault_gear" in data.column_names:
        gear = str(data.column("fault_gear")[shown.index])
        if gear in gears:
            return gear
    return next(iter(gears), "")


def faulty_tooth(data: Dataset, shown: Shown) -> int | None:
    """Number of a record's faulty tooth, None without one."""
    if shown.is_twin or "fault_tooth" not in data.column_names:
        return None
    tooth = int(data.column("fault_tooth")[shown.index])
    if tooth < 0:
        return None
    return tooth


def _turn_views(
    data: Dataset, read: _Read, rotation: Rotation, at: int
) -> dict[str, Any]:
    """Averaged turns of one record by gear, those that it has."""
    shown = read.condition.shown[at]
    views = {}
    for gear, turns in read.turns.items():
        turn = turns[at]
        n_teeth = gear_teeth(data, rotation, gear, shown.index)
        if turn is not None and n_teeth is not None:
            views[gear] = turn_view(turn, n_teeth)
    return views


def turn_view(turn: Turn, n_teeth: int) -> dict[str, Any]:
    """An averaged turn for the page: its teeth, number of turns, and each channel packed."""
    return {
        "teeth": n_teeth,
        "n_turns": turn.n_turns,
        "from_tooth_0": turn.from_tooth_0,
        "channels": [pack_signal(values) for values in turn.values],
    }


def _conspicuity(
    read: _Read, gear: str, pair: tuple[int, int], channel: int
) -> float | None:
    """Conspicuity of the first of two signals against the second, None without both turns."""
    if gear not in read.turns:
        return None
    turns = [read.turns[gear][at] for at in pair]
    values = [turn.values[channel] for turn in turns if turn is not None]
    if len(values) < len(pair):
        return None
    return conspicuity(*values)
