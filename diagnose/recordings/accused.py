"""The tooth that a network accuses, with what shows why: of a recording, and of test records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import torch

from diagnose.data.packed_turns import tooth_counts
from diagnose.data.targets import GEARS
from diagnose.data.turns import Turns
from diagnose.data.windows import HEALTHY, FloatArray, subset_segments
from diagnose.networks.network import SiteNetwork
from diagnose.recordings.prepared import prepare_recording
from diagnose.recordings.source import Source
from diagnose.recordings.stored_classifier import StoredClassifier
from diagnose.recordings.stored_network import require_finite
from diagnose.report.headlines import headline_protocol
from diagnose.report.tooth_figure import AccusedTooth, tooth_figure
from diagnose.studies.result_files import Content
from gensig.errors import ConfigError
from gensig.text.csv_tables import read_records

if TYPE_CHECKING:
    from diagnose.data.windows import Task, WindowSet
    from diagnose.recordings.stored_network import StoredNetwork

MOST_PICTURES = 5
PREDICTIONS = "predictions.csv"
NO_TEETH = "--plot shows the teeth of a gear, which this model does not score: model=tooth does"


def accused_tooth(network: StoredNetwork, source: Source) -> AccusedTooth:
    """The most suspicious tooth of a recording, whatever its class.

    Raises
    ------
    ConfigError    for a network that scores no teeth, and as `prepare_recording`
    """
    inputs = network.inputs()
    if not (isinstance(network.model, SiteNetwork) and isinstance(inputs, Turns)):
        raise ConfigError(NO_TEETH)
    prepared = prepare_recording(network.description, inputs, source)
    return accused_of_turns(network, prepared.windows, prepared.channels)


def accused_of_turns(
    network: StoredNetwork, turns: WindowSet, channels: Sequence[str]
) -> AccusedTooth:
    """The most suspicious tooth of packed turns of one record.

    Parameters
    ----------
    turns : one input, or one a channel for a network that looks at each by itself
    channels : names of the channels of all inputs, one after the other

    Raises
    ------
    ConfigError    for a network that scores no teeth
    """
    model, inputs = network.model, network.inputs()
    if not (isinstance(model, SiteNetwork) and isinstance(inputs, Turns)):
        raise ConfigError(NO_TEETH)
    windows = torch.from_numpy(turns.cut(np.arange(len(turns))))
    with torch.inference_mode():
        scores = model.site_scores(windows)
        entries = model.entries(windows).tolist()
    require_finite(tooth_scores=scores.numpy())
    names = network.description.class_names
    odds = np.mean([_log_odds(of_input, names) for of_input in scores], axis=0)
    sites = model.sites(tooth_counts(turns.signals[0]))
    gears = np.array([gear for gear, _ in sites])
    teeth = np.array([tooth for _, tooth in sites])
    log_odds = {gear: odds[(gears == gear) & (teeth >= 0)] for gear in GEARS[1:]}
    gear = max(log_odds, key=lambda name: float(log_odds[name].max()))
    tooth = int(log_odds[gear].argmax())
    of_inputs = zip(turns.signals, entries, strict=True)
    turn = np.concatenate(
        [inputs.of_gear(signal, gear, entry) for signal, entry in of_inputs]
    )
    apart = turn[:, tooth] - turn.mean(axis=1)
    spread = turn.std(axis=1).mean(axis=1)
    channel = int((np.square(apart).mean(axis=1) / (spread**2 + 1e-30)).argmax())
    return AccusedTooth(
        gear=gear,
        tooth=tooth,
        channel=channels[channel],
        turn=turn[channel],
        log_odds=log_odds,
    )


def _log_odds(scores: torch.Tensor, class_names: tuple[str, ...]) -> FloatArray:
    """(site,) log of the odds that a fault is there, from scores (site, class)."""
    probability = torch.softmax(scores.flatten(), dim=0).view_as(scores).double()
    faulty = [index for index, name in enumerate(class_names) if name != HEALTHY]
    at_site = probability[:, faulty].sum(dim=1).numpy()
    tiny = np.finfo(float).tiny
    return np.log(at_site + tiny) - np.log1p(-np.minimum(at_site, 1 - 1e-12))


def found_fault_pictures(
    folder: Path, task: Task, metrics: Content
) -> list[tuple[str, str]]:
    """Write the accused tooth of chosen test records as PNG files.

    Parameters
    ----------
    folder : of a finished study, with its models and predictions
    task : of the study
    metrics : content of its ``metrics.json``; the protocol of the headlines is shown

    Returns
    -------
    (file, caption) of each picture; none for a network that scores no teeth
    """
    protocol, network = headline_protocol(metrics), metrics["model"]
    models = sorted(folder.glob(f"models/{protocol}-seed*"))
    if protocol is None or not models:
        return []
    model_folder = models[0]
    stored = StoredClassifier.load(model_folder)
    inputs = stored.inputs()
    if not (isinstance(stored.model, SiteNetwork) and isinstance(inputs, Turns)):
        return []
    seed = model_folder.name.rpartition("-seed")[2]
    with (folder / PREDICTIONS).open(newline="", encoding="utf-8") as file:
        answered = [
            row
            for row in read_records(file)
            if (row["protocol"], row["method"], row["seed"])
            == (protocol, network, seed)
        ]
    part = task.part(protocol, "test")
    segments = subset_segments(task, protocol, "test")
    ids = np.asarray(task.dataset.column("record_id"))[segments.record].astype(str)
    pictures = []
    for number, row in enumerate(shown(answered), start=1):
        record, truth = row["record_id"], row["label"]
        stretch = np.flatnonzero(ids == record)[:1]
        windows = inputs.load(part, segments.of(stretch))
        accused = accused_of_turns(stored, windows, part.channel_names)
        picture = f"tooth_{number}_{truth}.png"
        caption = (
            f"record {record}, truth {truth}, answer {row['predicted']}; {accused.gear}, "
            f"tooth {accused.tooth}"
        )
        tooth_figure(folder / picture, accused, caption)
        pictures.append((picture, caption))
    return pictures


def shown(answered: Sequence[Mapping[str, str]]) -> list[Mapping[str, str]]:
    """The first found fault of each class, and the first wrong answer; `MOST_PICTURES` at most.

    Both are rows of the table of predictions.
    """
    right = [row for row in answered if row["label"] == row["predicted"]]
    wrong = [row for row in answered if row["label"] != row["predicted"]][:1]
    found: dict[str, Mapping[str, str]] = {}
    for row in right:
        if row["label"] != HEALTHY:
            found.setdefault(row["label"], row)
    return [*list(found.values())[: MOST_PICTURES - len(wrong)], *wrong]
