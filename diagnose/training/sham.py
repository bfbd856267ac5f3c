"""The sham control.

The same training on a data set whose faults were left out and whose labels were kept.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

from diagnose.data.at_rate import at_rate_of
from diagnose.data.windows import Task, task_of
from gensig.errors import ConfigError

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

NETWORK = "sham"


def sham_method(method: str, network: str) -> str:
    """Name under which a method's result on the sham set is kept beside those on the faults."""
    return NETWORK if method == network else f"{NETWORK}_{method}"


def sham_task(task: Task, folder: str) -> Task:
    """The task on the sham data set of a folder.

    Raises
    ------
    DatasetError    for a folder that is no data set
    ConfigError    if it has faults, or other classes, channels or rate than the task's
    """
    from gensig.dataset.reader import open_dataset

    dataset = at_rate_of(open_dataset(folder), task.dataset)
    if not _is_sham(dataset):
        raise ConfigError(
            f"sham={folder} has faults; make one of the same command with plan.sham=true"
        )
    pairs: tuple[tuple[str, Sequence[str], Sequence[str]], ...] = (
        ("classes", dataset.class_names, task.dataset.class_names),
        ("channels", dataset.channel_names, task.dataset.channel_names),
    )
    for what, found, wanted in pairs:
        if list(found) != list(wanted):
            raise ConfigError(
                f"sham={folder}: its {what} are {', '.join(found)}, those of data= {', '.join(wanted)}"
            )
    rate = task.dataset.sampling_rate
    if abs(dataset.sampling_rate - rate) > 1e-9 * rate:
        raise ConfigError(
            f"sham={folder} is sampled at {dataset.sampling_rate:g} Hz, data= at {rate:g} Hz"
        )
    return task_of(
        dataset,
        window_samples=task.window_samples,
        stride_samples=task.stride_samples,
        normalise=task.normalise,
        classes=task.class_names,
        channels=task.channel_names,
    )


def _is_sham(dataset: Dataset) -> bool:
    """Whether the set's own configuration says so."""
    try:
        return (
            json.loads(str(dataset.attributes["config_json"]))["plan"]["sham"] is True
        )
    except (KeyError, TypeError, ValueError):
        return False


def sham_protocols(sham: Task, protocols: Sequence[str]) -> tuple[str, ...]:
    """Of the protocols named those that the sham set has: one by severity it cannot have.

    Raises
    ------
    ConfigError    if there is none
    """
    found = tuple(name for name in protocols if name in sham.dataset.protocols)
    if protocols and not found:
        raise ConfigError(
            f"sham={sham.dataset.folder} has none of the protocols {', '.join(protocols)}"
        )
    return found
