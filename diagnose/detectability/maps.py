"""Maps of detectability over speed, torque, channel and bandwidth, by two observers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnose.detectability.observers import (
    Seen,
    band_indicators,
    confirmed,
    indicator_names,
    residual_energy,
    seen_by_indicators,
)
from diagnose.workers import call_all
from gensig.errors import ConfigError, GensigError

if TYPE_CHECKING:
    from gensig import FaultPairs, PairCell

FloatArray = NDArray[np.floating]

BANDWIDTHS_HZ = (1000.0, 2000.0, 5000.0, 10000.0, 20000.0)
OF_SEEN = ("d_prime", "standard_error", "auroc", "indicator", "raises")


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """One speed and torque as the observers see it.

    Attributes
    ----------
    energy : (unit, channel, band) square of d' of the known residual in each band
    noise_power : (unit, channel) (m/s2)^2
    seen : attribute of `diagnose.detectability.observers.Seen` -> (channel, band)
    """

    energy: FloatArray
    noise_power: FloatArray
    seen: dict[str, NDArray[Any]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Maps:
    """Maps of both observers, (speed, torque, channel, band) each.

    Attributes
    ----------
    known : d' of the matched filter by bandwidth, median over the machines
    known_band : the same of each band alone
    seen, standard_error, auroc, indicator, raises : of indicators
    noise_rms : (speed, torque, channel) m/s2
    n_failed : pairs of records that have no signal
    """

    fault: dict[str, Any]
    speeds_rpm: tuple[float, ...]
    torques_nm: tuple[float, ...]
    channels: tuple[str, ...]
    bandwidths: tuple[float, ...]
    indicators: tuple[str, ...]
    n_units: int
    duration: float
    known: FloatArray
    known_band: FloatArray
    seen: FloatArray
    standard_error: FloatArray
    auroc: FloatArray
    indicator: NDArray[np.integer]
    raises: NDArray[np.bool_]
    noise_rms: FloatArray
    n_failed: int


def read_bandwidths(
    given: Sequence[float] | None, pairs: FaultPairs
) -> tuple[float, ...]:
    """Upper frequencies in Hz, rising.

    By default those of `BANDWIDTHS_HZ` that the signals have, and their highest.

    Raises
    ------
    ConfigError    for frequencies outside what is recorded
    """
    if given is None:
        inside = [value for value in BANDWIDTHS_HZ if value < pairs.usable_frequency]
        return (*inside, pairs.usable_frequency)
    highest = 0.5 * pairs.sampling_rate
    in_range = all(10.0 <= value <= highest for value in given)
    if not given or len(set(given)) < len(given) or not in_range:
        raise ConfigError(
            f"bandwidths in Hz: {', '.join(f'{value:g}' for value in given)}; give each once, "
            f"from 10 to half the sampling rate, {highest:g}"
        )
    return tuple(sorted(map(float, given)))


def make_maps(
    pairs: FaultPairs,
    bandwidths: Sequence[float],
    *,
    n_workers: int,
    on_done: Callable[[str], None],
) -> Maps:
    """Maps of all cells; the same bits for any number of workers.

    Raises
    ------
    GensigError    if a worker was killed
    """
    cells: list[Cell] = call_all(
        look_at,
        (pairs, bandwidths),
        range(pairs.n_cells),
        n_workers=n_workers,
        on_done=lambda index, _: on_done(_cell_text(pairs, index)),
        remedy="try --workers 1",
    )
    shape = (len(pairs.speeds_rpm), len(pairs.torques_nm))

    def over_cells(values: Sequence[NDArray[Any]]) -> NDArray[Any]:
        return np.stack(values).reshape(*shape, *values[0].shape)

    energy = over_cells([cell.energy for cell in cells])
    power = over_cells([cell.noise_power for cell in cells])
    seen = {
        name: over_cells([cell.seen[name] for cell in cells]) for name in cells[0].seen
    }
    return Maps(
        fault=pairs.config.section("fault").plain(),
        speeds_rpm=pairs.speeds_rpm,
        torques_nm=pairs.torques_nm,
        channels=pairs.channel_names,
        bandwidths=tuple(bandwidths),
        indicators=indicator_names(list(pairs.gears)),
        n_units=pairs.n_units,
        duration=pairs.duration,
        known=_median_of_units(np.sqrt(np.cumsum(energy, axis=-1))),
        known_band=_median_of_units(np.sqrt(energy)),
        seen=seen.pop("d_prime"),
        noise_rms=np.sqrt(_median_of_units(power)),
        n_failed=int(np.isnan(energy[..., 0, 0]).sum()),
        **seen,
    )


def _cell_text(pairs: FaultPairs, index: int) -> str:
    speed, torque = divmod(index, len(pairs.torques_nm))
    return f"{pairs.speeds_rpm[speed]:g} r/min, {pairs.torques_nm[torque]:g} N m"


def look_at(pairs: FaultPairs, bandwidths: Sequence[float], index: int) -> Cell:
    """Simulate one cell and let both observers look at it."""
    cell = pairs.cell(index)
    sound, faulty = _indicator_tables(pairs, cell, bandwidths)
    shape = sound.shape[1:3]
    seen = [
        seen_by_indicators(sound[:, channel, band], faulty[:, channel, band])
        for channel, band in np.ndindex(shape)
    ]
    return Cell(
        energy=residual_energy(
            cell.residual, cell.noise_density, pairs.sampling_rate, bandwidths
        ),
        noise_power=cell.noise_power,
        seen={
            name: np.array([getattr(each, name) for each in seen]).reshape(shape)
            for name in OF_SEEN
        },
    )


def best_and_worst(values: FloatArray) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Indices of the largest and of the smallest value; NaN is ignored.

    Raises
    ------
    GensigError    where there is no value at all
    """
    if np.isnan(values).all():
        raise GensigError(
            "no pair of records could be simulated or judged; "
            "longer records or fewer extremes may help"
        )
    largest, smallest = (
        tuple(map(int, np.unravel_index(flat, values.shape)))
        for flat in (np.nanargmax(values), np.nanargmin(values))
    )
    return largest, smallest


