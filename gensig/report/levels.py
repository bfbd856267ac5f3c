"""Vibration levels of the records in the units of machine monitoring."""

from __future__ import annotations

import bisect
from collections.abc import Sequence

import numpy as np

from gensig.arrays import FloatArray
from gensig.dataset.reader import Dataset
from gensig.report.values import Measured
from gensig.signals.recording import STANDARD_GRAVITY
from gensig.text.escaping import plain
from gensig.text.page import Table

# class, channel, RMS in m/s^2, velocity RMS in m/s
Level = tuple[str, str, float, float]

VELOCITY = "velocity_rms"
LEVELS = "Levels in m/s², g and mm/s, medians of each class"
BAND = (10.0, 1000.0)  # Hz, of broad-band velocity in ISO 20816-1 and -3
# m/s, zone boundary C/D of ISO 20816-3 for large machines on flexible supports
HARMFUL_VELOCITY = 11.0e-3
# upper ends of zones A, B and C of ISO 20816-3 on rigid foundations, mm/s, by power up to kW:
# group 2, then group 1; from memory
ZONES = "ABCD"
ZONE_LIMITS = {300.0: (1.4, 2.8, 4.5), float("inf"): (2.3, 4.5, 7.1)}
LEAST_POWER = 15.0  # kW, from which the standard applies
# assumed: published housings of healthy gears stay below
LOUD_ACCELERATION = 10.0 * STANDARD_GRAVITY


def velocity_rms(signal: FloatArray, sampling_rate: float) -> FloatArray:
    """RMS velocity in `BAND`, m/s, (channel,), of accelerations in m/s^2, (channel, sample).

    Integrated in the spectrum, under a Hann window so that the steps at the ends do not leak into
    low frequencies.
    """
    from scipy.signal import periodogram

    frequency, density = periodogram(signal, sampling_rate, window="hann")
    held = (frequency >= BAND[0]) & (frequency <= BAND[1])
    power = density[..., held] / (2.0 * np.pi * frequency[held]) ** 2
    return np.asarray(np.sqrt(power.sum(axis=-1) * frequency[1]))


def vibration_zone(velocity: float, power_kw: float) -> str:
    """Zone of ISO 20816-3, A to D, of a velocity RMS in m/s on a rigid foundation."""
    return ZONES[bisect.bisect_left(_limits(power_kw), 1e3 * velocity)]


def zone_limits(power_kw: float) -> str:
    """The limits of the zones in words."""
    limits = [
        f"{zone} to {limit:g}"
        for zone, limit in zip(ZONES, _limits(power_kw), strict=False)
    ]
    text = f"rigid foundation: {', '.join(limits)} mm/s"
    if power_kw < LEAST_POWER:
        text += f"; the standard is for {LEAST_POWER:g} kW and more"
    return text


def _limits(power_kw: float) -> tuple[float, ...]:
    return next(limits for power, limits in ZONE_LIMITS.items() if power_kw <= power)


def class_levels(
    data: Dataset, measured: Measured, channels: Sequence[str], units: Sequence[str]
) -> list[Level]:
    """Medians of each class and accelerometer; empty where no acceleration is in m/s^2."""
    label = data.column("label_name")[measured.records]
    rms, velocity = measured.values["rms"], measured.values.get(VELOCITY)
    if velocity is None:
        return []
    return [
        (
            plain(name),
            plain(channel),
            float(np.nanmedian(rms[mine, column])),
            float(np.nanmedian(velocity[mine, column])),
        )
        for name in data.class_names
        if (mine := label == name).any()
        for column, channel in enumerate(channels)
        if units[column] == "m/s^2"
    ]


def level_table(levels: Sequence[Level]) -> Table | None:
    """Levels in three units; None where there is none."""
    if not levels:
        return None
    head = (
        "class",
        "channel",
        "RMS, m/s²",
        "RMS, g",
        "velocity RMS 10 to 1000 Hz, mm/s",
    )
    rows = [
        (*names, f"{rms:.3g}", f"{rms / STANDARD_GRAVITY:.3g}", f"{1e3 * velocity:.3g}")
        for *names, rms, velocity in levels
    ]
    return Table(head=head, rows=rows, folded=LEVELS)


def loudness(levels: Sequence[Level]) -> list[str]:
    """One sentence where a level is beyond what housings of machines in service show.

    Empty elsewhere.
    """
    loud = [
        name
        for name, _, rms, velocity in levels
        if rms > LOUD_ACCELERATION or velocity > HARMFUL_VELOCITY
    ]
    if not loud:
        return []
    return [
        f"Louder than most published housings: {', '.join(dict.fromkeys(loud))}. "
        f"Above {LOUD_ACCELERATION / STANDARD_GRAVITY:g} g, "
        f"or above {1e3 * HARMFUL_VELOCITY:g} mm/s, from which ISO 20816-3 expects damage "
        "of large machines on flexible supports. Compare shapes and ratios between "
        "classes with measurements, not levels; noise is relative to the signal, so that "
        "it is as loud."
    ]
