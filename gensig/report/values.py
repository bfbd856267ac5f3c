"""Numbers of many records for the page: drawn parameters, condition indicators, lives."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import FloatArray
from gensig.dataset.columns import COLUMNS
from gensig.dataset.reader import Dataset
from gensig.dataset.schema import PARAMS
from gensig.errors import DatasetError
from gensig.report.packing import pack_floats, packed
from gensig.report.rotation_frequencies import Rotation
from gensig.signals.averaging import time_synchronous_average
from gensig.signals.indicators import crest_factor, fm4, kurtosis, rms, sideband_ratio

MOST_ROWS = 2000  # of the distributions
MOST_MEASURED = 160  # records whose signals are read for the indicators
MOST_SAMPLES = 2**17  # of a channel of such a record: what is read stays small
INDICATORS = (
    ("rms", "RMS"),
    ("kurtosis", "kurtosis"),
    ("crest_factor", "crest factor"),
    ("fm4_pinion", "FM4, pinion"),
    ("fm4_wheel", "FM4, wheel"),
    ("sideband_ratio_pinion", "sideband ratio, pinion"),
    ("sideband_ratio_wheel", "sideband ratio, wheel"),
)
# Columns other than params/ that a draw or a result of it decides.
PLAIN = (
    "severity",
    "speed_rpm",
    "torque_nm",
    "snr_db",
    "start_phase",
    "start_tooth_pinion",
    "start_tooth_wheel",
    "mesh_frequency_hz",
    "contact_loss_fraction",
    "integration_error",
    "clipped_fraction",
    "dropped_fraction",
    "detectability",
    "life_time_h",
    "life_cycles",
    "remaining_life_h",
)
# abscissae of indicators
ALONG = (*PLAIN[:4], "life_time_h", "remaining_life_h")


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """Indicators of records, in the order of `records`.

    Parameters
    ----------
    records : (row,)                        numbers in the data set
    values : (row, channel) by name         `INDICATORS` and further ones; NaN where a record
                                            cannot tell it
    """

    records: NDArray[np.intp]
    values: dict[str, FloatArray]


def some_records(data: Dataset, most: int) -> NDArray[np.intp]:
    """Numbers of usable records in their order: all, or at most so many, evenly of all classes."""
    usable = np.flatnonzero(data.usable)
    if usable.size <= most:
        return usable
    by_class = usable[np.argsort(data.column("label")[usable], kind="stable")]
    return np.sort(by_class[np.linspace(0, by_class.size - 1, most).astype(int)])


def value_table(
    data: Dataset, records: NDArray[np.intp], names: list[str]
) -> dict[str, Any]:
    """Columns of some records for the page: class numbers, and floats by name."""
    label = data.column("label")[records]
    n_classes = min(len(data.class_names), 255)
    if not np.isin(label, np.arange(n_classes)).all():
        raise DatasetError(
            f"{data.folder} has labels beyond its class names; run gensig verify {data.folder}"
        )
    values = {name: data.column(name)[records].astype(float) for name in names}
    return {
        "rows": int(records.size),
        "class": packed(label, "u1"),
        "columns": {n: pack_floats(v) for n, v in values.items()},
    }


def drawn_columns(data: Dataset, records: NDArray[np.intp]) -> list[str]:
    """Names of the numbers that differ between records, drawn parameters first."""
    params = [name for name in data.column_names if name.startswith(f"{PARAMS}/")]
    result = []
    for name in [*params, *(name for name in PLAIN if name in data.column_names)]:
        values = data.column(name)
        if values.ndim == 1 and values.dtype.kind in "iuf":
            finite = values[records][np.isfinite(values[records])]
            if finite.size and np.ptp(finite) > 0.0:
                result.append(name)
    return result


def column_label(name: str) -> str:
    """A column in words with its unit, such as 'torque, N m'; a parameter by its key."""
    if name.startswith(f"{PARAMS}/"):
        return name.removeprefix(f"{PARAMS}/")
    words = name.split("_")
    if name not in COLUMNS or COLUMNS[name].unit in ("", "1"):
        return " ".join(words)
    # The last part of such a name is its unit.
    return f"{' '.join(words[:-1])}, {COLUMNS[name].unit}"


def measure(
    data: Dataset,
    rotation: Rotation,
    channels: list[str],
    further: Callable[[FloatArray, float], dict[str, FloatArray]],
) -> Measured:
    """Condition indicators of some records, read one at a time.

    Parameters
    ----------
    further : from a signal (channel, sample) and its rate to more numbers, (channel,) each
    """
    records = some_records(data, MOST_MEASURED)
    rows = list(_rows(data, rotation, channels, records, further))
    names = dict.fromkeys([*dict(INDICATORS), *chain.from_iterable(rows)])
    values = {name: np.array([row[name] for row in rows]) for name in names}
    return Measured(records=records, values=values)


def _rows(
    data: Dataset,
    rotation: Rotation,
    channels: list[str],
    records: NDArray[np.intp],
    further: Callable[[FloatArray, float], dict[str, FloatArray]],
) -> Iterator[dict[str, FloatArray]]:
    turns = {gear: rotation.turns(gear) for gear in rotation.n_teeth}
    for index in records.tolist():
        n_read = min(data.n_samples, MOST_SAMPLES)
        x = data.signals(index, stop=n_read, channels=channels).astype(float)
        x = x - x.mean(axis=-1, keepdims=True)
        row = {"rms": rms(x), "kurtosis": kurtosis(x), "crest_factor": crest_factor(x)}
        for gear in ("pinion", "wheel"):
            fourth = sidebands = np.full(x.shape[0], np.nan)
            if gear in turns and turns[gear][index] > 0.0:
                # A record without a whole turn keeps NaN.
                with suppress(ValueError):
                    rate = float(turns[gear][index])
                    n_teeth = int(rotation.n_teeth[gear][index])
                    average = time_synchronous_average(x, data.sampling_rate, rate)
                    fourth, sidebands = (
                        fm4(average, n_teeth),
                        sideband_ratio(average, n_teeth),
                    )
            row |= {f"fm4_{gear}": fourth, f"sideband_ratio_{gear}": sidebands}
        yield {**row, **further(x, data.sampling_rate)}


def has_lives(data: Dataset) -> bool:
    """True when the records are snapshots of lives."""
    return {"life_id", "life_time_h", "remaining_life_h"} <= set(data.column_names)


def life_table(data: Dataset) -> dict[str, Any]:
    """Snapshots of whole lives in the order of time, each with its life's number.

    There are as many lives as `MOST_ROWS` records make.
    """
    names = data.column("life_id")
    _, first = np.unique(names, return_index=True)
    lives = names[np.sort(first)].tolist()
    n_each = data.n_records / max(len(lives), 1)
    shown = lives[: max(int(MOST_ROWS / max(n_each, 1.0)), 1)]
    number = {name: index for index, name in enumerate(shown)}
    usable = np.flatnonzero(data.usable & np.isin(names, shown))
    order = np.array([number[name] for name in names[usable].tolist()], dtype=float)
    usable = usable[np.lexsort((data.column("life_time_h")[usable], order))]
    result = value_table(
        data, usable, ["life_time_h", "remaining_life_h", "severity", "life_failed"]
    )
    result["columns"]["life"] = pack_floats(
        [number[name] for name in names[usable].tolist()]
    )
    return {**result, "names": [str(name) for name in shown], "n_lives": len(lives)}
