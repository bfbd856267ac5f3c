"""Detectability over the size of a fault and the signal-to-noise ratio, at one speed and torque."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnose.detectability.maps import best_and_worst, confirm_best, make_maps
from diagnose.workers import call_all
from gensig.errors import ConfigError

if TYPE_CHECKING:
    from gensig import FaultPairs

FloatArray = NDArray[np.floating]
MakePairs = Callable[[float, float, int], "FaultPairs"]

SIZE_SHARES = (0.25, 0.5, 1.0, 1.5, 2.0)  # of the configured size
SNRS_DB = (0.0, 10.0, 20.0, 30.0)
MOST_SAMPLES = 100
# d' from which a fault counts as found: 0.92 of pairs are ranked right at 2, 0.98 at 3. A filter
# that knows the fault has to be surer, as no analyst knows it.
FOUND_SEEN, FOUND_KNOWN = 2.0, 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Axes:
    """Sizes of a fault, in the unit of their key, and signal-to-noise ratios; both rise."""

    size_key: str
    sizes: tuple[float, ...]
    snrs_db: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """Both observers at one size and ratio.

    Attributes
    ----------
    known : d' of the matched filter in its best channel and bandwidth, median over the machines
    seen : d' of the indicators in their best channel and bandwidth
    on_others, standard_error, auroc : of that test on machines that had no part in choosing it
    test : channel, bandwidth in Hz and indicator of that test
    n_failed : pairs of records that have no signal
    """

    known: float
    seen: float
    on_others: float
    standard_error: float
    auroc: float
    test: tuple[str, float, str]
    n_failed: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sampling:
    """Samples of all sizes and ratios.

    Attributes
    ----------
    fault : configured, of which the key of the axes is sampled
    samples : one row a size, one sample a ratio
    """

    fault: dict[str, Any]
    axes: Axes
    speed_rpm: float
    torque_nm: float
    n_units: int
    duration: float
    samples: tuple[tuple[Sample, ...], ...]

    def values(self, name: str) -> FloatArray:
        """An attribute of the samples, (size, ratio)."""
        return np.array(
            [[getattr(sample, name) for sample in row] for row in self.samples]
        )


def read_axis(
    what: str, given: Sequence[float] | None, usual: Sequence[float]
) -> tuple[float, ...]:
    """Values of one axis, rising; the usual ones where none are given.

    Raises
    ------
    ConfigError    for no value, a value twice, and one that is not finite
    """
    values = tuple(map(float, usual if given is None else given))
    if not values or len(set(values)) < len(values) or not np.isfinite(values).all():
        text = ", ".join(f"{value:g}" for value in values)
        raise ConfigError(f"{what}: {text}; give numbers, each once")
    return tuple(sorted(values))


def read_axes(
    base: FaultPairs, sizes: Sequence[float] | None, snrs_db: Sequence[float] | None
) -> Axes:
    """Sizes and ratios to sample, by default about the configured fault.

    Raises
    ------
    ConfigError    for a fault without a size, and for values that cannot be used
    """
    fault, key = base.config.section("fault"), base.size_key
    if key is None:
        raise ConfigError(
            f"--sizes: fault={fault['kind']} has no single size to sample; choose another fault, "
            "for instance fault=crack"
        )
    usual = [share * fault[key] for share in SIZE_SHARES]
    chosen = read_axis("--sizes", sizes, usual)
    ratios = read_axis("--snrs in dB", snrs_db, SNRS_DB)
    if len(chosen) * len(ratios) > MOST_SAMPLES:
        raise ConfigError(
            f"{len(chosen)} sizes x {len(ratios)} ratios are more than {MOST_SAMPLES} samples; "
            "give fewer"
        )
    return Axes(size_key=key, sizes=chosen, snrs_db=ratios)


def make_sampling(
    axes: Axes,
    make_pairs: MakePairs,
    bandwidths: Sequence[float],
    *,
    n_workers: int,
    on_done: Callable[[str], None],
) -> Sampling:
    """Samples of all sizes and ratios; the same bits for any number of workers.

    Parameters
    ----------
    make_pairs : pairs at the set-point of a size, a ratio in dB and an epoch, which draws machines
    bandwidths : as of `diagnose.detectability.maps.read_bandwidths`
    """
    pairs = [
        (make_pairs(size, ratio, 0), make_pairs(size, ratio, 1))
        for size in axes.sizes
        for ratio in axes.snrs_db
    ]
    n_ratios = len(axes.snrs_db)

    def told(index: int, _: Sample) -> None:
        size, ratio = divmod(index, n_ratios)
        on_done(f"{axes.size_key} {axes.sizes[size]:g}, {axes.snrs_db[ratio]:g} dB")

    flat: list[Sample] = call_all(
        sample_at,
        (pairs, tuple(bandwidths)),
        range(len(pairs)),
        n_workers=n_workers,
        on_done=told,
        remedy="try --workers 1",
    )
    first = pairs[0][0]
    return Sampling(
        fault=first.config.section("fault").plain(),
        axes=axes,
        speed_rpm=first.speeds_rpm[0],
        torque_nm=first.torques_nm[0],
        n_units=first.n_units,
        duration=first.duration,
        samples=tuple(
            tuple(flat[start : start + n_ratios])
            for start in range(0, len(flat), n_ratios)
        ),
    )


def sample_at(
    pairs: Sequence[tuple[FaultPairs, FaultPairs]],
    bandwidths: Sequence[float],
    index: int,
) -> Sample:
    """Simulate one size and ratio, and let both observers look at it."""
    chosen, others = pairs[index]
    maps = make_maps(chosen, bandwidths, n_workers=1, on_done=lambda _: None)
    best = best_and_worst(maps.seen)[0]
    confirmation = confirm_best(maps, others)
    indicator = maps.indicators[int(maps.indicator[best])]
    return Sample(
        known=float(np.nanmax(maps.known)),
        seen=float(maps.seen[best]),
        on_others=confirmation.d_prime,
        standard_error=confirmation.standard_error,
        auroc=confirmation.auroc,
        test=(maps.channels[best[2]], maps.bandwidths[best[3]], indicator),
        n_failed=maps.n_failed,
    )


def found_from(values: FloatArray, least: float) -> list[int | None]:
    """Number of the smallest size from which on every size reaches a value, a ratio each.

    Parameters
    ----------
    values : (size, ratio) d', sizes rising; NaN is not found
    least : d' that counts as found

    Returns
    -------
    One number a ratio, None where the largest size is not found
    """
    results: list[int | None] = []
    for column in np.nan_to_num(values, nan=-np.inf).T:
        missed = np.flatnonzero(column < least)
        first = int(missed[-1]) + 1 if missed.size else 0
        results.append(first if first < len(column) else None)
    return results
