"""Maps of how well a fault can be told, over speed, torque, channel and bandwidth, by two
observers.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Any

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
from diagnose.detectability.pairs import PairCell, Pairs
from gensig.errors import ConfigError, GensigError

FloatArray = NDArray[np.floating]

BANDWIDTHS_HZ = (1000.0, 2000.0, 5000.0, 10000.0, 20000.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """One speed and torque as the observers see it.

    ``energy`` (unit, channel, band) is the square of d' that each band brings, ``noise_power``
    (unit, channel) (m/s2)^2; the others (channel, band) tell of indicators, as
    `diagnose.detectability.observers.Seen` does.
    """

    energy: FloatArray
    noise_power: FloatArray
    d_prime: FloatArray
    standard_error: FloatArray
    auroc: FloatArray
    indicator: NDArray[np.integer]
    raises: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Maps:
    """Both observers' maps.

    ``known`` is d' of the matched filter by bandwidth and ``known_band`` that of each band alone,
    both the median over the machines; ``seen``, ``standard_error``, ``auroc``, ``indicator`` and
    ``raises`` are those of indicators. All are (speed, torque, channel, band); ``noise_rms``
    (speed, torque, channel) m/s2, ``n_failed`` pairs that have no signal.
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


def read_bandwidths(given: Sequence[float] | None, pairs: Pairs) -> tuple[float, ...]:
    """Upper frequencies in Hz, rising; by default those of `BANDWIDTHS_HZ` that the signals have,
    and their highest.

    Raises
    ------
    ConfigError    for frequencies outside what is recorded
    """
    if given is None:
        inside = [one for one in BANDWIDTHS_HZ if one < pairs.usable_frequency]
        return (*inside, pairs.usable_frequency)
    highest = 0.5 * pairs.sampling_rate
    if (
        not given
        or len(set(given)) < len(given)
        or not all(10.0 <= one <= highest for one in given)
    ):
        raise ConfigError(
            f"bandwidths in Hz: {', '.join(f'{one:g}' for one in given)}; give each once, from 10 to half the sampling "
            f"rate, {highest:g}"
        )
    return tuple(sorted(float(one) for one in given))


def make_maps(
    pairs: Pairs,
    bandwidths: Sequence[float],
    *,
    n_workers: int,
    on_done: Callable[[str], None],
) -> Maps:
    """Simulate every cell and let both observers look at it; the same bits for any number of
    workers.

    Raises
    ------
    GensigError    if a worker was killed
    """
    cells = _look_at_all(pairs, bandwidths, n_workers, on_done)
    shape = (len(pairs.speeds_rpm), len(pairs.torques_nm))

    def over_cells(values: Sequence[NDArray[Any]]) -> NDArray[Any]:
        return np.stack(values).reshape(*shape, *values[0].shape)

    energy = over_cells([cell.energy for cell in cells])
    return Maps(
        fault=pairs.config.section("fault").plain(),
        speeds_rpm=pairs.speeds_rpm,
        torques_nm=pairs.torques_nm,
        channels=pairs.channel_names,
        bandwidths=tuple(bandwidths),
        indicators=indicator_names(list(pairs.gears)),
        n_units=pairs.n_units,
        duration=pairs.duration,
        known=_median(np.sqrt(np.cumsum(energy, axis=-1)), axis=2),
        known_band=_median(np.sqrt(energy), axis=2),
        seen=over_cells([cell.d_prime for cell in cells]),
        standard_error=over_cells([cell.standard_error for cell in cells]),
        auroc=over_cells([cell.auroc for cell in cells]),
        indicator=over_cells([cell.indicator for cell in cells]),
        raises=over_cells([cell.raises for cell in cells]),
        noise_rms=np.sqrt(
            _median(over_cells([cell.noise_power for cell in cells]), axis=2)
        ),
        n_failed=int(np.isnan(energy[..., 0, 0]).sum()),
    )


def look_at(pairs: Pairs, place: int, bandwidths: Sequence[float]) -> Cell:
    """Simulate one cell and let both observers look at it."""
    cell = pairs.cell(place)
    sound, faulty = _indicator_tables(pairs, cell, bandwidths)
    shape = sound.shape[1:3]
    seen = [
        seen_by_indicators(sound[:, channel, band], faulty[:, channel, band])
        for channel, band in np.ndindex(shape)
    ]

    def of_seen(name: str) -> NDArray[Any]:
        return np.array([getattr(one, name) for one in seen]).reshape(shape)

    return Cell(
        energy=residual_energy(
            cell.residual, cell.noise_density, pairs.sampling_rate, bandwidths
        ),
        noise_power=cell.noise_power,
        d_prime=of_seen("d_prime"),
        standard_error=of_seen("standard_error"),
        auroc=of_seen("auroc"),
        indicator=of_seen("indicator"),
        raises=of_seen("raises"),
    )


