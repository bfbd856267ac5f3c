"""The page of a data set: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from gensig.dataset.cards.card import plain
from gensig.dataset.cards.class_figures import FIRST_CHOICE
from gensig.dataset.reader import Dataset, open_dataset
from gensig.dataset.storage.atomic import write_bytes
from gensig.errors import ConfigError
from gensig.report import tables
from gensig.report.examples import Choice, choose, envelope_band, example, usable_top
from gensig.report.levels import VELOCITY, level_table, loudness, velocity_rms
from gensig.report.measured_ranges import at_measured_rate, compare_with_measurements
from gensig.report.packing import pack_floats
from gensig.report.realism import Comparison
from gensig.report.rotation_frequencies import Rotation, read_rotation
from gensig.report.values import (
    ALONG,
    INDICATORS,
    MOST_ROWS,
    Measured,
    column_label,
    drawn_columns,
    has_lives,
    life_table,
    measure,
    some_records,
    value_table,
)
from gensig.text.page import Charts, Section, Select, Switch, interactive_page

SCRIPT = "dataset_report.js"
REPORT = "report.html"
MOST_BYTES = 15_000_000
COMPARED = ("low", "high", "median", "p5", "p95", "verdict")
MARKS = (
    ("decibel", "logarithmic", True),
    ("mesh", "mesh harmonics", True),
    ("sidebands", "sidebands", False),
    ("shafts", "shaft orders", False),
    ("fault", "fault frequency", True),
)


def write_report(
    folder: Path, out: Path | None = None, *, per_class: int | None = None
) -> tuple[Path, str]:
    """Write the page of a complete data set; returns its path and a one-line summary.

    Parameters
    ----------
    out : file that does not exist yet; None is `REPORT` in the folder
    per_class : records shown of each class; None lets the page's size decide

    Raises
    ------
    ConfigError     for a file that exists, a folder that does not, or less than one record
    DatasetError    for a folder that is no data set, incomplete or damaged
    """
    path = out or folder / REPORT
    if path.exists() or path.is_symlink():
        raise ConfigError(
            f"{path} exists already; remove it, or choose another --out FILE"
        )
    if out is not None and not path.parent.is_dir():
        raise ConfigError(
            f"{path}: there is no folder {path.parent}; give an existing one"
        )
    if per_class is not None and per_class < 1:
        raise ConfigError(f"--records {per_class} must be at least 1")
    with open_dataset(folder) as data:
        text, summary = report_text(data, per_class)
    content = text.encode("utf-8")
    if len(content) > MOST_BYTES:
        raise ConfigError(
            f"the page would have {len(content) / 1e6:.1f} MB, at most 15 are meant; "
            "give fewer --records"
        )
    write_bytes(path, content)
    return path, f"{summary}, {len(content) / 1e6:.1f} MB"


def report_text(data: Dataset, per_class: int | None) -> tuple[str, str]:
    """The page, and a one-line summary."""
    chosen = choose(data, per_class)
    rotation = read_rotation(data)
    units = dict(zip(data.channel_names, tables.channel_units(data), strict=True))
    channel_units = [units[name] for name in chosen.channels]
    drawn = some_records(data, MOST_ROWS)
    measured = measure(data, rotation, chosen.channels, _further)
    compared = compare_with_measurements(data, measured, channel_units)
    content = _content(data, chosen, rotation, channel_units, drawn, measured, compared)
    name = plain(data.folder.resolve().name)
    n_shown = sum(len(records) for records in chosen.records.values())
    sections = [
        *tables.contents(data),
        _signals(data, chosen, rotation, content["examples"]),
        _parameters(data, content["drawn"]),
        _indicators(data, chosen, measured, content["measured"], channel_units),
    ]
    if "lives" in content:
        sections.append(_lives(content["lives"]))
    sections += [
        _comparisons(compared, channel_units),
        tables.splits(data),
        *tables.loading(data),
        *tables.provenance(data),
    ]
    version = plain(data.manifest.generator_version)
    page = interactive_page(
        title=f"Data set {name}",
        lead=[
            f"{data.n_records} records of {len(data.class_names)} classes, simulated and "
            f"labelled by gensig {version}. This page stands alone: it fetches nothing."
        ],
        sections=sections,
        script=SCRIPT,
        data=content,
    )
    return page, f"{n_shown} records shown, {len(measured.records)} measured"


def _content(
    data: Dataset,
    chosen: Choice,
    rotation: Rotation,
    units: Sequence[str],
    drawn: np.ndarray,
    measured: Measured,
    compared: Sequence[Comparison],
) -> dict[str, Any]:
    """Data that the script of the page draws."""
    along = [name for name in ALONG if name in data.column_names]
    table = value_table(data, measured.records, along)
    for name, values in measured.values.items():
        table["columns"][name] = pack_floats(values)
    channels = zip(chosen.channels, units, strict=True)
    indices = chain.from_iterable(chosen.records.values())
    content = {
        "classes": [plain(name) for name in data.class_names],
        "channels": [
            {"name": plain(name), "unit": plain(unit)} for name, unit in channels
        ],
        "top": usable_top(data),
        "examples": [
            example(data, index, chosen.channels, rotation) for index in indices
        ],
        "drawn": value_table(data, drawn, drawn_columns(data, drawn)),
        "measured": table,
        "beside": [_comparison(comparison) for comparison in compared],
    }
    if has_lives(data):
        content["lives"] = life_table(data)
    return content


def _comparison(comparison: Comparison) -> dict[str, Any]:
    values = {key: getattr(comparison, key) for key in COMPARED}
    return {"name": f"{comparison.id}, {comparison.at}", **values}


def _choice(
    name: str, label: str, options: Sequence[tuple[str, str]], chosen: str = ""
) -> Select:
    """A drop-down of one group of (value, text)."""
    return Select(name=name, label=label, groups=[("", options)], chosen=chosen)


def _channel_choice(chosen: Choice) -> Select:
    """The drop-down of channels; that of the data card's figures is shown first."""
    options = [(str(k), plain(name)) for k, name in enumerate(chosen.channels)]
    first = 0
    if FIRST_CHOICE in chosen.channels:
        first = chosen.channels.index(FIRST_CHOICE)
    return _choice("channel", "Channel", options, str(first))


