"""Recordings of users: accelerations of some sensors at one rate. Their content is data; every mistake is one line."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError
from gensig.sensing.user_file import check_rate, read_table

Array = NDArray[np.float64]

STANDARD_GRAVITY = 9.80665  # m/s2
UNITS = {"m/s2": 1.0, "g": STANDARD_GRAVITY}
SUFFIXES = {"_m_per_s2": 1.0, "_g": STANDARD_GRAVITY}
WRONG_SUFFIXES = ("_rad_per_s2", "_rad", "_mm_per_s", "_um", "_mm", "_v", "_mv", "_rpm", "_nm", "_deg")
TYPES = (".csv", ".npy", ".npz")
LEAST_SAMPLES = 256
ARRAY_KEY = "acceleration"


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """What some sensors felt: names, (sensor, sample) m/s2 without the mean, and samples per second."""

    sensors: tuple[str, ...]
    acceleration: Array
    sampling_rate: float

    @property
    def duration(self) -> float:
        """Length, s."""
        return self.acceleration.shape[1] / self.sampling_rate

    def part(self, first: float, last: float) -> Recording:
        """From one share of its length to another."""
        n_samples = self.acceleration.shape[1]
        stretch = self.acceleration[:, round(first * n_samples) : round(last * n_samples)]
        return replace(self, acceleration=stretch - stretch.mean(axis=1, keepdims=True))


def read_recording(
    file: str, *, rate: float | None = None, unit: str = "m/s2", channels: Sequence[str] | None = None
) -> Recording:
    """Recording of a file.

    Parameters
    ----------
    file : a CSV file of one column a sensor, with or without ``time_s``; a .npy file or the array ``acceleration`` of
        a .npz file, (sample,) or (sensor, sample)
    rate : Hz    samples per second; needed where there is no ``time_s``
    unit : of columns whose name does not end in ``_m_per_s2`` or ``_g``
    channels : the columns, or numbers of the rows of an array, that are used; None takes all

    Raises
    ------
    ConfigError    with one line, for files, columns, units and rates that cannot be used
    """
    if unit not in UNITS:
        raise ConfigError(f"--unit {unit}: allowed: {', '.join(UNITS)}")
    if rate is not None and not 1000.0 <= rate <= 1e6:
        raise ConfigError(f"--rate {rate:g} must lie in 1000..1000000 samples a second")
    suffix = Path(file).suffix.lower()
    if suffix not in TYPES:
        raise ConfigError(f"{file}: the name must end in {', '.join(TYPES)}; write the recording as one of these")
    names, values, rate = _read_csv(file, rate) if suffix == ".csv" else _read_array(file, suffix, rate)
    if missing := [name for name in channels or () if name not in names]:
        raise ConfigError(f"{file}: no channel {missing[0]}; it has {', '.join(names)}")
    if channels is not None and (not channels or len(set(channels)) < len(channels)):
        raise ConfigError("--channels: name at least one channel, each once")
    chosen = list(channels or names)
    rows = np.stack([values[names.index(name)] * _factor(file, name, unit) for name in chosen])
    if rows.shape[1] < LEAST_SAMPLES:
        raise ConfigError(f"{file} is too short: {rows.shape[1]} samples, at least {LEAST_SAMPLES} are needed")
    for name, row in zip(chosen, rows, strict=True):
        if not np.all(np.isfinite(row)):
            raise ConfigError(f"{file}: sample {int(np.argmin(np.isfinite(row)))} of {name} is no finite number")
        if not np.ptp(row) > 0.0:
            raise ConfigError(f"{file}: {name} holds one value throughout; leave it out with --channels")
    return Recording(
        sensors=_sensor_names(file, chosen),
        acceleration=rows - rows.mean(axis=1, keepdims=True),
        sampling_rate=rate,
    )


def _read_csv(file: str, rate: float | None) -> tuple[list[str], Array, float]:
    names, values = read_table("recording", file, least_rows=LEAST_SAMPLES)
    if "time_s" not in names:
        return names, values, _given(file, rate, "it has no column time_s")
    time = values[names.index("time_s")]
    found = (len(time) - 1) / float(time[-1] - time[0]) if time[-1] > time[0] else math.nan
    check_rate("recording", file, time, found)
    if rate is not None and not math.isclose(found, rate, rel_tol=1e-3):
        raise ConfigError(f"{file}: time_s has {found:g} samples a second, --rate says {rate:g}; leave --rate out")
    kept = [place for place, name in enumerate(names) if name != "time_s"]
    if not kept:
        raise ConfigError(f"{file}: there is no column beside time_s; give one a sensor")
    # times are often printed with few digits: a rate within their rounding of a whole number is that number
    whole = round(found)
    precise = float(whole) if math.isclose(found, whole, rel_tol=2e-6) else found
    return [names[place] for place in kept], values[kept], rate if rate is not None else precise


def _read_array(file: str, suffix: str, rate: float | None) -> tuple[list[str], Array, float]:
    try:
        content = np.load(Path(file).expanduser(), allow_pickle=False)
        if suffix == ".npz":
            with content:
                if ARRAY_KEY not in content.files:
                    has = ", ".join(content.files) or "nothing"
                    raise ConfigError(f"{file}: no array {ARRAY_KEY}; it has {has}")
                content = content[ARRAY_KEY]
    except OSError as error:
        raise ConfigError(f"{file} cannot be read: {error.strerror or 'it is no such file of numpy'}") from None
    except (ValueError, EOFError):
        raise ConfigError(f"{file} cannot be read: it is no plain array of numbers of numpy") from None
    if not isinstance(content, np.ndarray) or content.dtype.kind not in "fiu" or content.ndim not in (1, 2):
        raise ConfigError(f"{file}: give one array of real numbers, (sample,) or (sensor, sample)")
    rows = np.atleast_2d(content).astype(np.float64)
    if rows.shape[0] > rows.shape[1]:
        raise ConfigError(f"{file} has the shape {content.shape}; give (sensor, sample): transpose it")
    names = [f"channel_{place}" for place in range(len(rows))]
    return names, rows, _given(file, rate, "an array tells no rate")


def _given(file: str, rate: float | None, why: str) -> float:
    if rate is None:
        raise ConfigError(f"{file}: {why}; give the samples a second with --rate")
    return rate


def _factor(file: str, name: str, unit: str) -> float:
    """From a column's unit to m/s2."""
    lower = name.lower()
    if wrong := [suffix for suffix in WRONG_SUFFIXES if lower.endswith(suffix)]:
        raise ConfigError(
            f"{file}: {name} ends in {wrong[0]}, which is no acceleration; choose others with --channels, or rename it"
        )
    return next((factor for suffix, factor in SUFFIXES.items() if lower.endswith(suffix)), UNITS[unit])


def _sensor_names(file: str, names: Sequence[str]) -> tuple[str, ...]:
    """Names as ``sensing.sensors`` takes them: letters, digits and _, at most 32, without unit."""
    made = []
    for place, name in enumerate(names):
        bare = next((name[: -len(end)] for end in SUFFIXES if name.lower().endswith(end)), name)
        plain = re.sub(r"[^A-Za-z0-9_]+", "_", bare).strip("_")[:32] or f"channel_{place}"
        made.append(plain if plain[0].isalpha() and not plain.endswith("rotation") else f"s_{plain}"[:30] + "_a")
    if len(set(made)) < len(made):
        raise ConfigError(f"{file}: the names {', '.join(names)} differ in nothing but signs; rename the columns")
    return tuple(made)
