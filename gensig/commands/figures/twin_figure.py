"""The figure of a twin.

Its levels beside those that were held out, and the path that was fitted.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gensig.commands.figures.machine_figures import FAULTY, GREY, SOUND, pyplot
from gensig.twin.check import Check
from gensig.twin.fitting import Fit


def plot_twin(fitted: Fit, check: Check, path: Path) -> None:
    """Third-octave levels with the range of the twin's records, and gain and noise over
    frequency, a row a sensor.
    """
    n_sensors = len(fitted.sensors)
    figure, axes = pyplot.subplots(
        n_sensors, 2, figsize=(11, 2.8 * n_sensors), squeeze=False, layout="constrained"
    )
    for place, (sensor, row) in enumerate(zip(fitted.sensors, axes, strict=True)):
        levels, path_axes = row
        low, high = (
            check.twin_db[:, place].min(axis=0),
            check.twin_db[:, place].max(axis=0),
        )
        levels.fill_between(
            check.band,
            low,
            high,
            color=SOUND,
            alpha=0.3,
            label="twin, least to greatest",
        )
        levels.semilogx(
            check.band,
            np.median(check.twin_db[:, place], axis=0),
            color=SOUND,
            label="twin, median",
        )
        levels.semilogx(
            check.band,
            check.measured_db[place],
            color=FAULTY,
            label="measured, held out",
        )
        levels.set(title=sensor, ylabel="third-octave level, dB re 1 m/s$^2$")
        gain = 20.0 * np.log10(np.maximum(fitted.gain[place], 1e-12))
        path_axes.semilogx(fitted.gain_frequency, gain, color=GREY, label="filled in")
        path_axes.semilogx(
            fitted.gain_frequency,
            np.where(fitted.heard[place], gain, np.nan),
            color=SOUND,
            label="gears heard",
        )
        path_axes.set(
            title=f"{sensor}: fitted path", ylabel="gain from the bearing, dB"
        )
        for one in row:
            one.set_xlabel("frequency, Hz")
            one.grid(alpha=0.3)
            one.legend(fontsize="small")
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
