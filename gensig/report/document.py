"""The page of a data set: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gensig.dataset.cards.class_figures import first_channel
from gensig.dataset.cards.facts import channel_units
from gensig.dataset.cards.origin import origin_of
from gensig.dataset.reader import Dataset, open_dataset
from gensig.dataset.storage.atomic import write_bytes
from gensig.errors import ConfigError
from gensig.report import tables
from gensig.report.conditions import Choice, choose
from gensig.report.examples import usable_top
from gensig.report.levels import (
    VELOCITY,
    class_levels,
    level_table,
    loudness,
    velocity_rms,
)
from gensig.report.measured_ranges import at_measured_rate, compare_with_measurements
from gensig.report.packing import pack_floats
from gensig.report.realism import Comparison
from gensig.report.rotation_frequencies import Rotation, read_rotation
from gensig.report.severity_slider import find_sweeps, sweep_content
from gensig.report.signal_section import (
    channel_choice,
    choice,
    severity_section,
    signals_section,
)
from gensig.report.signal_views import opening_view, signal_views
from gensig.report.values import (
    ALONG,
    INDICATORS,
    MOST_MEASURED,
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
from gensig.text.escaping import plain
from gensig.text.page import (
    Charts,
    Section,
    Select,
    Switch,
    interactive_page,
    is_page_of,
)

SCRIPT = "dataset_report.js"
REPORT = "report.html"
MOST_BYTES = 15_000_000
COMPARED = ("low", "high", "median", "p5", "p95", "verdict")
PROGRAM = "gensig report"


def write_report(
    folder: Path,
    out: Path | None = None,
    *,
    per_class: int | None = None,
    on_begin: Callable[[int], None] = lambda _: None,
) -> tuple[Path, str]:
    """Write the page of a complete data set; returns its path and a one-line summary.

    An earlier page of `gensig report` is replaced whole, any other file is kept.

    Parameters
    ----------
    out : file to write; None is `REPORT` in the folder
    per_class : records shown of each class; None lets the page's size decide
    on_begin : called with the number of records that are measured, once all is in order

    Raises
    ------
    ConfigError     for a file that is no page of `gensig report`, a folder that does not exist,
                    or less than one record
    DatasetError    for a folder that is no data set, incomplete or damaged
    """
    path = out or folder / REPORT
    exists = path.exists() or path.is_symlink()
    if exists and not is_page_of(path, PROGRAM):
        raise ConfigError(
            f"{path} exists and does not say that {PROGRAM} wrote it; remove it, or choose "
            "another --out FILE"
        )
    if out is not None and not path.parent.is_dir():
        raise ConfigError(
            f"{path}: there is no folder {path.parent}; give an existing one"
        )
    if per_class is not None and per_class < 1:
        raise ConfigError(f"--records {per_class} must be at least 1")
    with open_dataset(folder) as data:
        text, summary = report_text(data, per_class, on_begin)
    content = text.encode("utf-8")
    if len(content) > MOST_BYTES:
        raise ConfigError(
            f"the page would have {len(content) / 1e6:.1f} MB, at most 15 are meant; "
            "give fewer --records"
        )
    write_bytes(path, content, instead="choose another --out FILE")
    return path, f"{summary}, {len(content) / 1e6:.1f} MB"


def report_text(
    data: Dataset,
    per_class: int | None,
    on_begin: Callable[[int], None] = lambda _: None,
) -> tuple[str, str]:
    """The page, and a one-line summary; see `write_report`."""
    chosen = choose(data, per_class)
    rotation = read_rotation(data)
    on_begin(min(data.n_records, MOST_MEASURED))
    of_channels = channel_units(data)
    units = [of_channels[name] for name in chosen.channels]
    drawn = some_records(data, MOST_ROWS)
    measured = measure(data, rotation, chosen.channels, _further)
    compared = compare_with_measurements(data, measured, units)
    content = _content(data, chosen, rotation, units, drawn, measured, compared)
    sections = [
        signals_section(
            data, chosen, rotation, content["examples"], content["opening"]
        ),
    ]
    if "severity" in content:
        channel = chosen.channels[first_channel(chosen.channels)]
        sections.append(severity_section(content["severity"], channel))
    if "lives" in content:
        sections.append(_lives(content["lives"]))
    sections += [
        _indicators(data, chosen, measured, content["measured"], units),
        _parameters(data, content["drawn"]),
        tables.comparisons(compared, units),
        *tables.contents(data),
        tables.splits(data),
        *tables.loading(data),
        *tables.provenance(data),
    ]
    version, origin = plain(data.manifest.generator_version), origin_of(data.manifest)
    n_classes = len(data.class_names)
    classes = "1 class"
    if n_classes > 1:
        classes = f"{n_classes} classes"
    page = interactive_page(
        title=f"Data set {plain(data.folder.resolve().name)}",
        lead=[
            f"{data.n_records} records of {classes}. {origin.made} by gensig "
            f"{version}. This page stands alone: it fetches nothing."
        ],
        sections=sections,
        script=SCRIPT,
        data=content,
        program=PROGRAM,
    )
    return page, f"{chosen.n_records} records shown, {len(measured.records)} measured"


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
    for name, _ in INDICATORS:
        table["columns"][name] = pack_floats(measured.values[name])
    channels = zip(chosen.channels, units, strict=True)
    examples = signal_views(data, chosen, rotation)
    first = first_channel(chosen.channels)
    content = {
        "classes": [plain(name) for name in data.class_names],
        "channels": [
            {"name": plain(name), "unit": plain(unit)} for name, unit in channels
        ],
        "top": usable_top(data),
        "examples": examples,
        "opening": opening_view(examples),
        "first_channel": first,
        "drawn": value_table(data, drawn, drawn_columns(data, drawn)),
        "measured": table,
        "beside": [_comparison(comparison) for comparison in compared],
    }
    sweeps = find_sweeps(data, rotation)
    if sweeps:
        name = chosen.channels[first]
        content["severity"] = [
            sweep_content(data, rotation, sweep, name) for sweep in sweeps
        ]
    if has_lives(data):
        content["lives"] = life_table(data)
    return content


def _comparison(comparison: Comparison) -> dict[str, Any]:
    values = {key: getattr(comparison, key) for key in COMPARED}
    return {"name": f"{comparison.id}, {comparison.at}", **values}


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
                choice("form", "Shown as", forms),
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
    levels = class_levels(data, measured, chosen.channels, units)
    return Section(
        title="Condition indicators",
        text=[*text, *loudness(levels)],
        table=level_table(levels),
        charts=Charts(
            name="indicators",
            label="Choice of indicator",
            selects=[
                choice("indicator", "Indicator", known),
                choice("along", "Over", along, "severity"),
                channel_choice(chosen),
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
            selects=[choice("quantity", "Quantity", quantities)],
            switches=[
                Switch(name="relative", label="time as a share of the life", on=False)
            ],
            plots=[("lives", "Lives over time")],
        ),
    )


def _of(n_rows: int, data: Dataset) -> str:
    n_usable = int(np.count_nonzero(data.usable))
    if n_rows == n_usable:
        return f"All {n_rows} records"
    return f"{n_rows} of {n_usable} records, evenly of all classes"
