"""Figure of a fitted machine: its levels with the measured ones, and the fitted path."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gensig.commands.figures.style import (
    FAULTY,
    FREQUENCY,
    GREY,
    SOUND,
    panels,
    save,
)
from gensig.twin.check import Check
from gensig.twin.fitting import Fit


def plot_twin(fitted: Fit, check: Check, path: Path) -> None:
    """Draw third-octave levels and path gain over frequency, a row for each sensor."""
    n_sensors = len(fitted.sensors)
    figure, axes = panels(n_sensors, 2, 11, 2.8 * n_sensors)
    for index, (sensor, row) in enumerate(zip(fitted.sensors, axes, strict=True)):
        levels, gains = row
        simulated = check.twin_db[:, index]
        levels.fill_between(
            check.band,
            simulated.min(axis=0),
            simulated.max(axis=0),
            color=SOUND,
            alpha=0.3,
            label="twin, least to greatest",
        )
        median = np.median(simulated, axis=0)
        measured = check.measured_db[index]
        levels.semilogx(check.band, median, color=SOUND, label="twin, median")
        levels.semilogx(check.band, measured, color=FAULTY, label="measured, held out")
        levels.set(title=sensor, ylabel="third-octave level, dB re 1 m/s$^2$")
        gain = 20.0 * np.log10(np.maximum(fitted.gain[index], 1e-12))
        heard = np.where(fitted.heard[index], gain, np.nan)
        gains.semilogx(fitted.gain_frequency, gain, color=GREY, label="filled in")
        gains.semilogx(fitted.gain_frequency, heard, color=SOUND, label="gears heard")
        title = f"{sensor}: fitted path"
        gains.set(title=title, ylabel="gain from the bearing, dB")
        for panel in row:
            panel.set_xlabel(FREQUENCY)
            panel.grid(alpha=0.3)
            panel.legend(fontsize="small")
    save(figure, path, dpi=110)
