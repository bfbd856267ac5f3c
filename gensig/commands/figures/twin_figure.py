"""Figure of a fitted machine: its levels with the measured ones, and the fitted path."""

from __future__ import annotations

import numpy as np

from gensig.commands.figures.panels import (
    FAULTY,
    FREQUENCY,
    GREY,
    SOUND,
    Figure,
    Panel,
    band,
    curve,
)
from gensig.twin.check import Check
from gensig.twin.fitting import Fit


def twin_figure(fitted: Fit, check: Check) -> Figure:
    """Third-octave levels and path gain over frequency, a row for each sensor."""
    rows = []
    for index, sensor in enumerate(fitted.sensors):
        simulated = check.twin_db[:, index]
        low, high = simulated.min(axis=0), simulated.max(axis=0)
        shade = {"alpha": 0.3, "label": "twin, least to greatest"}
        median = np.median(simulated, axis=0)
        levels = [
            band(check.band, low, high, SOUND, **shade),
            curve(check.band, median, "twin, median", SOUND),
            curve(check.band, check.measured_db[index], "measured, held out", FAULTY),
        ]
        gain = 20.0 * np.log10(np.maximum(fitted.gain[index], 1e-12))
        heard = np.where(fitted.heard[index], gain, np.nan)
        gains = [
            curve(fitted.gain_frequency, gain, "filled in", GREY),
            curve(fitted.gain_frequency, heard, "gears heard", SOUND),
        ]
        panels = (
            (sensor, "third-octave level, dB re 1 m/s$^2$", levels),
            (f"{sensor}: fitted path", "gain from the bearing, dB", gains),
        )
        rows.append(
            [
                Panel(title, FREQUENCY, unit, marks, log="x", grid=True)
                for title, unit, marks in panels
            ]
        )
    return Figure(rows, (11, 2.8 * len(rows)))
