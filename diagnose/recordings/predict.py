"""One recording and a trained network: its answer, and a flag for what is unlike the training."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnose.recordings.source import (
    SPEED_TOLERANCE,
    Source,
    prepare_recording,
    tracking_facts,
)
from diagnose.recordings.stored_network import StoredNetwork
from gensig.signals.mesh_motion import in_hertz

if TYPE_CHECKING:
    from diagnose.data.tracking import Tracked
    from diagnose.data.windows import WindowSet
    from diagnose.networks.domain import Domain
    from diagnose.training.store import ModelDescription


def predict_recording(
    network: StoredNetwork,
    domain: Domain | None,
    source: Source,
) -> dict[str, Any]:
    """Answer for a recording and for its windows, and the out-of-distribution flag.

    The recording counts as out of distribution if at least half of its windows lie farther from
    the training windows than the threshold, its speed lies outside those of the training records,
    its gears have other teeth, or the network has reasons of its own. With a tachometer, or with
    teeth and speed, the recording is first played at one constant speed.

    Parameters
    ----------
    network : of `diagnose.recordings.registry.open_network`
    domain : of `diagnose.training.store.load_domain`
    source : the recording

    Returns
    -------
    plain dictionary, the content of ``diagnose predict --json``

    Raises
    ------
    ConfigError    for a recording that cannot be read, is too short or too slowly sampled, or
        whose channels do not fit, and for what the network must know of it
    """
    description = network.description
    network.check(source)
    prepared = prepare_recording(description, source)
    windows, tracked = prepared.windows, prepared.tracked
    answer = network.answer(source, prepared)
    rate = description.sampling_rate_hz
    rows = [
        {"start_s": float(start / rate), **row, "distance": None, "beyond": None}
        for start, row in zip(windows.start, answer.windows, strict=True)
    ]
    beyond = None
    if domain is not None:
        beyond = _with_distances(rows, domain, windows)
    reasons = reasons_unlike(description, source, tracked, beyond) + answer.reasons
    n_teeth = description.n_teeth
    return {
        "recording": source.file,
        **answer.record,
        "out_of_distribution": None
        if beyond is None and not reasons
        else bool(reasons),
        "reasons": reasons,
        "n_windows": len(windows),
        "n_windows_beyond": None if beyond is None else int(beyond.sum()),
        "distance_threshold": None if domain is None else domain.threshold,
        "window_duration_s": prepared.duration_s,
        "windows": rows,
        "channels": dict(
            zip(description.channel_names, prepared.channels, strict=True)
        ),
        "sampling_rate_hz": prepared.recording.sampling_rate,
        "model_sampling_rate_hz": rate,
        **answer.conditions,
        "order_tracking": None if tracked is None else tracking_facts(tracked, source),
        "trained_n_teeth": None if n_teeth is None else list(n_teeth),
        **answer.training,
    }


def _with_distances(
    rows: list[dict[str, Any]],
    domain: Domain,
    windows: WindowSet,
) -> NDArray[np.bool_]:
    """(window,) bool of windows beyond the domain; their distances are written into the rows."""
    from diagnose.networks.domain import distances

    distance = distances(domain, windows)
    beyond = distance > domain.threshold
    for row, far, is_beyond in zip(rows, distance, beyond, strict=True):
        row |= {"distance": float(far), "beyond": bool(is_beyond)}
    return beyond


def reasons_unlike(
    description: ModelDescription,
    source: Source,
    tracked: Tracked | None,
    beyond: NDArray[np.bool_] | None,
) -> list[str]:
    """Reasons why a recording is out of distribution; empty if it is not."""
    reasons = []
    if beyond is not None and 2 * beyond.sum() >= beyond.size:
        reasons.append(
            f"{beyond.sum()} of {beyond.size} windows are unlike the training data"
        )
    if description.speed_rpm_range is not None:
        low, high = description.speed_rpm_range
        speeds = (source.speed_rpm,) if tracked is None else tracked.speed_range_rpm
        outside = [
            speed
            for speed in speeds
            if speed
            and not low * (1 - SPEED_TOLERANCE) <= speed <= high * (1 + SPEED_TOLERANCE)
        ]
        if outside:
            hint = in_hertz(outside[-1]) if low <= 60.0 * outside[-1] <= high else ""
            reasons.append(
                f"{outside[-1]:g} r/min is outside the {low:.0f} to {high:.0f} r/min of the training{hint}",
            )
    if (
        source.teeth is not None
        and description.n_teeth is not None
        and source.teeth != description.n_teeth
    ):
        given, known = (
            "/".join(map(str, teeth)) for teeth in (source.teeth, description.n_teeth)
        )
        reasons.append(f"the gears have {given} teeth, those of the training {known}")
    return reasons