def confirm_best(maps: Maps, others: FaultPairs) -> Seen:
    """The best test of the indicators on machines that had no part in choosing it.

    Parameters
    ----------
    others : such machines over the same map
    """
    best = best_and_worst(maps.seen)[0]
    speed, torque, channel, band = best
    cell = others.cell(speed * len(maps.torques_nm) + torque)
    sound, faulty = _indicator_tables(others, cell, maps.bandwidths)
    return confirmed(
        sound[:, channel, band],
        faulty[:, channel, band],
        indicator=int(maps.indicator[best]),
        raises=bool(maps.raises[best]),
    )


def _indicator_tables(
    pairs: FaultPairs, cell: PairCell, bandwidths: Sequence[float]
) -> tuple[FloatArray, FloatArray]:
    """Indicators of healthy and of faulty records, (unit, channel, band, indicator) each."""
    n_indicators = len(indicator_names(list(pairs.gears)))
    shape = (pairs.n_units, len(pairs.channel_names), len(bandwidths), n_indicators)
    sound, faulty = np.full(shape, np.nan), np.full(shape, np.nan)
    for table, signals, angles in (
        (sound, cell.sound, cell.sound_angle),
        (faulty, cell.faulty, cell.faulty_angle),
    ):
        for row, signal, angle in zip(table, signals, angles, strict=True):
            if np.isfinite(signal).all():
                row[:] = band_indicators(
                    signal, angle, pairs.sampling_rate, pairs.gears, bandwidths
                )
    return sound, faulty


def _median_of_units(values: FloatArray) -> FloatArray:
    """Median over the units (third axis) without NaN; NaN where there is nothing else."""
    known = np.isfinite(values).any(axis=2)
    median = np.nanmedian(np.where(np.expand_dims(known, 2), values, 0.0), axis=2)
    return np.where(known, median, np.nan)
