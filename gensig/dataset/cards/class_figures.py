"""Figures of a card: one record of each class over two turns, and its spectrum."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gensig.arrays import FloatArray
from gensig.dataset.cards.facts import channel_units
from gensig.dataset.folder.layout import FIGURES
from gensig.dataset.reader import Dataset
from gensig.dataset.storage.atomic import cannot_write, write_bytes
from gensig.signals.spectrum import amplitude_spectrum

BLUE, ORANGE = "#0072B2", "#D55E00"
# Along the line of centers, next to the faulted gear of most sets.
FIRST_CHOICE = "pinion_y"
TURNS = 2.0
DECADES = 4.0  # of the spectrum's amplitude axis
N_BINS = 500  # the largest amplitude of each is drawn


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassExample:
    """A record that stands for its class.

    Parameters
    ----------
    title : str                 class, severity, record, speed, torque
    time : (sample,)            ms
    signal : (sample,)          m/s^2 or rad/s^2, as the channel
    frequency : (bin,)          kHz, upper end of each bin
    amplitude : (bin,)          largest amplitude in the bin, unit of the signal
    mesh_frequency : float      kHz
    """

    title: str
    time: FloatArray
    signal: FloatArray
    frequency: FloatArray
    amplitude: FloatArray
    mesh_frequency: float


def write_class_figures(data: Dataset) -> dict[str, str]:
    """Write a PNG for each class that has a usable record.

    Returns paths in the folder by class name, {} without matplotlib. The same records, with the
    same version of matplotlib, give the same bytes.
    """
    try:
        import matplotlib
    except ImportError:
        return {}
    channel = data.channel_names[first_channel(data.channel_names)]
    unit = channel_units(data)[channel].replace("^2", "²")
    records = example_records(data)
    examples = {name: _example(data, records[name], channel) for name in records}
    if not examples:
        return {}
    folder = data.folder / FIGURES
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise cannot_write(folder, error) from error
    largest = max(float(np.abs(example.signal).max()) for example in examples.values())
    highest = max(float(example.amplitude.max()) for example in examples.values())
    paths = {}
    with matplotlib.rc_context():
        matplotlib.rcdefaults()  # nobody's own style decides bytes
        for name, example in examples.items():
            slug = re.sub(r"[^a-z0-9_]+", "-", name.lower())[:40]
            paths[name] = f"{FIGURES}/{data.class_names.index(name)}-{slug}.png"
            picture = _png(
                example, f"{channel}, {unit}", largest or 1.0, highest or 1.0
            )
            write_bytes(data.folder / paths[name], picture)
    return paths


def first_channel(channels: Sequence[str]) -> int:
    """Number of the channel shown first."""
    if FIRST_CHOICE in channels:
        return list(channels).index(FIRST_CHOICE)
    return 0


def example_records(data: Dataset) -> dict[str, int]:
    """Number of one record a class, by class name: the usable one of median severity."""
    label, severity = data.column("label_name"), data.column("severity")
    chosen = {}
    for name in data.class_names:
        mine = (label == name) & data.usable & ~data.is_reference
        records = np.flatnonzero(mine)
        if records.size:
            order = np.argsort(severity[records], kind="stable")
            chosen[name] = int(records[order[records.size // 2]])
    return chosen


def _example(data: Dataset, index: int, channel: str) -> ClassExample:
    values = data[index].values
    speed = values["speed_rpm"]
    signal = data.signals(index, channels=[channel])[0].astype(float)
    frequency, amplitude = amplitude_spectrum(signal, data.sampling_rate)
    step = -(-len(amplitude) // N_BINS)
    starts = np.arange(0, len(amplitude), step)
    if speed > 0.0:
        shown = int(TURNS * 60.0 / speed * data.sampling_rate)
        signal = signal[: max(shown, 2)]
    return ClassExample(
        title=f"{values['label_name']}, severity {values['severity']:.2f} (record "
        f"{values['record_id']}, {speed:.0f} r/min, {values['torque_nm']:.3g} N m)",
        time=np.arange(len(signal)) / data.sampling_rate * 1e3,
        signal=signal,
        frequency=frequency[np.minimum(starts + step, len(frequency)) - 1] / 1e3,
        amplitude=np.maximum.reduceat(amplitude, starts),
        mesh_frequency=float(values.get("mesh_frequency_hz", np.nan)) / 1e3,
    )


def _png(example: ClassExample, ordinate: str, largest: float, highest: float) -> bytes:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.6, 2.7), dpi=80)
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    figure.subplots_adjust(left=0.105, right=0.985, top=0.87, bottom=0.185, wspace=0.23)
    figure.text(0.105, 0.93, example.title, parse_math=False)
    _waveform(left, example, ordinate, 1.05 * largest)
    _spectrum(right, example, ordinate, 2.0 * highest)
    content = io.BytesIO()
    figure.savefig(content, format="png", metadata={"Software": None})
    return content.getvalue()


def _waveform(axes: Any, example: ClassExample, ordinate: str, limit: float) -> None:
    axes.plot(example.time, example.signal, color=BLUE, linewidth=0.6)
    axes.set(xlim=(0.0, example.time[-1]), ylim=(-limit, limit), xlabel="time, ms")
    axes.set_ylabel(ordinate, parse_math=False)


def _spectrum(axes: Any, example: ClassExample, ordinate: str, limit: float) -> None:
    lowest = limit * 10.0**-DECADES
    amplitude = np.maximum(example.amplitude, lowest)
    axes.semilogy(example.frequency, amplitude, color=BLUE, linewidth=0.7)
    top = float(example.frequency[-1])
    if np.isfinite(example.mesh_frequency) and example.mesh_frequency > 0.0:
        n_harmonics = min(60, int(top / example.mesh_frequency))
        harmonics = np.arange(1, n_harmonics + 1) * example.mesh_frequency
        height = np.full(n_harmonics, limit / 1.5)
        axes.plot(harmonics, height, "v", color=ORANGE, markersize=2.5)
    axes.set(
        xlim=(0.0, top),
        ylim=(lowest, limit),
        xlabel="frequency, kHz; triangles: harmonics of the mesh",
    )
    axes.set_ylabel(f"amplitude of {ordinate.partition(',')[0]}", parse_math=False)
    axes.yaxis.set_major_formatter("{x:g}")
    axes.minorticks_off()
