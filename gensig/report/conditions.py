"""Whole conditions that the page shows: each record with the healthy one beside it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Flags
from gensig.dataset.reader import Dataset
from gensig.errors import DatasetError
from gensig.report.values import has_lives

RECORDS_PER_CLASS = 3
SIGNALS_BY_DEFAULT = 48  # records times channels: about 4 MB
SIGNALS_AT_MOST = 100  # about 8 MB, plotly.js 5 MB: the page stays below 15 MB
TWIN = "healthy_twin"
# Of a healthy record at another set-point that may stand beside a fault; assumed.
NEAR_SPEED = 0.05
NEAR_TORQUE = 0.2
HealthyKind = Literal["own", "twin", "earlier", "near"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """One signal of the page: a record, or the healthy twin stored with it.

    Parameters
    ----------
    index : number of the record in the data set
    is_twin : True for its healthy twin
    """

    index: int
    is_twin: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Healthy:
    """The healthy signal beside a record.

    Parameters
    ----------
    shown : the signal
    kind : "own" for a healthy record of the same condition, "twin" for the record's stored twin,
        "earlier" for the least damaged record of the same life, "near" for a healthy record of
        the same unit at nearly the same speed and torque
    """

    shown: Shown
    kind: HealthyKind


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """Signals of one unit at one set-point, which the page compares with each other.

    Parameters
    ----------
    name : its condition_id
    shown : healthy signals first, then by class and severity
    healthy : the healthy signal beside each record that has one
    """

    name: str
    shown: list[Shown]
    healthy: dict[Shown, Healthy]


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """Conditions, and channels by name, that are shown.

    `remark` is one line on the parts that were left out, or "".
    """

    conditions: list[Condition]
    channels: list[str]
    remark: str

    @property
    def all_shown(self) -> Iterator[Shown]:
        """Every signal, condition by condition."""
        for condition in self.conditions:
            yield from condition.shown

    @property
    def n_records(self) -> int:
        """Records shown, twins not counted."""
        return sum(not shown.is_twin for shown in self.all_shown)


def choose(data: Dataset, per_class: int | None) -> Choice:
    """Whole conditions, from the least to the greatest mean severity of their faults.

    Together they hold every class. Those that hold most classes come first.

    Parameters
    ----------
    per_class : records of a class; None takes `RECORDS_PER_CLASS`, or fewer for a small page

    Raises
    ------
    DatasetError    for a set without a usable record
    """
    records = np.flatnonzero(data.usable & ~data.is_reference)
    if not records.size:
        raise DatasetError(
            f"{data.folder} has no usable record to show; gensig inspect {data.folder} says why"
        )
    limit, wanted = SIGNALS_BY_DEFAULT, RECORDS_PER_CLASS
    if per_class is not None:
        limit, wanted = SIGNALS_AT_MOST, per_class
    groups = _groups(data, records)
    n_classes = len(np.unique(data.column("label_name")[records]))
    n_all = len(data.channel_names)
    n_channels = min(n_all, max(limit // n_classes, 1))
    n_shown = wanted
    conditions = _conditions(data, groups, n_shown)
    while n_shown > 1 and _n_shown(conditions) * n_channels > limit:
        n_shown -= 1
        conditions = _conditions(data, groups, n_shown)
    n_channels = min(n_channels, max(limit // _n_shown(conditions), 1))
    remarks, small = [], "so that the page stays small"
    if n_shown < wanted:
        remarks.append(f"{n_shown} instead of {wanted} records a class, {small}")
    if n_channels < n_all:
        remarks.append(f"the first {n_channels} of {n_all} channels, {small}")
    return Choice(
        conditions=conditions,
        channels=data.channel_names[:n_channels],
        remark="; ".join(remarks),
    )


def healthy_beside(data: Dataset, index: int) -> Healthy | None:
    """The healthy signal that a record is compared with, or None.

    The first that there is of: a healthy record of the record's own condition; its stored twin;
    in a life, the least damaged record of the same life and condition; a healthy record of the
    same unit whose speed and torque differ by at most `NEAR_SPEED` and `NEAR_TORQUE`. A healthy
    record stands beside none.
    """
    label = data.column("label_name")
    if label[index] == "healthy":
        return None
    unit, condition = data.column("unit_id"), data.column("condition_id")
    usable = data.usable
    of_unit = usable & (unit == unit[index])
    of_condition = of_unit & (condition == condition[index])
    own = np.flatnonzero(of_condition & (label == "healthy"))
    if own.size:
        return Healthy(shown=Shown(index=int(own[0])), kind="own")
    if TWIN in data.signal_names:
        return Healthy(shown=Shown(index=index, is_twin=True), kind="twin")
    if has_lives(data):
        return _earlier(data, index, of_condition)
    return _near(data, index, np.flatnonzero(of_unit & (label == "healthy")))


def _earlier(data: Dataset, index: int, of_condition: Flags) -> Healthy | None:
    """The least damaged record of the same life and condition."""
    life, severity = data.column("life_id"), data.column("severity")
    less = of_condition & (life == life[index]) & (severity < severity[index])
    candidates = np.flatnonzero(less)
    if not candidates.size:
        return None
    least = int(candidates[np.argmin(severity[candidates])])
    return Healthy(shown=Shown(index=least), kind="earlier")


def _near(data: Dataset, index: int, candidates: NDArray[np.integer]) -> Healthy | None:
    """The healthy record of nearest speed, where it is near enough."""
    speed, torque = data.column("speed_rpm"), data.column("torque_nm")
    apart = np.abs(speed[candidates] / speed[index] - 1.0)
    twisted = np.abs(torque[candidates] / torque[index] - 1.0)
    is_near = (apart <= NEAR_SPEED) & (twisted <= NEAR_TORQUE)
    if not is_near.any():
        return None
    nearest = int(candidates[is_near][np.argmin(apart[is_near])])
    return Healthy(shown=Shown(index=nearest), kind="near")


def _groups(data: Dataset, records: NDArray[np.integer]) -> list[NDArray[np.integer]]:
    """Records of each condition of each unit that holds a fault.

    Conditions without a fault are among them where no condition holds both. Of lives, those of
    the life of each class that gets worst.
    """
    if has_lives(data):
        records = _worst_lives(data, records)
    result = by_condition(data, records)
    label = data.column("label_name")
    faulty = [group for group in result if np.any(label[group] != "healthy")]
    if any("healthy" in label[group] for group in faulty):
        return faulty
    return result


def by_condition(
    data: Dataset, records: Sequence[int] | NDArray[np.integer]
) -> list[NDArray[np.integer]]:
    """Records of each condition of each unit, in their order."""
    unit, condition = data.column("unit_id"), data.column("condition_id")
    groups: dict[tuple[str, str], list[int]] = {}
    for index in map(int, records):
        groups.setdefault((unit[index], condition[index]), []).append(index)
    return list(map(np.array, groups.values()))


def _worst_lives(data: Dataset, records: NDArray[np.integer]) -> NDArray[np.integer]:
    """Records of one life a class: the one that reaches the greatest severity."""
    label, life = data.column("label_name"), data.column("life_id")
    severity = data.column("severity")
    worst = []
    for name in np.unique(label[records]):
        mine = records[label[records] == name]
        worst.append(life[mine[np.argmax(severity[mine])]])
    return records[np.isin(life[records], worst)]


def _n_shown(conditions: Sequence[Condition]) -> int:
    return sum(len(condition.shown) for condition in conditions)


def _conditions(
    data: Dataset, groups: Sequence[NDArray[np.integer]], per_class: int
) -> list[Condition]:
    """Conditions with about so many records of each class."""
    picked = _covering(data, groups)
    n_wanted = 0
    if not has_lives(data):
        n_classes = len({name for group in groups for name in _classes(data, group)})
        n_held = max(len(_classes(data, group)) for group in groups)
        n_wanted = math.ceil(per_class * n_classes / n_held)
    rest = [group for group in groups if not any(group is other for other in picked)]
    picked += _further(data, rest, n_wanted - len(picked))
    picked.sort(key=lambda group: _mean_severity(data, group))
    each = per_class
    if n_wanted:
        each = max(n_wanted // len(picked), 1)
    return [_condition(data, group, each) for group in picked]


def _further(
    data: Dataset, groups: Sequence[NDArray[np.integer]], n_further: int
) -> list[NDArray[np.integer]]:
    """Conditions of most classes, at even steps of the rank of their severity."""
    if n_further < 1 or not groups:
        return []
    most = max(len(_classes(data, group)) for group in groups)
    whole = [group for group in groups if len(_classes(data, group)) == most]
    whole.sort(key=lambda group: _mean_severity(data, group))
    ranks = np.rint(np.linspace(0, len(whole) - 1, n_further)).astype(int)
    return [whole[rank] for rank in dict.fromkeys(ranks.tolist())]


def _covering(
    data: Dataset, groups: Sequence[NDArray[np.integer]]
) -> list[NDArray[np.integer]]:
    """Few conditions that hold every class: of equally good ones that of middle severity.

    Of lives, the one over which the severity grows most.
    """
    classes = {name for group in groups for name in _classes(data, group)}
    severity = data.column("severity")
    picked: list[NDArray[np.integer]] = []
    while classes:
        gain = [len(classes & _classes(data, group)) for group in groups]
        best = [groups[k] for k in range(len(groups)) if gain[k] == max(gain)]
        best.sort(key=lambda group: _mean_severity(data, group))
        middle = best[len(best) // 2]
        if has_lives(data):
            middle = max(best, key=lambda group: float(np.ptp(severity[group])))
        picked.append(middle)
        classes -= _classes(data, picked[-1])
    return picked


def _classes(data: Dataset, group: NDArray[np.integer]) -> set[str]:
    return set(data.column("label_name")[group].tolist())


def _mean_severity(data: Dataset, group: NDArray[np.integer]) -> float:
    """Mean of the known severities of the faults of a condition; 0 without one."""
    severity = data.column("severity")[group]
    faulty = severity[data.column("label_name")[group] != "healthy"]
    known = faulty[np.isfinite(faulty)]
    if not known.size:
        return 0.0
    return float(known.mean())


def _condition(data: Dataset, group: NDArray[np.integer], per_class: int) -> Condition:
    """A condition with its records at even steps of the rank of their severity."""
    label, severity = data.column("label_name"), data.column("severity")
    faulty: list[int] = []
    for name in data.class_names:
        mine = group[label[group] == name]
        mine = mine[np.argsort(severity[mine], kind="stable")]
        if mine.size and name != "healthy":
            faulty += _even(mine, per_class)
    shown = [Shown(index=index) for index in faulty]
    healthy = {}
    for one in shown:
        beside = healthy_beside(data, one.index)
        if beside is not None:
            healthy[one] = beside
    sound = [beside.shown for beside in healthy.values()]
    if not faulty:
        sound = [Shown(index=index) for index in _even(group, per_class)]
    return Condition(
        name=str(data.column("condition_id")[group[0]]),
        shown=list(dict.fromkeys([*sound, *shown])),
        healthy=healthy,
    )


def _even(records: NDArray[np.integer], n_shown: int) -> list[int]:
    """Records at even steps of their rank; of one, the middle."""
    ranks = np.array([records.size // 2])
    if n_shown > 1:
        ranks = np.linspace(0, records.size - 1, n_shown)
    return list(dict.fromkeys(records[np.rint(ranks).astype(int)].tolist()))
