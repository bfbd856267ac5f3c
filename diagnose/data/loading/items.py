"""Items of the data sets for torch: target of a window, and metadata of its record."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from diagnose.data.lives import COLUMNS as LIFE_COLUMNS
from diagnose.data.lives import kept_segments
from diagnose.data.windows import Segments, Task, check_names, subset_segments
from gensig.errors import ConfigError

NO_GEAR = "none"  # first of the names of a gear target: a healthy record
# Columns that metadata hold, as far as a data set has them.
METADATA = (
    "record_id",
    "unit_id",
    "gearbox_id",
    "specimen_id",
    "condition_id",
    "label_name",
    "severity",
    "fault_gear",
    "fault_tooth",
    "speed_rpm",
    "speed_set_rpm",
    "torque_nm",
    "snr_db",
    "mesh_frequency_hz",
    "life_id",
    "life_time_h",
    "remaining_life_h",
    "life_failed",
)

Value = int | torch.Tensor
Item = tuple[
    Any, ...
]  # window and target; with ``return_metadata`` the metadata are third
Metadata = dict[str, int | float | str]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Target:
    """One value to learn of each record.

    Attributes
    ----------
    value : (record,) int64 index into ``names``, or float32
    known : (record,) bool, False for a record without a value
    names : texts that an index stands for; empty where the target is a number
    """

    value: NDArray[Any]
    known: NDArray[np.bool_]
    names: tuple[str, ...] = ()

    def of(self, record: int) -> Value:
        """Target of one record: an index, or a number () float32."""
        value = self.value[record]
        if self.names:
            return int(value)
        return torch.tensor(float(value), dtype=torch.float32)


def target_of(task: Task, name: str) -> Target:
    """Target of the records of a task.

    Parameters
    ----------
    task : names the data set or stream, and its classes
    name : ``"class"``, ``"severity"``, ``"gear"`` or ``"life"``

    Raises
    ------
    ConfigError    for a name that does not exist, or a target that the data set lacks
    """
    check_names("target", (name,), tuple(TARGETS))
    return TARGETS[name](task)


def known_segments(task: Task, target: Target, protocol: str, subset: str) -> Segments:
    """Stretches of one subset of a split whose records have a target.

    Raises
    ------
    ConfigError    for a name that does not exist, or a subset without such records
    """
    segments = kept_segments(subset_segments(task, protocol, subset), target.known)
    if not segments.record.size:
        raise ConfigError(
            f"protocol {protocol}: no record of its {subset} part has this target; "
            "take another target or make more records"
        )
    return segments


def _class_target(task: Task) -> Target:
    labels = task.labels()
    return Target(value=labels, known=labels >= 0, names=task.class_names)


def _severity_target(task: Task) -> Target:
    severity = _column(task, "severity", "severity").astype(np.float32)
    return Target(value=severity, known=np.isfinite(severity))


def _gear_target(task: Task) -> Target:
    """Gear that has the fault, the first one of a compound fault."""
    gears = [str(name) for name in _column(task, "gear", "fault_gear")]
    names = (NO_GEAR, *task.dataset.gear_names)
    numbers = {name: number for number, name in enumerate(names)} | {"": 0}
    if unknown := sorted(set(gears) - set(numbers)):
        raise ConfigError(
            f"target 'gear': fault_gear {unknown[0]!r} is no gear of the data set, "
            f"which has {', '.join(names[1:])}; take target 'class'"
        )
    value = np.array([numbers[gear] for gear in gears], dtype=np.int64)
    return Target(value=value, known=np.ones(value.size, dtype=bool), names=names)


def _life_target(task: Task) -> Target:
    """Hours that remain; not known in lives that did not fail, which have a lower bound."""
    life, _, remaining, failed = (_column(task, "life", name) for name in LIFE_COLUMNS)
    hours = remaining.astype(np.float32)
    known = (life != "") & np.isfinite(hours) & (failed == 1)
    if not known.any():
        raise ConfigError(
            "target 'life': no life of the data set failed, so that no remaining life is "
            "known; make lives with a longer life.horizon_h"
        )
    return Target(value=hours, known=known)


TARGETS: dict[str, Callable[[Task], Target]] = {
    "class": _class_target,
    "severity": _severity_target,
    "gear": _gear_target,
    "life": _life_target,
}


def _column(task: Task, target: str, name: str) -> NDArray[Any]:
    """Column that a target is made of; refuses a data set without it."""
    if name not in task.dataset.column_names:
        reason = "take another target"
        if name in LIFE_COLUMNS:
            reason = (
                "its records are no snapshots of lives; make one with "
                "gensig generate experiment=run_to_failure"
            )
        raise ConfigError(
            f"target {target!r}: the data set has no column {name}: {reason}"
        )
    return np.asarray(task.dataset.column(name))


def record_values(task: Task, record: int) -> dict[str, Any]:
    """Values of `METADATA` of a stored record, by column."""
    dataset = task.dataset
    present = set(dataset.column_names)
    return {name: dataset.column(name)[record] for name in METADATA if name in present}


def metadata_of(
    values: Mapping[str, Any], start: int, sampling_rate: float
) -> Metadata:
    """Metadata of a window, which the collate function of torch turns into those of a batch.

    Parameters
    ----------
    values : of the record, by column; those that are not in `METADATA` are left out
    start : first sample of the window, counted in the record
    sampling_rate : Hz

    Returns
    -------
    dict with the columns of `METADATA`, ``start_sample`` and ``sampling_rate_hz``
    """
    metadata: Metadata = {
        name: _plain(values[name]) for name in METADATA if name in values
    }
    return metadata | {"start_sample": start, "sampling_rate_hz": sampling_rate}


def _plain(value: Any) -> int | float | str:
    """Number or text of Python, of a number or text of NumPy."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, int | float | str):
        return value
    return str(value)
