"""Figures of loaded flanks: transmission error, load over the flank, load sharing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gensig.arrays import Array
from gensig.commands.figures.panels import (
    FAULTY,
    FIRST_SLICE,
    GREY,
    MESH_PERIODS,
    SOUND,
    STIFFNESS,
    Figure,
    Mark,
    Panel,
    across,
    bars,
    curve,
)
from gensig.systems.flank_optimum import Optimum
from gensig.systems.sliced_pair import SlicedPair, TransmissionError


def transmission_error_figure(system: SlicedPair, result: TransmissionError) -> Figure:
    """Transmission error, its orders, load over the flank and load sharing."""
    ripple = np.ptp(result.error) * 1e6
    error = Panel(
        f"Transmission error, {ripple:.3g} um from peak to peak",
        MESH_PERIODS,
        "approach along the line of action, um",
        [curve(*_over_periods(system, result, result.error * 1e6))],
    )
    order = np.arange(1, len(result.harmonics) + 1)
    orders = Panel(
        "Its mesh orders",
        "order of the mesh frequency",
        "amplitude, um",
        [bars(order, result.harmonics * 1e6, color=SOUND)],
    )
    load, sharing = _load_map(system, result), _sharing(result)
    if result.odd_pairs is not None:
        sharing = _sharing_with_fault(system, result, result.odd_pairs)
    return Figure([[error, orders], [load, sharing]], (11, 7.6), _title(system))


def front_figure(
    system: SlicedPair, before: Optimum, chosen: Optimum, front: Sequence[Optimum]
) -> Figure:
    """The front, and transmission error and load over the flank before and after."""
    line_loads = [optimum.line_load * 1e-3 for optimum in front]
    ripples = [optimum.ripple * 1e6 for optimum in front]
    worst = [curve(ripples, line_loads, "front", SOUND, "o-")]
    error, maps = [], []
    states = ((before, "s", GREY, "before"), (chosen, "D", FAULTY, "chosen"))
    for optimum, marker, color, name in states:
        ripple, line_load = optimum.ripple * 1e6, optimum.line_load * 1e-3
        worst.append(curve(ripple, line_load, name, color, marker))
        changed = replace(system, modification=optimum.modification)
        result = changed.transmission_error()
        deviation = (result.error - result.error.mean()) * 1e6
        error.append(curve(*_twice(deviation), name, color))
        loads = _load_map(changed, result)
        maps.append(replace(loads, title=f"Load over the flank, {name}"))
    upper = [
        Panel(
            "Worst of all cases",
            "transmission error, peak to peak, um",
            "largest line load, N/mm",
            worst,
        ),
        Panel("Transmission error less its mean", MESH_PERIODS, "um", error),
    ]
    return Figure([upper, maps], (11, 7.6), _title(system))


def sliced_stiffness_figure(
    system: SlicedPair,
    result: TransmissionError,
    position: Array,
    single: Array,
    *,
    sound: TransmissionError,
    faulty: Array | None = None,
) -> Figure:
    """The stiffness of one tooth pair and of the mesh, healthy and faulty.

    ``sound`` is the mesh without the fault.
    """
    pitches = position / system.pair.base_pitch
    stiffness = result.contact.stiffness / 1e9
    periods = _over_periods(system, result, stiffness)
    if faulty is None:
        pair = [curve(pitches, single / 1e9)]
        mesh = [curve(*periods)]
    else:
        pair = [
            curve(pitches, single / 1e9, "healthy"),
            curve(pitches, faulty / 1e9, "faulty"),
        ]
        without = np.resize(sound.contact.stiffness, stiffness.shape) / 1e9
        before = _over_periods(system, result, without)
        mesh = [
            curve(*before, "healthy", GREY, width=0.8),
            curve(*periods, "faulty", FAULTY),
        ]
    panels = [
        Panel("One pair, slices on the path", FIRST_SLICE, STIFFNESS, pair),
        Panel("Mesh", MESH_PERIODS, STIFFNESS, mesh),
    ]
    return Figure([panels], (11, 4.2), _title(system))


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


def _load_map(system: SlicedPair, result: TransmissionError) -> Panel:
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
    edges_across = result.slice_edges * 1e3
    look = {"cmap": "cividis", "vmin": 0.0}
    colors = Mark("pcolormesh", (edges_across, edges, loaded), look, "N/mm")
    limits = [across(y, linewidth=1.5, linestyle=":") for y in (0.0, end)]
    return Panel(
        title,
        "position across the face from the end that enters first, mm",
        "contact position, base pitches",
        [colors, *limits],
    )


def _sharing(result: TransmissionError) -> Panel:
    """Load share of one pair from its first contact to its last, and of its neighbors."""
    n_phases, n_pairs = result.load_share.shape
    phase = (np.arange(n_phases) + 0.5) / n_phases
    roll = (phase + np.arange(n_pairs)[:, None]).ravel() - 1.0
    share = result.load_share.T.ravel()
    beside = [
        curve(roll + shift, share, f"pair {shift:+d}", style=":") for shift in (-1, 1)
    ]
    return Panel(
        "Load sharing",
        "roll since the first slice passed A, base pitches",
        "share of the load",
        [curve(roll, share, "one pair"), *beside],
        xlim=(-0.5, n_pairs - 1.0),
    )


def _sharing_with_fault(
    system: SlicedPair, result: TransmissionError, odd_pairs: tuple[int, int]
) -> Panel:
    """Load shares of all pairs over the periods that see a fault."""
    roll = result.contact.roll / system.pair.base_pitch
    index = result.contact.pair_index
    first, last = odd_pairs
    labels = {first: "pair of faulty teeth", first - 1: "healthy pairs"}
    marks = []
    for pair in range(index.min(), index.max() + 1):
        share = np.where(index == pair, result.load_share, 0.0).sum(axis=1)
        in_contact = (index == pair).any(axis=1) & (share > 0.0)
        shown = np.where(in_contact, share, np.nan)
        is_odd = first <= pair <= last
        color = (GREY, FAULTY)[is_odd]
        marks.append(curve(roll, shown, labels.get(pair), color, zorder=2 + is_odd))
    return Panel(
        "Load sharing",
        "mesh periods; the faulty tooth enters at 0",
        "share of the load",
        marks,
        legend="lower left",
        xlim=(roll[0], roll[-1]),
        ylim=(0.0, None),
    )
