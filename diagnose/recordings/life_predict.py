"""One recording and a network of remaining lives: hours that are left, with an interval."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from diagnose.recordings.predict import (
    SPEED_TOLERANCE,
    Source,
    reasons_unlike,
    tracking_facts,
    window_duration,
    windows_of,
)
from diagnose.scoring.life_scores import interval
from diagnose.training.life_store import AGE, LifeFacts
from gensig.errors import ConfigError

if TYPE_CHECKING:
    from diagnose.networks.domain import Domain
    from diagnose.training.remaining_life import LifeNetwork
    from diagnose.training.store import ModelDescription

OPTIONS = {"speed_rpm": "--speed-rpm", "torque_nm": "--torque-nm", AGE: "--life-time-h"}
UNITS = {"speed_rpm": "r/min", "torque_nm": "N m", AGE: "h"}


def predict_life(
    model: LifeNetwork,
    description: ModelDescription,
    facts: LifeFacts,
    domain: Domain | None,
    source: Source,
    *,
    torque_nm: float | None = None,
    life_time_h: float | None = None,
) -> dict[str, Any]:
    """Remaining life that a network says of a recording, with the interval of its training.

    The recording counts as out of distribution as in
    `diagnose.recordings.predict.predict_recording`, and where torque or age lie outside those of the
    training.

    Parameters
    ----------
    model, description, facts : of `diagnose.training.life_store.load_life_model`
    domain : of `diagnose.training.store.load_domain`
    source : the recording; its speed must be known
    torque_nm : N m of the driving shaft
    life_time_h : h of clock time since the machine was new; only for a network that is told the age

    Returns
    -------
    plain dictionary, the content of ``diagnose predict --json``

    Raises
    ------
    ConfigError    for what the network must know and is not told, and a recording that cannot be used
    """
    from diagnose.networks.domain import distances
    from diagnose.training.remaining_life import shares_of_windows

    _check_told(facts, source, torque_nm, life_time_h)
    windows, recording, channels, tracked = windows_of(description, source)
    speed = source.speed_rpm if tracked is None else source.to_speed_rpm or tracked.speed_rpm
    values = {"speed_rpm": speed, "torque_nm": torque_nm, AGE: life_time_h}
    if speed is None:
        raise ConfigError(f"this model must know the speed of {source.file}: say --speed-rpm or --tacho")
    told = np.array([[float(values[name] or 0.0) for name in facts.told]])
    by_window = shares_of_windows(model, windows, told)
    level = facts.early_life_h
    share = float(np.clip(by_window.mean(), 0.0, 1.0))
    low, high = (float(end) for end in interval(np.array(share * level), facts.half_width_h, level))
    distance = None if domain is None else distances(domain, windows)
    beyond = None if domain is None or distance is None else distance > domain.threshold
    reasons = reasons_unlike(description, source, tracked, beyond)
    reasons += [line for name in ("torque_nm", AGE) if (line := _outside(facts, name, values[name]))]
    rate = description.sampling_rate_hz
    return {
        "recording": source.file,
        "remaining_life_h": share * level,
        "low_h": low,
        "high_h": high,
        "at_early_level": share == 1.0,
        "early_life_h": level,
        "coverage": facts.coverage,
        "intervals_hold": facts.intervals_hold,
        "n_calibration_lives": facts.n_calibration_lives,
        "method": facts.method,
        "out_of_distribution": None if beyond is None and not reasons else bool(reasons),
        "reasons": reasons,
        "n_windows": len(windows),
        "n_windows_beyond": None if beyond is None else int(beyond.sum()),
        "distance_threshold": None if domain is None else domain.threshold,
        "window_duration_s": window_duration(description, recording),
        "windows": [
            {
                "start_s": float(start / rate),
                "remaining_life_h": float(np.clip(by_window[index], 0.0, 1.0)) * level,
                "distance": None if distance is None else float(distance[index]),
                "beyond": None if beyond is None else bool(beyond[index]),
            }
            for index, start in enumerate(windows.start)
        ],
        "channels": dict(zip(description.channel_names, channels, strict=True)),
        "sampling_rate_hz": recording.sampling_rate,
        "model_sampling_rate_hz": rate,
        "told": {name: values[name] for name in facts.told},
        "trained_range": {name: list(facts.told_range[name]) for name in facts.told},
        "order_tracking": None if tracked is None else tracking_facts(tracked, source),
        "trained_n_teeth": None if description.n_teeth is None else list(description.n_teeth),
        "trained_classes": list(description.class_names),
    }


def life_summary(result: dict[str, Any]) -> str:
    """One line for people."""
    level = result["early_life_h"]
    left = f"{level:.3g} h or longer" if result["at_early_level"] else f"{result['remaining_life_h']:.3g} h left"
    said = f"{result['recording']}: {left}"
    if result["intervals_hold"]:
        end = f"{result['high_h']:.3g} h" + (" or longer" if result["high_h"] >= level else "")
        said += f", {result['coverage']:.0%} interval {result['low_h']:.3g} to {end}"
    else:
        said += f"; no interval: {result['n_calibration_lives']} validation lives are too few for one"
    if result["out_of_distribution"]:
        return f"{said}; OUT OF DISTRIBUTION, do not rely on it: {'; '.join(result['reasons'])}"
    return f"{said}; like the training data ({result['n_windows_beyond']} of {result['n_windows']} windows beyond it)"


def _check_told(facts: LifeFacts, source: Source, torque_nm: float | None, life_time_h: float | None) -> None:
    """Refuse what is missing, what is no such number, and an age that the network is not told."""
    for name, value in (("torque_nm", torque_nm), (AGE, life_time_h)):
        if value is None and name in facts.told:
            raise ConfigError(f"this model must know {name} of {source.file}: say {OPTIONS[name]}")
        if value is not None and name not in facts.told:
            raise ConfigError(f"{OPTIONS[name]}: {facts.method} is not told {name}; leave it out")
        if value is not None and not 0.0 <= value < float("inf"):
            raise ConfigError(f"{OPTIONS[name]} {value:g} must be 0 or above")


def _outside(facts: LifeFacts, name: str, value: float | None) -> str | None:
    """Why a value is unlike those of the training."""
    if value is None:
        return None
    low, high = facts.told_range[name]
    if low * (1 - SPEED_TOLERANCE) <= value <= high * (1 + SPEED_TOLERANCE):
        return None
    return f"{value:g} {UNITS[name]} is outside the {low:.4g} to {high:.4g} {UNITS[name]} of the training"