def best_and_worst(values: FloatArray) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Places of the largest and of the smallest value, NaN apart.

    Raises
    ------
    GensigError    where there is no value at all
    """
    if np.isnan(values).all():
        raise GensigError(
            "no pair of records could be simulated or judged; longer records or fewer extremes may help"
        )
    largest, smallest = np.nanargmax(values), np.nanargmin(values)
    return tuple(map(int, np.unravel_index(largest, values.shape))), tuple(
        map(int, np.unravel_index(smallest, values.shape))
    )


def confirm_best(maps: Maps, others: Pairs) -> Seen:
    """The best test of the indicators on machines that had no part in choosing it.

    ``others`` of the same map.
    """
    speed, torque, channel, band = place = best_and_worst(maps.seen)[0]
    cell = others.cell(speed * len(maps.torques_nm) + torque)
    sound, faulty = (
        table[:, channel, band]
        for table in _indicator_tables(others, cell, maps.bandwidths)
    )
    return confirmed(
        sound,
        faulty,
        indicator=int(maps.indicator[place]),
        raises=bool(maps.raises[place]),
    )


def _indicator_tables(
    pairs: Pairs, cell: PairCell, bandwidths: Sequence[float]
) -> tuple[FloatArray, FloatArray]:
    """Indicators of the sound and of the faulty records, (unit, channel, band, indicator) each."""
    shape = (
        pairs.n_units,
        len(pairs.channel_names),
        len(bandwidths),
        len(indicator_names(list(pairs.gears))),
    )
    tables = np.full((2, *shape), np.nan)
    records = ((cell.sound, cell.sound_angle), (cell.faulty, cell.faulty_angle))
    for table, (signals, angles) in zip(tables, records, strict=True):
        for unit, (signal, angle) in enumerate(zip(signals, angles, strict=True)):
            if np.isfinite(signal).all():
                table[unit] = band_indicators(
                    signal, angle, pairs.sampling_rate, pairs.gears, bandwidths
                )
    return tables[0], tables[1]


def _median(values: FloatArray, axis: int) -> FloatArray:
    """Median without NaN; NaN where there is nothing else."""
    counts = np.isfinite(values).any(axis=axis)
    return np.where(
        counts,
        np.nanmedian(np.where(np.expand_dims(counts, axis), values, 0.0), axis=axis),
        np.nan,
    )


_work: dict[str, Any] = {}


def _look_at_all(
    pairs: Pairs,
    bandwidths: Sequence[float],
    n_workers: int,
    on_done: Callable[[str], None],
) -> list[Cell]:
    """Every cell, in order; with one thread a process."""
    places = range(pairs.n_cells)
    cells = []
    if n_workers == 1 or pairs.n_cells == 1:
        from threadpoolctl import threadpool_limits

        with threadpool_limits(1):
            for place in places:
                cells.append(look_at(pairs, place, bandwidths))
                on_done(_cell_text(pairs, place))
        return cells
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(
        min(n_workers, pairs.n_cells), context, _start_worker, (pairs, bandwidths)
    ) as executor:
        try:
            for place, cell in zip(
                places, executor.map(_look_in_worker, places), strict=True
            ):
                cells.append(cell)
                on_done(_cell_text(pairs, place))
        except BrokenProcessPool:
            raise GensigError(
                "a worker process was killed (out of memory?); try --workers 1"
            ) from None
        except BaseException:
            executor.shutdown(wait=False, cancel_futures=True)
            raise
    return cells


def _cell_text(pairs: Pairs, place: int) -> str:
    speed, torque = divmod(place, len(pairs.torques_nm))
    return f"{pairs.speeds_rpm[speed]:g} r/min, {pairs.torques_nm[torque]:g} N m"


def _start_worker(pairs: Pairs, bandwidths: Sequence[float]) -> None:
    from threadpoolctl import threadpool_limits

    threadpool_limits(1)
    _work.update(pairs=pairs, bandwidths=bandwidths)


def _look_in_worker(place: int) -> Cell:
    return look_at(_work["pairs"], place, _work["bandwidths"])
