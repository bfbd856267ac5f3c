"""Gear pairs side by side: from their equations to the flat arrays of the compiled core."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics._layout import (
    COLUMNS,
    FOLLOWED,
    N_EXACT,
    N_NUMBERS,
    N_PLACES,
    N_PROFILE,
    NODES_PER_METER,
    NOMINAL_ACCELERATION,
    NOMINAL_ANGLE,
    NOMINAL_SPEED,
    PER_SWITCH_WIDTH,
    TORQUE,
    TORQUE_SLOPE,
    Group,
    HelicalGroup,
)
from gensig.dynamics._vector import n_lanes
from gensig.dynamics.helical import pitches
from gensig.dynamics.pair import PairDynamics
from gensig.mesh.pair_table import GearTable, PairTable
from gensig.mesh.sliced.sliced_statics import left_out_energy
from gensig.mesh.sliced.sliced_table import SlicedTable

Array = NDArray[np.float64]

CELLS_PER_SECOND = 1000.0  # in which speed and torque run straight


def fill_lanes(dynamics: Sequence[PairDynamics], precision: str) -> list[PairDynamics]:
    """One machine a lane; lanes without one repeat the first."""
    return [*dynamics, *[dynamics[0]] * (n_lanes(precision) - len(dynamics))]


def pack(
    dynamics: Sequence[PairDynamics],
    step: float,
    precision: str = "float64",
    span: tuple[float, float] = (0.0, 0.0),
) -> Group:
    """Gear pairs of one mesh law as one group.

    Parameters
    ----------
    step : s    of integration, over which the paper's law switches a pair
    span : s    from when to when the course of speed and torque is needed, where they change
    """
    lanes = fill_lanes(dynamics, precision)
    tables, rows, steps = zip(*[_rows(one.table) for one in lanes], strict=True)
    sizes, depth = [table[..., :COLUMNS].size for table in tables], _depths(lanes)
    teeth = [len(row) for row in rows]
    numbers, exact = (
        np.empty((N_NUMBERS, len(lanes)), dtype=precision),
        np.empty((N_EXACT, len(lanes))),
    )
    places = np.empty((N_PLACES, len(lanes)), dtype=np.int64)
    rests = [one.rest() for one in lanes]
    for lane, one in enumerate(lanes):
        numbers[:, lane], exact[:, lane] = (
            one.numbers(step, rests[lane]),
            one.exact_numbers(),
        )
        first_tooth, (_, n_chords, n_nodes, _) = sum(teeth[:lane]), tables[lane].shape
        first_table, per_chord = sum(sizes[:lane]), n_nodes * COLUMNS
        first_pitch, last_pitch = pitches(one.table)
        n_pinion = one.table.pair.pinion.n_teeth
        places[:, lane] = (
            n_pinion,
            one.table.pair.wheel.n_teeth,
            one.start_tooth_pinion,
            one.start_tooth_wheel,
            first_tooth,
            first_tooth + n_pinion,
            first_table,
            n_chords * per_chord,
            n_nodes - 2,
            *steps[lane],
            first_pitch,
            last_pitch - first_pitch,
            per_chord,
            first_table
            + per_chord
            * (one.table.set_chord if isinstance(one.table, SlicedTable) else 0),
        )
    systems = [one.system() for one in lanes]
    stiffness = np.stack([system.stiffness for system in systems])
    damping = np.stack([system.damping for system in systems])
    mass, rotation = (
        np.stack([getattr(system, name) for system in systems])
        for name in ("mass", "rotation")
    )
    n_dof = mass.shape[1]
    coupled = np.any((stiffness != 0.0) | (damping != 0.0), axis=0) & ~np.eye(
        n_dof, dtype=bool
    )
    row, column = np.nonzero(coupled)
    profile, profile_first, cells_per_second = _nominal(lanes, span)

    def side_by_side(values: Array) -> NDArray[np.floating]:
        """(lane, row...) flat, one lane beside the other."""
        return np.ascontiguousarray(np.moveaxis(values, 0, -1), dtype=precision).ravel()

    diagonal = np.arange(n_dof)
    set_force = np.stack(
        [
            system.force - one.mesh_force * one.approach_direction()
            for system, one in zip(systems, lanes, strict=True)
        ]
    )
    options = lanes[0].table.options
    kind = HelicalGroup if lanes[0].is_helical else Group
    return kind(
        numbers=numbers.ravel(),
        exact=exact.ravel(),
        places=places.ravel(),
        n_pairs=int(places[FOLLOWED].max()),
        n_chords=len(depth[0]),
        table=np.concatenate([table[..., :COLUMNS].ravel() for table in tables]).astype(
            precision
        ),
        depth=depth.astype(precision).ravel(),
        beside=np.concatenate(
            [table[..., COLUMNS:].ravel() for table in tables]
        ).astype(precision),
        bend=np.outer(0.5 / exact[NODES_PER_METER], [1.0, 0.0, 1.0, 0.0])
        .astype(precision)
        .ravel(),
        tooth_row=np.concatenate(rows),
        tooth_error=np.concatenate(
            [error for one in lanes for error in (one.pinion_error, one.wheel_error)]
        ),
        tooth_tilt=np.concatenate(
            [tilt for one in lanes for tilt in (one.pinion_tilt, one.wheel_tilt)]
        ),
        one_sided=options.law == "one_sided",
        consistent=options.roll_torque == "consistent",
        reach=side_by_side(np.stack([one.approach_direction() for one in lanes])),
        inverse_mass=side_by_side(1.0 / mass),
        stiffness=side_by_side(stiffness[:, diagonal, diagonal]),
        damping=side_by_side(damping[:, diagonal, diagonal]),
        other_first=np.searchsorted(row, np.arange(n_dof + 1)),
        other_column=np.ascontiguousarray(column),
        other_stiffness=side_by_side(stiffness[:, row, column]),
        other_damping=side_by_side(damping[:, row, column]),
        force=side_by_side(
            set_force - np.einsum("lij,lj->li", stiffness, np.stack(rests))
        ),
        set_force=side_by_side(set_force),
        rest=np.stack(rests, axis=-1),
        rotation=side_by_side(rotation),
        held=side_by_side(np.einsum("lij,lj->li", stiffness, rotation)),
        carried=side_by_side(mass * rotation),
        profile=profile,
        profile_first=profile_first,
        cells_per_second=cells_per_second,
    )


def _nominal(
    lanes: Sequence[PairDynamics], span: tuple[float, float]
) -> tuple[Array, int, float]:
    """Nominal motion and torque by cells of time, (cell, 5, lane) flat, the number of the first,
    and cells a second.

    Speed and torque run straight through a cell; where neither changes there is one cell.
    """
    if all(one.operating.is_steady for one in lanes):
        profile = np.zeros((1, N_PROFILE, len(lanes)))
        profile[0, NOMINAL_SPEED], profile[0, TORQUE] = (
            [one.operating.speed for one in lanes],
            1.0,
        )
        return profile.ravel(), 0, 1.0
    # cells begin at multiples of their length, so that the same instants have the same bits
    # whatever the span
    first = math.floor(span[0] * CELLS_PER_SECOND)
    last = max(math.ceil(span[1] * CELLS_PER_SECOND), first + 1)
    edges = np.arange(first, last + 1) / CELLS_PER_SECOND
    profile = np.empty((last - first, N_PROFILE, len(lanes)))
    for lane, one in enumerate(lanes):
        nominal = one.nominal(edges)
        gain, slope = (
            np.diff(values) * CELLS_PER_SECOND
            for values in (nominal.speed, nominal.torque_factor)
        )
        turned = 0.5 * (nominal.speed[1:] + nominal.speed[:-1]) / CELLS_PER_SECOND
        before, after = turned[:-first], turned[-first:]
        angle = np.concatenate(
            [-np.cumsum(before[::-1])[::-1], [0.0], np.cumsum(after)]
        )
        profile[:, NOMINAL_ANGLE, lane], profile[:, NOMINAL_SPEED, lane] = (
            angle[:-1],
            nominal.speed[:-1],
        )
        profile[:, NOMINAL_ACCELERATION, lane] = gain
        profile[:, TORQUE, lane], profile[:, TORQUE_SLOPE, lane] = (
            nominal.torque_factor[:-1],
            slope,
        )
    return profile.ravel(), first, CELLS_PER_SECOND


def _depths(lanes: Sequence[PairDynamics]) -> Array:
    """Bites from which on chords hold, (lane, chord) m, infinite for those that a lane has not."""
    own = [
        one.table.depth if isinstance(one.table, SlicedTable) else np.zeros(1)
        for one in lanes
    ]
    depth = np.full((len(lanes), max(len(values) for values in own)), np.inf)
    for row, values in zip(depth, own, strict=True):
        row[: len(values)] = values
    return depth


def _rows(
    table: PairTable | SlicedTable,
) -> tuple[Array, NDArray[np.int64], tuple[int, int]]:
    """As ``_table_rows``, rows (row, chord, node, column); behind the columns of helical teeth
    what stands beside them."""
    if isinstance(table, PairTable):
        rows, row, steps = _table_rows(table)
        return rows[:, None], row, steps
    (pinion, pinion_row), (wheel, wheel_row) = (
        np.unique(kind, return_inverse=True)
        for kind in (table.pinion_kind, table.wheel_kind)
    )
    touch = [
        np.broadcast_to(value[:, :, :1], value.shape)
        for value in (table.gap, table.gap_slope)
    ]
    values = [
        table.compliance,
        table.compliance_slope,
        table.gap,
        table.gap_slope,
        *left_out_energy(table),
        *touch,
    ]
    pairs = np.stack(
        [
            value[np.ix_(pinion, wheel)].reshape(-1, *value.shape[2:])
            for value in values
        ],
        axis=-1,
    )
    if pinion[0] != 0 or wheel[0] != 0:  # back flanks are those of sound teeth
        pairs = np.concatenate(
            [np.stack([value[0, 0] for value in values], axis=-1)[None], pairs]
        )
        wheel_row = wheel_row + 1
    sides = (
        (table.pinion_kind, table.pinion_present, pinion_row),
        (table.wheel_kind, table.wheel_present, wheel_row),
    )
    return (
        pairs,
        np.concatenate(
            [np.where(present[kind], row, -1) for kind, present, row in sides]
        ),
        (len(wheel), 0),
    )


def _columns(side: GearTable) -> Array:
    """Table columns [c, c', g, g'], (distinct, node, 4)."""
    return np.stack(
        [side.compliance, side.compliance_slope, side.gap, side.gap_slope], axis=-1
    )


def at_step(group: Group, before: float, after: float) -> Group:
    """The same group for another step, s."""
    numbers = group.numbers.copy().reshape(N_NUMBERS, -1)
    numbers[PER_SWITCH_WIDTH] *= before / after
    return group._replace(numbers=numbers.ravel())


def _table_rows(table: PairTable) -> tuple[Array, NDArray[np.int64], tuple[int, int]]:
    """Rows (row, node, 4) of which the first is that of sound teeth, row (tooth,) of every tooth,
    and two steps.

    Rows are pairs of the distinct teeth that the gears have, or, where those would take much more
    memory, the teeth themselves. The steps lead from one pinion tooth to the next and, where
    teeth stand by themselves, to the wheel's.
    """
    (pinion, pinion_row), (wheel, wheel_row) = _used(table.pinion), _used(table.wheel)
    if _are_many(table):
        everything = np.concatenate([_columns(table.pinion), _columns(table.wheel)])
        row = np.concatenate(
            [_present(side, side.kind) for side in (table.pinion, table.wheel)]
        )
        return everything, row, (1, len(table.pinion.compliance))
    pairs = (pinion[:, None] + wheel[None]).reshape(-1, *pinion.shape[1:])
    if not (
        np.any(table.pinion.kind == 0) and np.any(table.wheel.kind == 0)
    ):  # back flanks are those of sound teeth
        pairs = np.concatenate(
            [(_columns(table.pinion)[0] + _columns(table.wheel)[0])[None], pairs]
        )
        wheel_row = wheel_row + 1
    row = np.concatenate(
        [_present(table.pinion, pinion_row), _present(table.wheel, wheel_row)]
    )
    return pairs, row, (len(wheel), 0)


def _are_many(table: PairTable) -> bool:
    """Whether all pairs of distinct teeth would take much more memory than the teeth."""
    n_pinion, n_wheel = (
        len(np.unique(side.kind)) for side in (table.pinion, table.wheel)
    )
    return n_pinion * n_wheel > 2 * (n_pinion + n_wheel)


def _used(side: GearTable) -> tuple[Array, NDArray[np.int64]]:
    """Columns of the distinct teeth that the gear has, (distinct, node, 4), and which of them
    every tooth is.
    """
    used, row = np.unique(side.kind, return_inverse=True)
    return _columns(side)[used], row


def _present(side: GearTable, row: NDArray[np.int64]) -> NDArray[np.int64]:
    """Row of every tooth, -1 for a missing one, (tooth,)."""
    return np.where(side.present[side.kind], row, -1)
