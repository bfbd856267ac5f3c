"""Maps of `diagnose detectability` in words, and as content of a JSON file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from diagnose.detectability.maps import Maps, best_and_worst
from diagnose.detectability.observers import Seen
from gensig.text.amounts import finite


def summary(maps: Maps, confirmation: Seen) -> list[str]:
    """One line an observer: the best test, and the worst.

    Parameters
    ----------
    confirmation : the best test on other machines
    """
    best, worst = best_and_worst(maps.seen)
    known_best, known_worst = best_and_worst(maps.known)
    others = (
        f"{confirmation.d_prime:.2f} +- {confirmation.standard_error:.2f}, "
        f"{confirmation.auroc:.2f}"
    )
    return [
        f"seen by indicators among {maps.n_units} machines: best at {place_text(maps, best)} "
        f"with {maps.indicators[int(maps.indicator[best])]}: d' {maps.seen[best]:.2f} "
        f"+- {maps.standard_error[best]:.2f}, AUROC {maps.auroc[best]:.2f} "
        f"(on {maps.n_units} others {others}); "
        f"worst at {place_text(maps, worst)}: d' {maps.seen[worst]:.2f}",
        f"physically there (known residual): best at {place_text(maps, known_best)}: "
        f"d' {short(maps.known[known_best])}; worst at {place_text(maps, known_worst)}: "
        f"d' {short(maps.known[known_worst])}",
    ]


def short(value: float) -> str:
    """Three significant digits, without a power of ten below a million."""
    if 100.0 <= value < 1e6:
        return f"{value:.0f}"
    return f"{value:.3g}"


def two_digits(value: float) -> str:
    """Two digits behind the point, never -0.00."""
    return f"{round(value, 2) + 0.0:.2f}"


def place_text(maps: Maps, place: Sequence[int]) -> str:
    """A test in words."""
    speed, torque, channel, band = place
    return (
        f"{maps.speeds_rpm[speed]:g} r/min, {maps.torques_nm[torque]:g} N m, "
        f"{maps.channels[channel]}, up to {maps.bandwidths[band] / 1e3:.3g} kHz"
    )


def content(maps: Maps, confirmation: Seen) -> dict[str, Any]:
    """Content of ``diagnose detectability --json``.

    ``tests`` has a row for each speed, torque, channel and bandwidth.
    """
    best = best_and_worst(maps.seen)[0]
    return {
        "fault": maps.fault,
        "n_units": maps.n_units,
        "duration_s": maps.duration,
        "n_failed": maps.n_failed,
        "indicators": list(maps.indicators),
        "summary": summary(maps, confirmation),
        "best_seen": {
            **_test(maps, best),
            "fault_raises_it": bool(maps.raises[best]),
            "d_prime_on_others": finite(confirmation.d_prime),
            "standard_error_on_others": finite(confirmation.standard_error),
            "auroc_on_others": finite(confirmation.auroc),
        },
        "tests": [_test(maps, place) for place in np.ndindex(maps.known.shape)],
    }


def _test(maps: Maps, place: tuple[int, ...]) -> dict[str, Any]:
    speed, torque, channel, band = place
    indicators = dict(enumerate(maps.indicators))  # -1 where there is none
    return {
        "speed_rpm": maps.speeds_rpm[speed],
        "torque_nm": maps.torques_nm[torque],
        "channel": maps.channels[channel],
        "bandwidth_hz": maps.bandwidths[band],
        "band_low_hz": (0.0, *maps.bandwidths)[band],
        "d_prime_known": finite(maps.known[place]),
        "d_prime_known_band": finite(maps.known_band[place]),
        "d_prime_seen": finite(maps.seen[place]),
        "standard_error_seen": finite(maps.standard_error[place]),
        "auroc_seen": finite(maps.auroc[place]),
        "indicator": indicators.get(int(maps.indicator[place])),
        "noise_rms_m_per_s2": finite(maps.noise_rms[place[:3]]),
    }
