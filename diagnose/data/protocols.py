"""Which protocols of a data set a study runs, why others are left out, and what a score on each
says.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from diagnose.data.windows import CROSS_SENSOR, check_names, n_samples
from gensig.errors import ConfigError

if TYPE_CHECKING:
    from diagnose.data.windows import Task

# Their training lacks classes that the test has: scores of novelty are judged there, not accuracy
# over classes.
HEALTHY_ONLY = "healthy_only"
OPEN_PROTOCOLS = (HEALTHY_ONLY, "open_set")
MEANING = {
    "by_unit": "tested on machines (unit = one set of gears in one gearbox) never seen in training",
    "cross_specimen": "on sets of gears never seen",
    "cross_gearbox": "on gearboxes never seen; their sets of gears may be known",
    "cross_speed": "on machines never seen, at speeds above all of training",
    "cross_torque": "on machines never seen, at torques above all of training",
    CROSS_SENSOR: "on machines never seen, with sensors never trained on",
    "cross_snr": "on machines never seen, in more noise than all of training",
    "unseen_severity_inner": "on machines never seen, with severities in a gap in the middle of those of training; "
    "healthy records and faults of one severity as in by_unit",
    "unseen_severity_outer": "on machines never seen, with severities above all of training; "
    "healthy records and faults of one severity as in by_unit",
}


def choose_protocols(
    task: Task, wanted: Sequence[str] | None
) -> tuple[tuple[str, ...], dict[str, str]]:
    """Protocols to run, and of those wanted that cannot be run, why.

    Parameters
    ----------
    task : of an open data set
    wanted : names, or None for every protocol that the set has, `OPEN_PROTOCOLS` and `CROSS_SENSOR` too

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
    left_out |= {
        name: why
        for name in wanted
        if name in offered and (why := _why_no_window(task, name))
    }
    absent = {name: left_out[name] for name in wanted if name in left_out}
    found = tuple(name for name in wanted if name not in absent)
    if not found:
        reasons = "; ".join(f"{name}: {reason}" for name, reason in absent.items())
        raise ConfigError(
            f"{dataset.folder} has none of the protocols to train on ({reasons or 'it has no splits'})"
        )
    return found, absent


def channels_to_cross(
    available: Sequence[str],
    channels: Sequence[str] | None,
    test_channels: Sequence[str] | None,
) -> tuple[tuple[str, ...], tuple[str, ...]] | str:
    """Channels that `CROSS_SENSOR` trains and tests on, the same number, or in one line why there
    are none.

    Without a word of the user the first half of the channels is trained on and as many of the
    second half are tested on: data sets list the sensors of one place side by side, so that a
    pair of directions stays a pair. With `channels` alone those are tested on that come first
    among the others.

    Raises
    ------
    ConfigError    for test channels that do not exist, are trained on, or are not as many
    """
    if test_channels is None:
        n = len(available) // 2 if channels is None else len(channels)
        trained = tuple(available[:n] if channels is None else channels)
        others = [name for name in available if name not in trained]
        if n == 0:
            return f"the data set has {len(available)} channel, and 2 are needed"
        if len(others) < n:
            return f"{len(others)} channel(s) are left beside channels={','.join(trained)}; name fewer"
        return trained, tuple(others[:n])
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
    """Why a protocol that cuts records has no place for a window."""
    if name == CROSS_SENSOR:
        return None  # whole records
    longest = max(
        (
            stop - start
            for rows in task.dataset.split(name).values()
            for _, start, stop in rows
        ),
        default=1.0,
    )
    held = int(longest * n_samples(task.dataset) + 1e-6)
    if longest == 1.0 or held >= task.window_samples:
        return None
    return f"its stretches of {held} samples hold no window of {task.window_samples}"


def _why_no_cross_sensor(task: Task) -> str | None:
    if "by_unit" not in task.dataset.protocols:
        return "it needs the protocol by_unit"
    return task.cross_channels if isinstance(task.cross_channels, str) else None
