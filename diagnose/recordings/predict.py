"""One recording and a trained network: its answer, and a flag for what is unlike the training."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnose.recordings.prepared import prepare_recording, tracking_facts, trained_at
from diagnose.recordings.source import Source
from diagnose.recordings.stored_network import StoredNetwork, require_finite
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
    its gears have other teeth, or the network gives further reasons. With a tachometer, or with
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
    DatasetError    for one that carried implants in the training, unless what was held out is asked
        for
    """
    description = network.description
    network.check(source)
    prepared = prepare_recording(description, network.inputs(), source)
    windows, tracked = prepared.windows, prepared.tracked
    answer = network.answer(source, prepared)
    rate, n_teeth = description.sampling_rate_hz, description.n_teeth
    rows = [
        {"start_s": float(start / rate), **row, "distance": None, "beyond": None}
        for start, row in zip(windows.start, answer.windows, strict=True)
    ]
    beyond = n_beyond = threshold = tracking = None
    if domain is not None:
        beyond = _with_distances(rows, domain, windows)
        n_beyond, threshold = int(beyond.sum()), domain.threshold
    if tracked is not None:
        tracking = tracking_facts(tracked, source)
    held_out = None
    if prepared.held_out is not None:
        held_out = prepared.held_out.facts()
    reasons = reasons_unlike(description, source, tracked, beyond) + answer.reasons
    is_unlike = None
    if reasons or domain is not None:
        is_unlike = bool(reasons)
    return {
        "recording": source.file,
        **answer.record,
        "out_of_distribution": is_unlike,
        "reasons": reasons,
        "n_windows": len(windows),
        "n_windows_beyond": n_beyond,
        "distance_threshold": threshold,
        "window_duration_s": prepared.duration_s,
        "windows": rows,
        "channels": _channels(description, prepared.channels),
        "sampling_rate_hz": prepared.recording.sampling_rate,
        "model_sampling_rate_hz": rate,
        **answer.conditions,
        "order_tracking": tracking,
        "held_out": held_out,
        "trained_n_teeth": n_teeth and list(n_teeth),
        **answer.training,
    }


def _channels(
    description: ModelDescription, in_file: tuple[str, ...]
) -> dict[str, str]:
    """Name in the file of each channel of the network."""
    if description.takes_each_channel:
        return dict(zip(in_file, in_file, strict=True))
    return dict(zip(description.channel_names, in_file, strict=True))


def _with_distances(
    rows: list[dict[str, Any]],
    domain: Domain,
    windows: WindowSet,
) -> NDArray[np.bool_]:
    """(window,) bool of windows beyond the domain; their distances are written into the rows."""
    from diagnose.networks.domain import distances

    distance = distances(domain, windows)
    require_finite(distance=distance)
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
    speeds: tuple[float | None, ...] = (source.speed_rpm,)
    if tracked is not None:
        speeds = tracked.speed_range_rpm
    outside = [
        speed for speed in speeds if speed and not trained_at(description, speed)
    ]
    if outside and description.speed_rpm_range is not None:
        (low, high), speed = description.speed_rpm_range, outside[-1]
        hint = ""
        if low <= 60.0 * speed <= high:
            hint = in_hertz(speed)
        reasons.append(
            f"{speed:g} r/min is outside the {low:.0f} to {high:.0f} r/min of the training{hint}",
        )
    given, known = source.teeth, description.n_teeth
    if given and known and given != known:
        reasons.append(
            f"the gears have {given[0]}/{given[1]} teeth, "
            f"those of the training {known[0]}/{known[1]}"
        )
    if given and description.n_teeth_range:
        gears = zip(
            given, description.n_teeth_range, ("driving", "driven"), strict=True
        )
        reasons += [
            f"the {name} gear has {teeth} teeth, those of the training {low} to {high}"
            for teeth, (low, high), name in gears
            if not low <= teeth <= high
        ]
    return reasons
