"""Evaluation of a trained network on a data set, if the two fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from diagnose.data.at_rate import at_rate
from diagnose.data.windows import Segments, Task, all_segments, subset_segments, task_of
from diagnose.recordings.stored_network import Scores, StoredNetwork
from diagnose.training.carried import refuse_seen
from diagnose.training.store import ModelDescription, data_fingerprint, schema_version
from gensig.dataset.schema import READABLE_VERSIONS
from gensig.errors import ConfigError, DatasetError

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset


def evaluate_network(
    network: StoredNetwork,
    dataset: Dataset,
    *,
    protocol: str | None = None,
    subset: str | None = None,
    channels: Sequence[str] | None = None,
) -> tuple[dict[str, Any], Scores]:
    """Score a network on a part of a data set.

    On the data set that it was trained on it is judged on the test part of its protocol; on
    another one, on every record, unless `protocol` and `subset` say otherwise. A network of
    ``cross_sensor`` is judged on the channels of its test on the test part of that protocol,
    elsewhere on those of its training, unless `channels` says otherwise.

    Parameters
    ----------
    network : of `diagnose.recordings.registry.open_network`
    dataset : open data set
    protocol, subset : part of a split of that data set
    channels : in place of those it was trained on, in their order

    Returns
    -------
    content of ``metrics.json``, scores with intervals and what was judged; scores of the network

    Raises
    ------
    DatasetError    if schema version, sampling rate, channels, classes or columns do not fit, and
        for implants in stretches of recordings that carried in the training
    ConfigError    for a protocol or subset that does not exist, another number of channels, or a
        part with nothing to score
    """
    description = network.description
    task = _matching_task(network, dataset, channels)
    segments, part, shown = chosen_segments(task, description, protocol, subset)
    refuse_seen(description.carried, dataset, segments)
    scores = network.scores(shown, segments, part)
    return {
        "data": str(dataset.folder),
        "part": part,
        **scores.counts,
        "class_names": list(task.class_names),
        "channel_names": list(shown.channel_names),
        "model": str(description.model.get("name", "network")),
        **scores.method,
        "trained_on_protocol": description.protocol,
        "seed": description.seed,
        **scores.values,
    }, scores


def _matching_task(
    network: StoredNetwork,
    dataset: Dataset,
    channels: Sequence[str] | None,
) -> Task:
    """Task as the network was trained for, on this data set; refuses what does not fit."""
    description = network.description
    reads_any_rate = not network.inputs().has_window_length
    wanted = fitting_channels(
        description, dataset, channels, reads_any_rate=reads_any_rate
    )
    rate = description.sampling_rate_hz
    if reads_any_rate:
        rate = min(rate, float(dataset.sampling_rate))
    task = task_of(
        at_rate(dataset, rate),
        window_samples=description.window_samples,
        stride_samples=description.stride_samples,
        normalise=description.normalise,
        classes=network.classes_of(dataset),
        channels=wanted,
        one_class=True,
    )
    if description.test_channel_names is None:
        return task
    tested = wanted
    if channels is None:
        tested = description.test_channel_names
    return replace(task, cross_channels=(wanted, tested))


def fitting_channels(
    description: ModelDescription,
    dataset: Dataset,
    channels: Sequence[str] | None,
    *,
    reads_any_rate: bool = False,
) -> tuple[str, ...]:
    """Channels of a data set for those of a network.

    Refuses a format that this version does not read, a lower rate than that of the training
    unless the network ``reads_any_rate``, and channels that it has not.
    """
    where = f"{dataset.folder} does not fit the model"
    trained_on, found = description.data_schema_version, schema_version(dataset)
    if trained_on is not None and not {trained_on, found} <= set(READABLE_VERSIONS):
        readable = " and ".join(map(str, READABLE_VERSIONS))
        raise DatasetError(
            f"{where}: data schema {found}, trained on schema {trained_on}, and this version "
            f"reads {readable}",
        )
    is_slower = dataset.sampling_rate < description.sampling_rate_hz * (1 - 1e-9)
    if is_slower and not reads_any_rate:
        raise DatasetError(
            f"{where}: sampled at {dataset.sampling_rate:g} Hz, trained at "
            f"{description.sampling_rate_hz:g} Hz",
        )
    wanted = _wanted_channels(description, dataset, channels)
    if missing := [name for name in wanted if name not in dataset.channel_names]:
        raise DatasetError(
            f"{where}: it has no channel {', '.join(missing)} "
            f"(it has {', '.join(dataset.channel_names)})",
        )
    return wanted


def _wanted_channels(
    description: ModelDescription, dataset: Dataset, channels: Sequence[str] | None
) -> tuple[str, ...]:
    """Channels that are asked for, else those of the training; all for a network of any."""
    if description.takes_each_channel:
        return tuple(channels or dataset.channel_names)
    n_channels = len(description.channel_names)
    if channels is not None and len(channels) != n_channels:
        raise ConfigError(
            f"channels={','.join(channels)}: the model takes {n_channels}, in "
            f"the order of {', '.join(description.channel_names)}"
        )
    return tuple(channels or description.channel_names)


def chosen_segments(
    task: Task,
    description: ModelDescription,
    protocol: str | None,
    subset: str | None,
) -> tuple[Segments, str, Task]:
    """Stretches to judge, the part in words, and the task with the channels of that part."""
    note = ""
    if data_fingerprint(task.dataset) == description.data_fingerprint:
        note = " (the data set it was trained on)"
        protocol = protocol or description.protocol
    if protocol is None and subset is not None:
        raise ConfigError(
            f"subset={subset} needs protocol=..., one of {', '.join(task.dataset.protocols)}",
        )
    if protocol is None:
        return all_segments(task), "all records", task
    subset = subset or "test"
    segments = subset_segments(task, protocol, subset)
    text = f"{subset} part of {protocol}{note}"
    return segments, text, task.part(protocol, subset)
