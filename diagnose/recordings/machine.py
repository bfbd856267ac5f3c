"""One machine's healthy recordings and a stored network.

The network as it should hear that machine.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from diagnose.data.windows import WindowSet
from diagnose.networks.adaptation import HEALTHY, adapt_domain, adapt_network
from diagnose.networks.domain import distances
from diagnose.recordings.source import SPEED_TOLERANCE, Source, prepare_recording
from diagnose.training.classes import predict_windows
from diagnose.training.store import load_domain, load_model, load_statistics, save_model
from gensig.errors import ConfigError, DatasetError


def adapt_model(
    folder: str | Path, sources: Sequence[Source], method: str, out: str | Path
) -> dict[str, Any]:
    """Adapt a stored network to a machine and store what comes out as another one, for ``diagnose
    predict``.

    Parameters
    ----------
    folder : of a network as trained
    sources : recordings of the machine, all of them healthy
    method : key of `diagnose.networks.adaptation.METHODS`
    out : folder to write

    Returns
    -------
    plain dictionary: windows, mean probability of health and windows unlike the training, each before and after

    Raises
    ------
    DatasetError    for a network that was adapted before, stores no healthy statistics or has no class of that name
    ConfigError    for recordings that do not fit the network, are too short, or of a speed that it was not trained at
    """
    model, description = load_model(folder)
    if description.adaptation is not None:
        raise DatasetError(
            f"{folder} was adapted before; take the network that was trained"
        )
    statistics = load_statistics(folder)
    if statistics is None:
        raise DatasetError(
            f"{folder} stores no healthy statistics (no class {HEALTHY}, or too old); train it again"
        )
    for source in sources:
        _check_speed(source, description.speed_rpm_range)
    parts = [prepare_recording(description, source).windows for source in sources]
    windows = together(parts)
    adapted = adapt_network(model, statistics, windows, method)
    domain = load_domain(folder, description)
    moved = None if domain is None else adapt_domain(domain, statistics, windows)
    recordings = [
        {
            "file": Path(source.file).name,
            "array": source.array,
            "sha256": _sha256(source.file),
            "n_windows": len(part),
        }
        for source, part in zip(sources, parts, strict=True)
    ]
    weights = {name: value.numpy() for name, value in adapted.state_dict().items()}
    known = {} if moved is None else moved.tensors()
    adaptation = {"method": method, "matched": "healthy", "recordings": recordings}
    save_model(Path(out), weights | known, replace(description, adaptation=adaptation))
    healthy = description.class_names.index(HEALTHY)
    result: dict[str, Any] = {
        "method": method,
        "n_recordings": len(parts),
        "n_windows": len(windows),
    }
    for when, network, region in (("before", model, domain), ("after", adapted, moved)):
        beyond = (
            None
            if region is None
            else int((distances(region, windows) > region.threshold).sum())
        )
        said = np.exp(predict_windows(network, windows)[:, healthy]).mean()
        result[when] = {"probability_healthy": float(said), "n_windows_beyond": beyond}
    return result


def together(parts: Sequence[WindowSet]) -> WindowSet:
    """Windows of several sets as one; each keeps its signals, records are counted on."""
    n_signals = np.cumsum([0, *(len(part.signals) for part in parts)])
    n_records = np.cumsum([0, *(int(part.record.max()) + 1 for part in parts)])
    moved = [
        replace(
            part,
            segment=part.segment + n_signals[index],
            record=part.record + n_records[index],
        )
        for index, part in enumerate(parts)
    ]
    return replace(
        parts[0],
        signals=tuple(signal for part in parts for signal in part.signals),
        segment=np.concatenate([part.segment for part in moved]),
        start=np.concatenate([part.start for part in parts]),
        label=np.concatenate([part.label for part in parts]),
        record=np.concatenate([part.record for part in moved]),
    )


def _check_speed(source: Source, trained: tuple[float, float] | None) -> None:
    """Refuse healthy recordings of another speed: its effect would be taken for the machine's."""
    if source.speed_rpm is None or trained is None:
        return
    low, high = trained
    if (
        not low * (1 - SPEED_TOLERANCE)
        <= source.speed_rpm
        <= high * (1 + SPEED_TOLERANCE)
    ):
        raise ConfigError(
            f"--speed-rpm {source.speed_rpm:g} is outside the {low:.0f} to {high:.0f} r/min of the training; adapt at "
            "speeds of the training, or train at this one"
        )


def _sha256(file: str) -> str:
    return hashlib.sha256(Path(file).expanduser().read_bytes()).hexdigest()
