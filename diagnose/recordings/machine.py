"""Adaptation of a stored network to one machine by its healthy recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from diagnose.data.windows import WindowSet
from diagnose.networks.adaptation import HEALTHY, adapt_domain, adapt_network
from diagnose.networks.domain import distances
from diagnose.networks.registry import input_of
from diagnose.recordings.prepared import prepare_recording, trained_at
from diagnose.recordings.source import Source
from diagnose.studies.result_files import sha256
from diagnose.training.classes import predict_windows
from diagnose.training.store import (
    ModelDescription,
    load_domain,
    load_model,
    load_statistics,
    save_model,
)
from gensig.errors import ConfigError, DatasetError


def adapt_model(
    folder: str | Path, sources: Sequence[Source], method: str, out: str | Path
) -> dict[str, Any]:
    """Adapt a stored network to a machine and store the result as another network.

    Parameters
    ----------
    folder : of a network as trained
    sources : recordings of the machine, all of them healthy
    method : key of `diagnose.networks.adaptation.METHODS`
    out : folder to write

    Returns
    -------
    plain dictionary: windows, mean probability of health and windows unlike the training, each
    before and after, and the files that carried implants in the training: what is said of these
    is memory

    Raises
    ------
    DatasetError    for a network that was adapted before, stores no healthy statistics or has no
        class of that name
    ConfigError    for recordings that do not fit the network, are too short, or of a speed that it
        was not trained at
    """
    model, description = load_model(folder)
    if description.adaptation is not None:
        raise DatasetError(
            f"{folder} was adapted before; take the network that was trained"
        )
    statistics = load_statistics(folder)
    if statistics is None:
        raise DatasetError(
            f"{folder} stores no healthy statistics (no class {HEALTHY}, or too old); "
            "train it again"
        )
    for source in sources:
        _check_speed(source, description)
    inputs = input_of(description.network)
    prepared = [
        prepare_recording(description, inputs, source, is_scored=False)
        for source in sources
    ]
    parts = [one.windows for one in prepared]
    windows = together(parts)
    adapted = adapt_network(model, statistics, windows, method)
    weights = {name: value.numpy() for name, value in adapted.state_dict().items()}
    domain = moved = load_domain(folder, description)
    if domain is not None:
        moved = adapt_domain(domain, statistics, windows)
        weights |= moved.tensors()
    recordings = [
        {
            "file": Path(source.file).name,
            "array": source.array,
            "sha256": sha256(Path(source.file).expanduser()),
            "n_windows": len(part),
        }
        for source, part in zip(sources, parts, strict=True)
    ]
    adaptation = {"method": method, "matched": "healthy", "recordings": recordings}
    save_model(Path(out), weights, replace(description, adaptation=adaptation))
    healthy = description.class_names.index(HEALTHY)
    result: dict[str, Any] = {
        "method": method,
        "n_recordings": len(parts),
        "n_windows": len(windows),
        "carried": [
            source.file
            for source, one in zip(sources, prepared, strict=True)
            if one.carried
        ],
    }
    for when, network, region in (("before", model, domain), ("after", adapted, moved)):
        beyond = None
        if region is not None:
            beyond = int((distances(region, windows) > region.threshold).sum())
        mean = np.exp(predict_windows(network, windows)[:, healthy]).mean()
        result[when] = {"probability_healthy": float(mean), "n_windows_beyond": beyond}
    return result


def together(parts: Sequence[WindowSet]) -> WindowSet:
    """Windows of several sets as one set, with their records numbered one after another."""
    signals: list[Any] = []
    segment, record = [], []
    n_records = 0
    for part in parts:
        segment.append(part.segment + len(signals))
        record.append(part.record + n_records)
        signals += part.signals
        n_records += int(part.record.max()) + 1
    return replace(
        parts[0],
        signals=tuple(signals),
        segment=np.concatenate(segment),
        start=np.concatenate([part.start for part in parts]),
        label=np.concatenate([part.label for part in parts]),
        record=np.concatenate(record),
    )


def _check_speed(source: Source, description: ModelDescription) -> None:
    """Refuse healthy recordings of another speed: its effect would be taken for the machine's."""
    trained, speed = description.speed_rpm_range, source.speed_rpm
    if speed and trained and not trained_at(description, speed):
        low, high = trained
        raise ConfigError(
            f"--speed-rpm {speed:g} is outside the {low:.0f} to {high:.0f} r/min of the training; "
            "adapt at speeds of the training, or train at this one"
        )
