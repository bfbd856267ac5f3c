"""Figures of loaded flanks: transmission error, load over the flank, load sharing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.commands.figures.machine_figures import COLOURS, GREY, SOUND, pyplot, save
from gensig.systems.flank_optimum import Optimum
from gensig.systems.sliced_pair import SlicedPair, TransmissionError

Array = NDArray[np.float64]


def plot_transmission_error(
    system: SlicedPair, result: TransmissionError, path: Path
) -> None:
    """Transmission error over two periods, its orders, load over the flank and load sharing."""
    figure, axes = pyplot.subplots(2, 2, figsize=(11, 7.6), layout="constrained")
    _error(axes[0, 0], system, result)
    _orders(axes[0, 1], result)
    _load_map(figure, axes[1, 0], system, result)
    _sharing(axes[1, 1], system, result)
    figure.suptitle(_title(system))
    save(figure, path)


def plot_front(
    system: SlicedPair,
    before: Optimum,
    chosen: Optimum,
    front: Sequence[Optimum],
    path: Path,
) -> None:
    """The front, and transmission error and load over the flank before and after."""
    figure, axes = pyplot.subplots(2, 2, figsize=(11, 7.6), layout="constrained")
    ripple = [one.ripple * 1e6 for one in front]
    axes[0, 0].plot(
        ripple,
        [one.line_load * 1e-3 for one in front],
        "o-",
        color=SOUND,
        label="front",
    )
    for one, marker, colour, name in (
        (before, "s", GREY, "before"),
        (chosen, "D", COLOURS[1], "chosen"),
    ):
        axes[0, 0].plot(
            one.ripple * 1e6, one.line_load * 1e-3, marker, color=colour, label=name
        )
    axes[0, 0].set(
        title="Worst of all cases",
        xlabel="transmission error, peak to peak, um",
        ylabel="largest line load, N/mm",
    )
    axes[0, 0].legend()
    for place, one, colour, name in (
        (0, before, GREY, "before"),
        (1, chosen, COLOURS[1], "chosen"),
    ):
        changed = replace(system, modification=one.modification)
        result = changed.transmission_error()
        phase = np.arange(2 * len(result.error)) / len(result.error)
        axes[0, 1].plot(
            phase,
            np.tile(result.error - result.error.mean(), 2) * 1e6,
            color=colour,
            label=name,
        )
        _load_map(figure, axes[1, place], changed, result)
        axes[1, place].set_title(f"Load over the flank, {name}")
    axes[0, 1].set(
        title="Transmission error less its mean", xlabel="mesh periods", ylabel="um"
    )
    axes[0, 1].legend()
    figure.suptitle(_title(system))
    save(figure, path)


def plot_sliced_stiffness(
    system: SlicedPair,
    result: TransmissionError,
    position: Array,
    single: Array,
    path: Path,
    *,
    sound: TransmissionError,
    faulty: Array | None = None,
) -> None:
    """Stiffness of one pair along its way, faulty too, and of the mesh over two periods or all
    that see a fault.

    ``sound`` is the mesh without the fault, drawn beside it.
    """
    figure, axes = pyplot.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
    axes[0].plot(
        position / system.pair.base_pitch, single / 1e9, color=SOUND, label="sound"
    )
    if faulty is not None:
        axes[0].plot(
            position / system.pair.base_pitch,
            faulty / 1e9,
            color=COLOURS[1],
            label="faulty",
        )
        axes[0].legend()
    axes[0].set(
        title="One pair, slices on the path",
        xlabel="position of the first slice, base pitches",
        ylabel="stiffness, 10$^9$ N/m",
    )
    stiffness = result.contact.stiffness
    if faulty is not None:
        without = np.resize(sound.contact.stiffness, stiffness.shape) / 1e9
        axes[1].plot(
            *_over_periods(system, result, without),
            color=GREY,
            linewidth=0.8,
            label="sound",
        )
    colour, label = (SOUND, "sound") if faulty is None else (COLOURS[1], "faulty")
    axes[1].plot(
        *_over_periods(system, result, stiffness / 1e9), color=colour, label=label
    )
    if faulty is not None:
        axes[1].legend()
    axes[1].set(title="Mesh", xlabel="mesh periods", ylabel="stiffness, 10$^9$ N/m")
    figure.suptitle(_title(system))
    save(figure, path)


def _title(system: SlicedPair) -> str:
    pair = system.pair
    return (
        f"{pair.pinion.n_teeth}/{pair.wheel.n_teeth} teeth, helix {abs(np.degrees(pair.pinion.helix_angle)):g} deg, "
        f"contact ratio {pair.transverse_contact_ratio:.3f} + {pair.overlap_ratio:.3f}, {system.torque:g} N m, "
        f"slices {system.slices.slice_coupling}"
    )


def _over_periods(
    system: SlicedPair, result: TransmissionError, values: Array
) -> tuple[Array, Array]:
    """Mesh periods of roll and values: one period twice, or all that see a fault."""
    if result.n_periods > 1:
        return result.contact.roll / system.pair.base_pitch, values
    return np.arange(2 * len(values)) / len(values), np.tile(values, 2)


def _error(axes: Any, system: SlicedPair, result: TransmissionError) -> None:
    axes.plot(*_over_periods(system, result, result.error * 1e6), color=SOUND)
    axes.set(
        title=f"Transmission error, {np.ptp(result.error) * 1e6:.3g} um from peak to peak",
        xlabel="mesh periods",
        ylabel="approach along the line of action, um",
    )
    axes.ticklabel_format(axis="y", useOffset=False)


def _orders(axes: Any, result: TransmissionError) -> None:
    order = np.arange(1, len(result.harmonics) + 1)
    axes.bar(order, result.harmonics * 1e6, color=SOUND)
    axes.set(
        title="Its mesh orders",
        xlabel="order of the mesh frequency",
        ylabel="amplitude, um",
    )


def _load_map(
    figure: Any, axes: Any, system: SlicedPair, result: TransmissionError
) -> None:
    """Largest load of every place of the flank over the period, as a pair passes it."""
    pitch, contact = system.pair.base_pitch, result.contact
    low, high = -0.15, system.pair.transverse_contact_ratio + 0.15
    edges = np.linspace(low, high, 121)
    grid = np.zeros((len(edges) - 1, len(result.slice_place)))
    row = np.searchsorted(edges, contact.position / pitch) - 1
    column = np.broadcast_to(np.arange(grid.shape[1]), row.shape)
    inside = (row >= 0) & (row < len(grid))
    if result.odd_pairs is not None:
        inside &= (
            (contact.pair_index >= result.odd_pairs[0])
            & (contact.pair_index <= result.odd_pairs[1])
        )[..., None]
    np.maximum.at(grid, (row[inside], column[inside]), contact.line_load[inside] * 1e-3)
    image = axes.pcolormesh(
        result.slice_edges * 1e3,
        edges,
        np.where(grid > 0.0, grid, np.nan),
        cmap="cividis",
        vmin=0.0,
    )
    for end in (0.0, system.pair.transverse_contact_ratio):
        axes.axhline(end, color=GREY, linestyle=":")
    whose = (
        "the flank (dotted: ends of the path of contact)"
        if result.odd_pairs is None
        else "the faulty flanks"
    )
    axes.set(
        title=f"Load over {whose}",
        xlabel="place across the face from the end that enters first, mm",
        ylabel="contact position, base pitches",
    )
    figure.colorbar(image, ax=axes, label="N/mm")


def _sharing(axes: Any, system: SlicedPair, result: TransmissionError) -> None:
    """Share of one pair from its first touch to its last, put together from the pairs of one
    period; or of all pairs while a fault is seen."""
    if result.odd_pairs is not None:
        _sharing_of_all(axes, system, result)
        return
    n_phases, n_pairs = result.load_share.shape
    place = (np.arange(n_phases) + 0.5) / n_phases + np.arange(n_pairs)[:, None]
    share = result.load_share.T
    axes.plot(place.ravel() - 1.0, share.ravel(), color=SOUND, label="one pair")
    for shift, colour in zip((-1, 1), COLOURS[1:], strict=False):
        axes.plot(
            place.ravel() - 1.0 + shift,
            share.ravel(),
            ":",
            color=colour,
            label=f"pair {shift:+d}",
        )
    axes.set(
        title="Load sharing", xlabel="roll since the first slice passed A, base pitches", ylabel="share of the load",
        xlim=(-0.5, n_pairs - 1.0),
    )  # fmt: skip
    axes.legend()


def _sharing_of_all(axes: Any, system: SlicedPair, result: TransmissionError) -> None:
    assert result.odd_pairs is not None
    roll, index = (
        result.contact.roll / system.pair.base_pitch,
        result.contact.pair_index,
    )
    first, last = result.odd_pairs
    for pair in range(index.min(), index.max() + 1):
        share = np.where(index == pair, result.load_share, 0.0).sum(axis=1)
        followed = (index == pair).any(axis=1) & (share > 0.0)
        is_odd = first <= pair <= last
        name = {first: "pair of faulty teeth", first - 1: "sound pairs"}.get(pair)
        share = np.where(followed, share, np.nan)
        axes.plot(
            roll,
            share,
            color=COLOURS[1] if is_odd else GREY,
            zorder=2 + is_odd,
            label=name,
        )
    axes.set(
        title="Load sharing", xlabel="mesh periods; the faulty tooth enters at 0", ylabel="share of the load",
        xlim=(roll[0], roll[-1]), ylim=(0.0, None),
    )  # fmt: skip
    axes.legend(loc="lower left")
