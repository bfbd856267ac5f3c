"""Figures of loaded flanks: transmission error, load over the flank, load sharing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.commands.figures.style import (
    COLORS,
    FAULTY,
    FIRST_SLICE,
    GREY,
    MESH_PERIODS,
    SOUND,
    STIFFNESS,
    curve,
    panels,
    save,
    titles,
)
from gensig.systems.flank_optimum import Optimum
from gensig.systems.sliced_pair import SlicedPair, TransmissionError

Array = NDArray[np.float64]


def plot_transmission_error(
    system: SlicedPair, result: TransmissionError, path: Path
) -> None:
    """Draw transmission error, its orders, load over the flank and load sharing."""
    figure, axes = panels(2, 2, 11, 7.6)
    (error, orders), (load, sharing) = axes
    _error(error, system, result)
    _orders(orders, result)
    _load_map(figure, load, system, result)
    if result.odd_pairs is None:
        _sharing(sharing, result)
    else:
        _sharing_with_fault(sharing, system, result, result.odd_pairs)
    figure.suptitle(_title(system))
    save(figure, path)


def plot_front(
    system: SlicedPair,
    before: Optimum,
    chosen: Optimum,
    front: Sequence[Optimum],
    path: Path,
) -> None:
    """Draw the front, and transmission error and load over the flank before and after."""
    figure, axes = panels(2, 2, 11, 7.6)
    worst, error = axes[0]
    line_loads = [optimum.line_load * 1e-3 for optimum in front]
    ripples = [optimum.ripple * 1e6 for optimum in front]
    curve(worst, ripples, line_loads, SOUND, "front", style="o-")
    states = ((before, "s", GREY, "before"), (chosen, "D", FAULTY, "chosen"))
    for panel, (optimum, marker, color, name) in zip(axes[1], states, strict=True):
        ripple, line_load = optimum.ripple * 1e6, optimum.line_load * 1e-3
        worst.plot(ripple, line_load, marker, color=color, label=name)
        changed = replace(system, modification=optimum.modification)
        result = changed.transmission_error()
        deviation = (result.error - result.error.mean()) * 1e6
        curve(error, *_twice(deviation), color, name)
        _load_map(figure, panel, changed, result)
        panel.set_title(f"Load over the flank, {name}")
    abscissa = "transmission error, peak to peak, um"
    titles(worst, "Worst of all cases", abscissa, "largest line load, N/mm")
    worst.legend()
    titles(error, "Transmission error less its mean", MESH_PERIODS, "um")
    error.legend()
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
    """Draw the stiffness of one tooth pair and of the mesh, healthy and faulty.

    ``sound`` is the mesh without the fault.
    """
    figure, axes = panels(1, 2, 11, 4.2)
    pair, mesh = axes[0]
    pitches = position / system.pair.base_pitch
    stiffness = result.contact.stiffness / 1e9
    curve(pair, pitches, single / 1e9, SOUND, "healthy")
    if faulty is None:
        curve(mesh, *_over_periods(system, result, stiffness), SOUND, "healthy")
    else:
        curve(pair, pitches, faulty / 1e9, FAULTY, "faulty")
        pair.legend()
        without = np.resize(sound.contact.stiffness, stiffness.shape) / 1e9
        periods = _over_periods(system, result, without)
        curve(mesh, *periods, GREY, "healthy", width=0.8)
        curve(mesh, *_over_periods(system, result, stiffness), FAULTY, "faulty")
        mesh.legend()
    titles(pair, "One pair, slices on the path", FIRST_SLICE, STIFFNESS)
    titles(mesh, "Mesh", MESH_PERIODS, STIFFNESS)
    figure.suptitle(_title(system))
    save(figure, path)


def _title(system: SlicedPair) -> str:
    pair = system.pair
    helix = abs(np.degrees(pair.pinion.helix_angle))
    return (
        f"{pair.pinion.n_teeth}/{pair.wheel.n_teeth} teeth, helix {helix:g} deg, "
        f"contact ratio {pair.transverse_contact_ratio:.3f} + {pair.overlap_ratio:.3f}, "
        f"{system.torque:g} N m, slices {system.slices.slice_coupling}"
    )


def _twice(values: Array) -> tuple[Array, Array]:
    """Mesh periods and values of one period, drawn twice."""
    return np.arange(2 * len(values)) / len(values), np.tile(values, 2)


def _over_periods(
    system: SlicedPair, result: TransmissionError, values: Array
) -> tuple[Array, Array]:
    """Mesh periods of roll and values: one period twice, or all periods that see a fault."""
    if result.n_periods > 1:
        return result.contact.roll / system.pair.base_pitch, values
    return _twice(values)


def _error(axes: Any, system: SlicedPair, result: TransmissionError) -> None:
    curve(axes, *_over_periods(system, result, result.error * 1e6), SOUND)
    ripple = np.ptp(result.error) * 1e6
    title = f"Transmission error, {ripple:.3g} um from peak to peak"
    titles(axes, title, MESH_PERIODS, "approach along the line of action, um")
    axes.ticklabel_format(axis="y", useOffset=False)


def _orders(axes: Any, result: TransmissionError) -> None:
    order = np.arange(1, len(result.harmonics) + 1)
    axes.bar(order, result.harmonics * 1e6, color=SOUND)
    titles(axes, "Its mesh orders", "order of the mesh frequency", "amplitude, um")


def _load_map(
    figure: Any, axes: Any, system: SlicedPair, result: TransmissionError
) -> None:
    """Largest load of every point of the flank over the period, as a pair passes it."""
    pitch, contact = system.pair.base_pitch, result.contact
    end = system.pair.transverse_contact_ratio
    edges = np.linspace(-0.15, end + 0.15, 121)
    grid = np.zeros((len(edges) - 1, len(result.slice_middle)))
    row = np.searchsorted(edges, contact.position / pitch) - 1
    column = np.broadcast_to(np.arange(grid.shape[1]), row.shape)
    inside = (row >= 0) & (row < len(grid))
    title = "Load over the flank (dotted: ends of the path of contact)"
    if result.odd_pairs is not None:
        first, last = result.odd_pairs
        is_odd = (contact.pair_index >= first) & (contact.pair_index <= last)
        inside &= is_odd[..., None]
        title = "Load over the faulty flanks"
    np.maximum.at(grid, (row[inside], column[inside]), contact.line_load[inside] * 1e-3)
    loaded = np.where(grid > 0.0, grid, np.nan)
    across = result.slice_edges * 1e3
    image = axes.pcolormesh(across, edges, loaded, cmap="cividis", vmin=0.0)
    for limit in (0.0, end):
        axes.axhline(limit, color=GREY, linestyle=":")
    abscissa = "position across the face from the end that enters first, mm"
    titles(axes, title, abscissa, "contact position, base pitches")
    figure.colorbar(image, ax=axes, label="N/mm")


def _sharing(axes: Any, result: TransmissionError) -> None:
    """Load share of one pair from its first contact to its last, and of its neighbors."""
    n_phases, n_pairs = result.load_share.shape
    phase = (np.arange(n_phases) + 0.5) / n_phases
    roll = (phase + np.arange(n_pairs)[:, None]).ravel() - 1.0
    share = result.load_share.T.ravel()
    curve(axes, roll, share, SOUND, "one pair")
    for shift, color in zip((-1, 1), COLORS[1:], strict=False):
        curve(axes, roll + shift, share, color, f"pair {shift:+d}", style=":")
    abscissa = "roll since the first slice passed A, base pitches"
    titles(axes, "Load sharing", abscissa, "share of the load")
    axes.set_xlim(-0.5, n_pairs - 1.0)
    axes.legend()


def _sharing_with_fault(
    axes: Any, system: SlicedPair, result: TransmissionError, odd_pairs: tuple[int, int]
) -> None:
    """Load shares of all pairs over the periods that see a fault."""
    roll = result.contact.roll / system.pair.base_pitch
    index = result.contact.pair_index
    first, last = odd_pairs
    labels = {first: "pair of faulty teeth", first - 1: "healthy pairs"}
    for pair in range(index.min(), index.max() + 1):
        share = np.where(index == pair, result.load_share, 0.0).sum(axis=1)
        in_contact = (index == pair).any(axis=1) & (share > 0.0)
        is_odd = first <= pair <= last
        axes.plot(
            roll,
            np.where(in_contact, share, np.nan),
            color=(GREY, FAULTY)[is_odd],
            zorder=2 + is_odd,
            label=labels.get(pair),
        )
    abscissa = "mesh periods; the faulty tooth enters at 0"
    titles(axes, "Load sharing", abscissa, "share of the load")
    axes.set(xlim=(roll[0], roll[-1]), ylim=(0.0, None))
    axes.legend(loc="lower left")
