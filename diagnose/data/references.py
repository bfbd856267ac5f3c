"""Healthy records of the same machine that records are compared with, chosen alike for all classes.

A rule that depends on the class tells the class, whatever the signal holds.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import IS_REFERENCE, IntArray, Task
from gensig.errors import ConfigError

NEEDED = ("unit_id", "condition_id", "speed_set_rpm", "fault_gear")
NONE = -1


class ReferenceKind(Enum):
    """Choice of references; the value is what a data set must have for it."""

    OTHER_CONDITION = "healthy records at two conditions (plan.n_reference=1)"
    SAME_CONDITION = "a second healthy record at each condition (plan.n_repeats=2)"
    EVERY_CONDITION = "healthy records at further conditions (plan.n_reference=2)"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Records:
    """Columns that decide the choice, (record,) each.

    Attributes
    ----------
    unit, condition : names
    speed : r/min, set
    label : number of the class
    example : True for records that are judged or learnt
    sound : True for records that may be a reference
    """

    unit: NDArray[np.str_]
    condition: NDArray[np.str_]
    speed: NDArray[np.floating]
    label: IntArray
    example: NDArray[np.bool_]
    sound: NDArray[np.bool_]


def references(task: Task, kind: ReferenceKind) -> IntArray:
    """(record,) a healthy record of the same machine, by one rule for all classes.

    OTHER_CONDITION is the one at another condition that is nearest in set speed; the records of a
    condition have the same one. SAME_CONDITION is the next repeat at the same condition, so that
    no record is its own. Where the data set marks records as references (`IS_REFERENCE`), only
    these are taken.

    It is -1 for all records of a unit in which one has no reference, and for records that are no
    examples.

    Raises
    ------
    ConfigError    for a data set that does not say unit, condition, set speed or fault, and where
        no unit has a reference
    """
    records = _records(task)
    choose = {
        ReferenceKind.OTHER_CONDITION: _at_another_condition,
        ReferenceKind.SAME_CONDITION: _at_the_same_condition,
        ReferenceKind.EVERY_CONDITION: _at_another_condition,
    }[kind]
    chosen = np.full(records.unit.size, NONE)
    for unit in np.unique(records.unit[records.example]):
        mine = np.flatnonzero(records.example & (records.unit == unit))
        sound = np.flatnonzero(records.sound & (records.unit == unit))
        found = np.array([choose(records, record, sound) for record in mine.tolist()])
        if (found != NONE).all():
            chosen[mine] = found
    if (chosen == NONE).all():
        raise ConfigError(f"no machine has {kind.value}: make the data set so")
    return chosen


def all_references(task: Task, kind: ReferenceKind) -> tuple[tuple[int, ...], ...]:
    """Healthy records of the same machine for each record; none for one without a reference.

    For EVERY_CONDITION all healthy records at other conditions than the record's, the nearest in
    set speed first; else that of `references` alone.

    Raises
    ------
    ConfigError    as `references`
    """
    first = references(task, kind)
    if kind is not ReferenceKind.EVERY_CONDITION:
        return tuple(() if other == NONE else (other,) for other in first.tolist())
    records = _records(task)
    chosen: list[tuple[int, ...]] = []
    for record, nearest in enumerate(first.tolist()):
        others: list[int] = []
        if nearest != NONE:
            same_unit = records.unit == records.unit[record]
            elsewhere = records.condition != records.condition[record]
            found = np.flatnonzero(records.sound & same_unit & elsewhere)
            away = np.abs(records.speed[found] - records.speed[record])
            others = found[np.argsort(away, kind="stable")].tolist()
        chosen.append(tuple(others))
    return tuple(chosen)


def _records(task: Task) -> _Records:
    dataset = task.dataset
    if missing := [name for name in NEEDED if name not in dataset.column_names]:
        raise ConfigError(
            f"the data set does not say {missing[0]}, by which the healthy record of a machine is "
            "chosen"
        )
    usable = np.asarray(dataset.usable, dtype=bool)
    sound = (np.asarray(dataset.column("fault_gear")) == "") & usable
    example = usable
    if IS_REFERENCE in dataset.column_names:
        marked = np.asarray(dataset.column(IS_REFERENCE)) == 1
        sound, example = sound & marked, usable & ~marked
    return _Records(
        unit=np.asarray(dataset.column("unit_id")),
        condition=np.asarray(dataset.column("condition_id")),
        speed=np.asarray(dataset.column("speed_set_rpm"), dtype=float),
        label=np.asarray(dataset.column("label")),
        example=example,
        sound=sound,
    )


def _at_another_condition(records: _Records, record: int, sound: IntArray) -> int:
    """The first record of `sound` at another condition that is nearest in set speed."""
    others = sound[records.condition[sound] != records.condition[record]]
    if not others.size:
        return NONE
    away = np.abs(records.speed[others] - records.speed[record])
    return int(others[np.argmin(away)])


def _at_the_same_condition(records: _Records, record: int, sound: IntArray) -> int:
    """The record of `sound` at the same condition that follows this one in its class."""
    same = records.condition == records.condition[record]
    others = sound[same[sound]]
    alike = same & records.example & (records.label == records.label[record])
    place = int(np.searchsorted(np.flatnonzero(alike), record))
    if not others.size:
        return NONE
    following = int(others[(place + 1) % others.size])
    return NONE if following == record else following


def reference_kind(name: str) -> ReferenceKind:
    """Kind of a setting, as ``other_condition``.

    Raises
    ------
    ConfigError    for a name that is none
    """
    try:
        return ReferenceKind[name.upper()]
    except KeyError:
        names = ", ".join(kind.name.lower() for kind in ReferenceKind)
        raise ConfigError(f"reference must be none or {names}, not {name!r}") from None
