"""The maps of `diagnose detectability` in words, and in JSON for machines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from diagnose.detectability.maps import Maps, best_and_worst
from diagnose.detectability.observers import Seen


def summary(maps: Maps, again: Seen) -> list[str]:
    """One line an observer: the best test, and the worst.

    ``again`` is the best one on other machines.
    """
    best, worst = best_and_worst(maps.seen)
    known_best, known_worst = best_and_worst(maps.known)
    others = f"{again.d_prime:.2f} +- {again.standard_error:.2f}, {again.auroc:.2f}"
    return [
        f"seen by indicators among {maps.n_units} machines: best at {place_text(maps, best)} with "
        f"{maps.indicators[int(maps.indicator[best])]}: d' {maps.seen[best]:.2f} +- {maps.standard_error[best]:.2f}, "
        f"AUROC {maps.auroc[best]:.2f} (on {maps.n_units} others {others}); "
        f"worst at {place_text(maps, worst)}: d' {maps.seen[worst]:.2f}",
        f"physically there (known residual): best at {place_text(maps, known_best)}: "
        f"d' {short(maps.known[known_best])}; worst at {place_text(maps, known_worst)}: "
        f"d' {short(maps.known[known_worst])}",
    ]


def short(value: float) -> str:
    """Three digits that count, without a power of ten below a million."""
    return f"{value:.0f}" if 100.0 <= value < 1e6 else f"{value:.3g}"


def place_text(maps: Maps, place: Sequence[int]) -> str:
    """A test in words."""
    speed, torque, channel, band = place
    return (
        f"{maps.speeds_rpm[speed]:g} r/min, {maps.torques_nm[torque]:g} N m, {maps.channels[channel]}, up to "
        f"{maps.bandwidths[band] / 1e3:.3g} kHz"
    )


def content(maps: Maps, again: Seen) -> dict[str, Any]:
    """The keys of ``diagnose detectability --json``.

    ``tests`` has a row a speed, torque, channel and bandwidth.
    """
    best = best_and_worst(maps.seen)[0]
    return {
        "fault": maps.fault,
        "n_units": maps.n_units,
        "duration_s": maps.duration,
        "n_failed": maps.n_failed,
        "indicators": list(maps.indicators),
        "summary": summary(maps, again),
        "best_seen": {
            **_test(maps, best),
            "fault_raises_it": bool(maps.raises[best]),
            "d_prime_on_others": _plain(again.d_prime),
            "standard_error_on_others": _plain(again.standard_error),
            "auroc_on_others": _plain(again.auroc),
        },
        "tests": [_test(maps, place) for place in np.ndindex(maps.known.shape)],
    }


def _test(maps: Maps, place: tuple[int, ...]) -> dict[str, Any]:
    speed, torque, channel, band = place
    chosen = int(maps.indicator[place])
    return {
        "speed_rpm": maps.speeds_rpm[speed],
        "torque_nm": maps.torques_nm[torque],
        "channel": maps.channels[channel],
        "bandwidth_hz": maps.bandwidths[band],
        "band_low_hz": maps.bandwidths[band - 1] if band else 0.0,
        "d_prime_known": _plain(maps.known[place]),
        "d_prime_known_band": _plain(maps.known_band[place]),
        "d_prime_seen": _plain(maps.seen[place]),
        "standard_error_seen": _plain(maps.standard_error[place]),
        "auroc_seen": _plain(maps.auroc[place]),
        "indicator": maps.indicators[chosen] if chosen >= 0 else None,
        "noise_rms_m_per_s2": _plain(maps.noise_rms[place[:3]]),
    }


def _plain(value: Any) -> float | None:
    return float(value) if math.isfinite(value) else None
