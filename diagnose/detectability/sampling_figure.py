"""Figure of a sampling: size of the fault over signal-to-noise ratio, a panel an observer."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm, Normalize

from diagnose.detectability.figure import (
    fault_text,
    new_figure,
    save,
    set_numbers,
    shades,
    write_cells,
)
from diagnose.detectability.sampling import (
    FOUND_KNOWN,
    FOUND_SEEN,
    FloatArray,
    Sampling,
    found_from,
)
from diagnose.detectability.summary import short
from gensig.text.parameters import size_words

EDGE = "#D55E00"  # of the least size that is found
LEAST_KNOWN = 0.1  # d' at the lower end of the scale of the filter


def sampling_figure(path: Path, sampling: Sampling) -> None:
    """Write the figure; its type is that of the name."""
    width = 2 * (1.1 * len(sampling.axes.snrs_db) + 2.6)
    figure = new_figure(width, 0.55 * len(sampling.axes.sizes) + 2.4)
    seen, known = sampling.values("on_others"), sampling.values("known")
    top = float(np.nanmax([1.5 * FOUND_SEEN, *seen.flat]))
    largest = float(np.nanmax([10.0 * FOUND_KNOWN, *known.flat]))
    panels: Any = figure.subplots(1, 2)
    _panel(
        panels[0],
        sampling,
        seen,
        norm=Normalize(0.0, top),
        least=FOUND_SEEN,
        title="seen by indicators, on other machines",
    )
    _panel(
        panels[1],
        sampling,
        known,
        norm=LogNorm(LEAST_KNOWN, largest),
        least=FOUND_KNOWN,
        title="physically there",
    )
    records = f"{sampling.n_units} machines, records of {sampling.duration:g} s"
    fixed = {**sampling.fault}
    fixed.pop(sampling.axes.size_key)
    place = f"{sampling.speed_rpm:g} r/min, {sampling.torque_nm:g} N m"
    figure.suptitle(
        f"Which size is found at which noise? {fault_text(fixed)}; {place}; {records}",
        fontsize=11,
    )
    save(figure, path)


def _panel(
    axes: Any,
    sampling: Sampling,
    values: FloatArray,
    *,
    norm: Normalize,
    least: float,
    title: str,
) -> None:
    """One observer: d' in the cells, a line below the least size that is found at each ratio."""

    def text(cell: tuple[int, ...]) -> str:
        value = float(values[cell])
        return short(value) if value >= 10.0 else f"{value + 0.0:.2f}"

    shown = np.maximum(values, norm.vmin or 0.0)
    shades(axes, shown, norm)
    write_cells(axes, shown, norm, text)
    for column, row in enumerate(found_from(values, least)):
        if row is not None:
            ends = [column - 0.5, column + 0.5]
            axes.plot(ends, [row - 0.5] * 2, color=EDGE, linewidth=4, clip_on=False)
    set_numbers(axes, sampling.axes.snrs_db, sampling.axes.sizes)
    axes.set_xlabel("signal-to-noise ratio, dB")
    axes.set_ylabel(", ".join(size_words(sampling.axes.size_key)))
    axes.set_title(f"{title}\nd'; above the bar {least:g} or more", fontsize=10)
