"""Which protocols of a data set a study runs, why others are left out, and what a score on each says."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from diagnose.windows import check_names
from gensig.errors import ConfigError

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

# Their training lacks classes that the test has: accuracy over classes says nothing there.
OPEN_PROTOCOLS = ("healthy_only", "open_set")
MEANING = {
    "by_unit": "tested on machines (unit = one set of gears in one gearbox) never seen in training",
    "cross_specimen": "on sets of gears never seen",
    "cross_gearbox": "on gearboxes never seen; their sets of gears may be known",
    "cross_speed": "on machines never seen, at speeds above all of training",
    "cross_torque": "on machines never seen, at torques above all of training",
    "cross_snr": "on machines never seen, in more noise than all of training",
    "unseen_severity_inner": "on machines never seen, with severities in a gap in the middle of those of training; "
    "healthy records and faults of one severity as in by_unit",
    "unseen_severity_outer": "on machines never seen, with severities above all of training; "
    "healthy records and faults of one severity as in by_unit",
}


def choose_protocols(dataset: Dataset, wanted: Sequence[str] | None) -> tuple[tuple[str, ...], dict[str, str]]:
    """Protocols to run, and of those wanted that the data set has not, why.

    Parameters
    ----------
    dataset : open data set
    wanted : names, or None for every protocol of the set whose training has all classes

    Raises
    ------
    ConfigError    for a name that is no protocol, one whose training lacks classes, and where none is left
    """
    left_out = dataset.left_out
    if wanted is None:
        wanted = [name for name in dataset.protocols if name not in OPEN_PROTOCOLS]
    for name in wanted:
        if name in OPEN_PROTOCOLS:
            raise ConfigError(
                f"protocol {name}: training has not all classes, and diagnose train judges by telling classes apart; "
                "take it from the data set in a program of your own, or give other protocols"
            )
    check_names("protocol", wanted, [*dataset.protocols, *left_out])
    absent = {name: left_out[name] for name in wanted if name in left_out}
    found = tuple(name for name in wanted if name not in absent)
    if not found:
        reasons = "; ".join(f"{name}: {reason}" for name, reason in absent.items())
        raise ConfigError(f"{dataset.folder} has none of the protocols to train on ({reasons or 'it has no splits'})")
    return found, absent
