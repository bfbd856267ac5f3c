"""The sham control: training on a data set with the labels but without the faults."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

from diagnose.data.at_rate import at_rate_of
from diagnose.data.references import reference_kind, references
from diagnose.data.windows import Task, task_of
from gensig.errors import ConfigError

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

NETWORK = "sham"


def sham_method(method: str, network: str) -> str:
    """Name of the result of a method on the sham set."""
    if method == network:
        return NETWORK
    return f"{NETWORK}_{method}"


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
    for kind, name in (("classes", "class_names"), ("channels", "channel_names")):
        given, wanted = getattr(dataset, name), getattr(task.dataset, name)
        if list(given) != list(wanted):
            raise ConfigError(
                f"sham={folder}: its {kind} are {', '.join(given)}, "
                f"those of data= {', '.join(wanted)}"
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


def check_references(sham: Task, reference: str) -> None:
    """Refuse a sham set without the healthy records that the network is given.

    Raises
    ------
    ConfigError    if no machine has them
    """
    try:
        references(sham, reference_kind(reference))
    except ConfigError as error:
        raise ConfigError(f"sham={sham.dataset.folder}: {error}") from None


def _is_sham(dataset: Dataset) -> bool:
    """True if the stored configuration of the data set has ``plan.sham``."""
    try:
        config = json.loads(str(dataset.attributes["config_json"]))
        return config["plan"]["sham"] is True
    except (KeyError, TypeError, ValueError):
        return False


def sham_protocols(sham: Task, protocols: Sequence[str]) -> tuple[str, ...]:
    """The protocols that the sham set has; it cannot have one by severity.

    Raises
    ------
    ConfigError    if there is none
    """
    shared = tuple(name for name in protocols if name in sham.dataset.protocols)
    if protocols and not shared:
        raise ConfigError(
            f"sham={sham.dataset.folder} has none of the protocols {', '.join(protocols)}"
        )
    return shared
