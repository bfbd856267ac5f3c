"""Protocols of a data set that a study runs, and the meaning of a score on each."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from diagnose.data.windows import CROSS_SENSOR, check_names, n_samples
from gensig.dataset.splitting.protocols import MACHINE_COLUMNS, NEW_MACHINE
from gensig.errors import ConfigError

if TYPE_CHECKING:
    from diagnose.data.windows import Task

# Their training lacks classes that the test has: scores of novelty are judged there, not accuracy
# over classes.
HEALTHY_ONLY = "healthy_only"
OPEN_PROTOCOLS = (HEALTHY_ONLY, "open_set")
# They repeat `NEW_MACHINE` in a set in which no two machines share gears or a gearbox.
BY_PART = ("by_unit", "cross_specimen", "cross_gearbox")
NOTHING_SHARED = (
    "the set has no machines that share gears or a gearbox, "
    f"so {NEW_MACHINE} tests the same"
)
MEANING = {
    NEW_MACHINE: "on machines never seen, neither their gears nor their gearbox",
    "by_unit": "on machines never seen; their gears or their gearbox may be known",
    "cross_specimen": "on sets of gears never seen",
    "cross_gearbox": "on gearboxes never seen; their sets of gears may be known",
    "cross_speed": "on machines never seen, at speeds above all of training",
    "cross_torque": "on machines never seen, at torques above all of training",
    CROSS_SENSOR: "on machines never seen, with sensors never trained on",
    "cross_snr": "on machines never seen, in more noise than all of training",
    "unseen_severity_inner": "on machines never seen, "
    "with severities in a gap in the middle of those of training; "
    "healthy records and faults of one severity everywhere",
    "unseen_severity_outer": "on machines never seen, with severities above all of training; "
    "healthy records and faults of one severity everywhere",
}


def choose_protocols(
    task: Task, wanted: Sequence[str] | None
) -> tuple[tuple[str, ...], dict[str, str]]:
    """Protocols to run, and the reason for each wanted one that cannot be run.

    Parameters
    ----------
    task : of an open data set
    wanted : names, or None for every protocol that the set has, with `OPEN_PROTOCOLS` and
        `CROSS_SENSOR`; beside `NEW_MACHINE` those `BY_PART` are left out where they repeat it

    Raises
    ------
    ConfigError    for a name that is no protocol, and where none is left
    """
    dataset = task.dataset
    offered, left_out = list(dataset.protocols), dict(dataset.left_out)
    if reason := _why_no_cross_sensor(task):
        left_out[CROSS_SENSOR] = reason
    else:
        offered.append(CROSS_SENSOR)
    if wanted is None:
        wanted = offered
    check_names("protocol", wanted, [*offered, *left_out])
    for name in wanted:
        if name in offered and (reason := _why_no_window(task, name)):
            left_out[name] = reason
    absent = {name: left_out[name] for name in wanted if name in left_out}
    if NEW_MACHINE in wanted and NEW_MACHINE not in absent and _has_own_parts(task):
        repeated = [name for name in wanted if name in BY_PART and name not in absent]
        absent |= dict.fromkeys(repeated, NOTHING_SHARED)
    chosen = tuple(name for name in wanted if name not in absent)
    if not chosen:
        reasons = "; ".join(f"{name}: {reason}" for name, reason in absent.items())
        raise ConfigError(
            f"{dataset.folder} has none of the protocols to train on "
            f"({reasons or 'it has no splits'})"
        )
    return chosen, absent


def left_out_lines(left_out: Mapping[str, str]) -> list[str]:
    """Lines on protocols that are left out, one a reason, in the order of the mapping."""
    names: dict[str, list[str]] = {}
    for name, reason in left_out.items():
        names.setdefault(reason, []).append(name)
    return [f"{_are_left_out(same)}: {reason}" for reason, same in names.items()]


def _are_left_out(names: Sequence[str]) -> str:
    if len(names) == 1:
        return f"protocol {names[0]} is left out"
    return f"protocols {', '.join(names)} are left out"


def _has_own_parts(task: Task) -> bool:
    """True where every machine has gears and a gearbox that no other machine has."""
    columns = [np.asarray(task.dataset.column(name)) for name in MACHINE_COLUMNS]
    machines = np.unique(np.stack(columns), axis=1).shape[1]
    return all(len(np.unique(names)) == machines for names in columns)


def channels_to_cross(
    available: Sequence[str],
    channels: Sequence[str] | None,
    test_channels: Sequence[str] | None,
) -> tuple[tuple[str, ...], tuple[str, ...]] | str:
    """Channels that `CROSS_SENSOR` trains and tests on, or in one line why there are none.

    Both are as many. By default the first half of the channels is trained on and as many of the
    second half are tested on. Data sets list the sensors of one position in a row, so that both
    directions of a position are in the same half. With `channels` alone, the first of the other
    channels are tested on.

    Raises
    ------
    ConfigError    for test channels that do not exist, are trained on, or are not as many
    """
    if test_channels is None:
        if channels is None:
            channels = available[: len(available) // 2]
        others = [name for name in available if name not in channels]
        if not channels:
            return f"the data set has {len(available)} channel, and 2 are needed"
        if len(others) < len(channels):
            return (
                f"{len(others)} channel(s) are left beside channels={','.join(channels)}; "
                "name fewer"
            )
        return tuple(channels), tuple(others[: len(channels)])
    if channels is None or len(channels) != len(test_channels):
        raise ConfigError(
            "test_channels needs channels beside it, the same number of them"
        )
    check_names("channel", [*channels, *test_channels], available)
    if both := sorted(set(channels) & set(test_channels)):
        raise ConfigError(
            f"channel {both[0]} is in channels and in test_channels; a sensor never seen is in one"
        )
    return tuple(channels), tuple(test_channels)


def _why_no_window(task: Task, name: str) -> str | None:
    """Reason why the stretches of a protocol that cuts records hold no window."""
    if name == CROSS_SENSOR:
        return None  # whole records
    stretches = itertools.chain(*task.dataset.split(name).values())
    longest = max((stop - start for _, start, stop in stretches), default=1.0)
    held = int(longest * n_samples(task.dataset) + 1e-6)
    if longest == 1.0 or held >= task.window_samples:
        return None
    return f"its stretches of {held} samples hold no window of {task.window_samples}"


def _why_no_cross_sensor(task: Task) -> str | None:
    if "by_unit" not in task.dataset.protocols:
        return "the set has no protocol by_unit, whose machines it takes"
    return task.cross_channels if isinstance(task.cross_channels, str) else None
