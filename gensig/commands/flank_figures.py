"""Figures of loaded flanks: transmission error, load over the flank, load sharing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.commands.figures import COLOURS, GREY, SOUND, pyplot, save
from gensig.systems.flank_optimum import Optimum
from gensig.systems.sliced_pair import SlicedPair, TransmissionError

Array = NDArray[np.float64]


def plot_transmission_error(system: SlicedPair, result: TransmissionError, path: Path) -> None:
    """Transmission error over two periods, its orders, load over the flank and load sharing."""
    figure, axes = pyplot.subplots(2, 2, figsize=(11, 7.6), layout="constrained")
    _error(axes[0, 0], result)
    _orders(axes[0, 1], result)
    _load_map(figure, axes[1, 0], system, result)
    _sharing(axes[1, 1], result)
    figure.suptitle(_title(system))
    save(figure, path)


def plot_front(system: SlicedPair, before: Optimum, chosen: Optimum, front: Sequence[Optimum], path: Path) -> None:
    """The front, and transmission error and load over the flank before and after."""
    figure, axes = pyplot.subplots(2, 2, figsize=(11, 7.6), layout="constrained")
    ripple = [one.ripple * 1e6 for one in front]
    axes[0, 0].plot(ripple, [one.line_load * 1e-3 for one in front], "o-", color=SOUND, label="front")
    for one, marker, colour, name in ((before, "s", GREY, "before"), (chosen, "D", COLOURS[1], "chosen")):
        axes[0, 0].plot(one.ripple * 1e6, one.line_load * 1e-3, marker, color=colour, label=name)
    axes[0, 0].set(
        title="Worst of all cases", xlabel="transmission error, peak to peak, um", ylabel="largest line load, N/mm"
    )
    axes[0, 0].legend()
    for place, one, colour, name in ((0, before, GREY, "before"), (1, chosen, COLOURS[1], "chosen")):
        changed = replace(system, modification=one.modification)
        result = changed.transmission_error()
        phase = np.arange(2 * len(result.error)) / len(result.error)
        axes[0, 1].plot(phase, np.tile(result.error - result.error.mean(), 2) * 1e6, color=colour, label=name)
        _load_map(figure, axes[1, place], changed, result)
        axes[1, place].set_title(f"Load over the flank, {name}")
    axes[0, 1].set(title="Transmission error less its mean", xlabel="mesh periods", ylabel="um")
    axes[0, 1].legend()
    figure.suptitle(_title(system))
    save(figure, path)


def plot_sliced_stiffness(
    system: SlicedPair, result: TransmissionError, position: Array, single: Array, path: Path
) -> None:
    """Stiffness of one pair along its way and of the mesh over two periods."""
    figure, axes = pyplot.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
    axes[0].plot(position / system.pair.base_pitch, single / 1e9, color=SOUND)
    axes[0].set(
        title="One pair, slices on the path",
        xlabel="position of the first slice, base pitches",
        ylabel="stiffness, 10$^9$ N/m",
    )
    phase = np.arange(2 * len(result.error)) / len(result.error)
    axes[1].plot(phase, np.tile(result.contact.stiffness, 2) / 1e9, color=SOUND)
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


def _error(axes: Any, result: TransmissionError) -> None:
    phase = np.arange(2 * len(result.error)) / len(result.error)
    axes.plot(phase, np.tile(result.error, 2) * 1e6, color=SOUND)
    axes.set(
        title=f"Transmission error, {np.ptp(result.error) * 1e6:.3g} um from peak to peak",
        xlabel="mesh periods",
        ylabel="approach along the line of action, um",
    )
    axes.ticklabel_format(axis="y", useOffset=False)


def _orders(axes: Any, result: TransmissionError) -> None:
    order = np.arange(1, len(result.harmonics) + 1)
    axes.bar(order, result.harmonics * 1e6, color=SOUND)
    axes.set(title="Its mesh orders", xlabel="order of the mesh frequency", ylabel="amplitude, um")


def _load_map(figure: Any, axes: Any, system: SlicedPair, result: TransmissionError) -> None:
    """Largest load of every place of the flank over the period, as a pair passes it."""
    pitch, contact = system.pair.base_pitch, result.contact
    low, high = -0.15, system.pair.transverse_contact_ratio + 0.15
    edges = np.linspace(low, high, 121)
    grid = np.zeros((len(edges) - 1, len(result.slice_place)))
    row = np.searchsorted(edges, contact.position / pitch) - 1
    column = np.broadcast_to(np.arange(grid.shape[1]), row.shape)
    inside = (row >= 0) & (row < len(grid))
    np.maximum.at(grid, (row[inside], column[inside]), contact.line_load[inside] * 1e-3)
    half = 0.5e3 * (result.slice_place[1] - result.slice_place[0]) if len(result.slice_place) > 1 else 1.0
    across = np.append(result.slice_place * 1e3 - half, result.slice_place[-1] * 1e3 + half)
    image = axes.pcolormesh(across, edges, np.where(grid > 0.0, grid, np.nan), cmap="cividis", vmin=0.0)
    for end in (0.0, system.pair.transverse_contact_ratio):
        axes.axhline(end, color=GREY, linestyle=":")
    axes.set(
        title="Load over the flank (dotted: ends of the path of contact)",
        xlabel="place across the face from the end that enters first, mm",
        ylabel="contact position, base pitches",
    )
    figure.colorbar(image, ax=axes, label="N/mm")


def _sharing(axes: Any, result: TransmissionError) -> None:
    """Share of one pair from its first touch to its last, put together from the pairs of one period."""
    n_phases, n_pairs = result.load_share.shape
    place = (np.arange(n_phases) + 0.5) / n_phases + np.arange(n_pairs)[:, None]
    share = result.load_share.T
    axes.plot(place.ravel() - 1.0, share.ravel(), color=SOUND, label="one pair")
    for shift, colour in zip((-1, 1), COLOURS[1:], strict=False):
        axes.plot(place.ravel() - 1.0 + shift, share.ravel(), ":", color=colour, label=f"pair {shift:+d}")
    axes.set(
        title="Load sharing", xlabel="roll since the first slice passed A, base pitches", ylabel="share of the load",
        xlim=(-0.5, n_pairs - 1.0),
    )  # fmt: skip
    axes.legend()