def _records_by_class(
    examples: list[dict[str, Any]],
) -> dict[str, list[tuple[str, str]]]:
    """Number and label of each example, by class."""
    groups: dict[str, list[tuple[str, str]]] = {}
    for number, shown in enumerate(examples):
        severity = "unknown"
        if shown["severity"] is not None:
            severity = f"{shown['severity']:.2f}"
        record = f"severity {severity}, {shown['unit']}, {shown['record']}"
        text = plain(f"{shown['class']}, {record}")
        groups.setdefault(plain(shown["class"]), []).append((str(number), text))
    return groups


def _signals(
    data: Dataset, chosen: Choice, rotation: Rotation, examples: list[dict[str, Any]]
) -> Section:
    groups = _records_by_class(examples)
    of_last = groups[list(groups)[-1]]
    first = of_last[len(of_last) // 2][0]
    selection, sound = "of each class, from", ""
    if has_lives(data):
        first = of_last[-1][0]
        selection = "of each class, those of one life from"
    if "healthy" in groups:
        first = groups["healthy"][0][0]
        sound = "; sound ones at the conditions of the middle one of another class"
    orders = [("hz", "Hz and ms")] + [
        (name, f"orders: {words}") for name, words in rotation.references
    ]
    zooms = [("all", "usable band")]
    if any(name == "mesh" for name, _ in orders):
        zooms += [(f"{k}", f"around mesh harmonic {k}") for k in (1, 2, 3)]
    counts = f"{len(examples)} of {data.n_records} records"
    lines = [
        f"{counts}: {selection} the least to the greatest severity{sound}.",
        "Orders are multiples of the chosen shaft's mean speed. Amplitudes of spectra are "
        "rounded to 0.4 dB; waveform and spectrogram are those of the first samples, "
        "up to 8192.",
    ]
    others = [("", "nothing"), ("same", "its machine, least damaged")]
    if chosen.remark:
        lines.insert(1, f"Shown are {chosen.remark}.")
    return Section(
        title="Signals",
        text=lines,
        charts=Charts(
            name="signals",
            label="Choice of signal",
            selects=[
                Select(
                    name="record",
                    label="Record",
                    groups=list(groups.items()),
                    chosen=first,
                ),
                Select(
                    name="other",
                    label="Compare with",
                    chosen="same",
                    groups=[("", others), *groups.items()],
                ),
                _channel_choice(chosen),
                _choice("axis", "Axis", orders, "hz"),
                _choice("zoom", "Spectrum", zooms, "all"),
            ],
            switches=[
                Switch(name=name, label=label, on=on) for name, label, on in MARKS
            ],
            plots=_plots(data.sampling_rate),
        ),
    )


def _plots(sampling_rate: float) -> list[tuple[str, str]]:
    """Names and titles of the plots of a signal."""
    low, high = envelope_band(sampling_rate)
    band = f"{low / 1e3:.3g} to {high / 1e3:.3g} kHz"
    return [
        ("wave", "Waveform"),
        ("spectrum", "Amplitude spectrum"),
        ("envelope", f"Spectrum of the envelope of {band}"),
        ("spectrogram", "Spectrogram"),
    ]


def _parameters(data: Dataset, table: dict[str, Any]) -> Section:
    names = list(table["columns"])
    drawn = [(name, column_label(name)) for name in names if name.startswith("params/")]
    other = [
        (name, column_label(name)) for name in names if not name.startswith("params/")
    ]
    n_rows = table["rows"]
    text = [
        f"{_of(n_rows, data)}. A parameter is in the records to which it applies; "
        "those that never differ are left out."
    ]
    if not names:
        return Section(
            title="Parameters", text=["No parameter differs between the records."]
        )
    speeds = [name for name in names if "/operating.speed" in name]
    forms = [("histogram", "histogram"), ("boxes", "boxes and points by class")]
    return Section(
        title="Parameters",
        text=text,
        charts=Charts(
            name="parameters",
            label="Choice of parameter",
            selects=[
                Select(
                    name="column",
                    label="Parameter",
                    groups=[("drawn", drawn), ("of the record", other)],
                    chosen=[*speeds, ""][0],
                ),
                _choice("form", "Shown as", forms),
            ],
            plots=[("parameters", "Distribution by class")],
        ),
    )


def _further(signal: np.ndarray, sampling_rate: float) -> dict[str, np.ndarray]:
    """Values of each channel that are measured with the condition indicators."""
    return {
        **at_measured_rate(signal, sampling_rate),
        VELOCITY: velocity_rms(signal, sampling_rate),
    }


def _indicators(
    data: Dataset,
    chosen: Choice,
    measured: Measured,
    table: dict[str, Any],
    units: Sequence[str],
) -> Section:
    known = [
        (name, label)
        for name, label in INDICATORS
        if np.isfinite(measured.values[name]).any()
    ]
    along = [(name, column_label(name)) for name in ALONG if name in table["columns"]]
    text = [
        f"{_of(len(measured.records), data)}. Averages over turns are taken at the mean "
        "speed; where it varies, FM4 and sideband ratios say less."
    ]
    if not known:
        return Section(title="Condition indicators", text=["No record tells one."])
    levels = level_table(data, measured, chosen.channels, units)
    if levels is not None:
        text += [
            "Below: medians of each class, levels as machine monitoring states them.",
            *loudness(data, measured, chosen.channels, units),
        ]
    return Section(
        title="Condition indicators",
        text=text,
        table=levels,
        charts=Charts(
            name="indicators",
            label="Choice of indicator",
            selects=[
                _choice("indicator", "Indicator", known),
                _choice("along", "Over", along, "severity"),
                _channel_choice(chosen),
            ],
            switches=[Switch(name="decibel", label="logarithmic", on=False)],
            plots=[("indicators", "Indicator by class"), ("levels", "Spread by class")],
        ),
    )


def _lives(table: dict[str, Any]) -> Section:
    shown = len(table["names"])
    quantities = [("remaining_life_h", "remaining life, h"), ("severity", "severity")]
    return Section(
        title="Lives",
        text=[
            f"{shown} of {table['n_lives']} lives, a line each, "
            "from new to failure or to the horizon (crosses)."
        ],
        charts=Charts(
            name="lives",
            label="Choice of quantity",
            selects=[_choice("quantity", "Quantity", quantities)],
            switches=[
                Switch(name="relative", label="time as a share of the life", on=False)
            ],
            plots=[("lives", "Lives over time")],
        ),
    )


def _comparisons(compared: Sequence[Comparison], units: Sequence[str]) -> Section:
    section = tables.measured_table(compared, units)
    if not compared:
        return section
    charts = Charts(
        name="beside",
        label="Nothing to choose",
        plots=[("beside", "Measured ranges and this set")],
    )
    return replace(section, charts=charts)


def _of(n_rows: int, data: Dataset) -> str:
    n_usable = int(np.count_nonzero(data.usable))
    if n_rows == n_usable:
        return f"All {n_rows} records"
    return f"{n_rows} of {n_usable} records, evenly of all classes"
