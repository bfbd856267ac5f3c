"""Gear pairs side by side: from their equations to the flat arrays of the compiled core."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics._mesh_kernels import N_NUMBERS, N_PLACES, Group
from gensig.dynamics._vector import LANES
from gensig.dynamics.pair import PairDynamics
from gensig.mesh.pair_table import GearTable

Array = NDArray[np.float64]

DOF_PLACES = (0, 1, 2, 3, 4, 5)  # of pinion x, y, rotation, wheel x, y, rotation


def pack(dynamics: Sequence[PairDynamics], step: float) -> Group:
    """Up to ``LANES`` gear pairs of one mesh law as one group; lanes without a pair repeat the first.

    Parameters
    ----------
    step : s    of integration, over which the paper's law switches a pair
    """
    lanes = [*dynamics, *[dynamics[0]] * (LANES - len(dynamics))]
    tables = [np.concatenate([_columns(one.table.pinion), _columns(one.table.wheel)]) for one in lanes]
    rows = [
        np.concatenate([_rows(one.table.pinion, 0), _rows(one.table.wheel, len(one.table.pinion.compliance))])
        for one in lanes
    ]
    sizes = [table.size for table in tables]
    teeth = [len(row) for row in rows]
    numbers, places = np.empty((N_NUMBERS, LANES)), np.empty((N_PLACES, LANES), dtype=np.int64)
    for lane, one in enumerate(lanes):
        numbers[:, lane] = one.numbers(step)
        first_tooth, n_nodes = sum(teeth[:lane]), tables[lane].shape[1]
        n_pinion = one.table.pair.pinion.n_teeth
        places[:, lane] = (
            n_pinion,
            one.table.pair.wheel.n_teeth,
            one.start_tooth_pinion,
            one.start_tooth_wheel,
            first_tooth,
            first_tooth + n_pinion,
            sum(sizes[:lane]),
            n_nodes * tables[lane].shape[2],
            n_nodes - 2,
            len(one.table.pinion.compliance),
        )
    systems = [one.system() for one in lanes]
    k_row, k_column = np.nonzero(np.any([system.stiffness != 0.0 for system in systems], axis=0))
    c_row, c_column = np.nonzero(np.any([system.damping != 0.0 for system in systems], axis=0))
    options = lanes[0].table.options
    return Group(
        numbers=numbers.ravel(),
        places=places.ravel(),
        table=np.concatenate([table.ravel() for table in tables]),
        tooth_row=np.concatenate(rows),
        tooth_error=np.concatenate([error for one in lanes for error in (one.pinion_error, one.wheel_error)]),
        one_sided=options.law == "one_sided",
        consistent=options.roll_torque == "consistent",
        dofs=DOF_PLACES,
        inverse_mass=_side_by_side([1.0 / system.mass for system in systems]),
        stiffness_row=k_row,
        stiffness_column=k_column,
        stiffness_value=_side_by_side([system.stiffness[k_row, k_column] for system in systems]),
        damping_row=c_row,
        damping_column=c_column,
        damping_value=_side_by_side([system.damping[c_row, c_column] for system in systems]),
        force=_side_by_side([system.force for system in systems]),
    )


def _side_by_side(values: Sequence[Array]) -> Array:
    """One row a value, one lane a machine, flat."""
    return np.ascontiguousarray(np.stack(values, axis=-1), dtype=np.float64).ravel()


def _columns(side: GearTable) -> Array:
    """Table columns [c, c', g, g'], (distinct, node, 4)."""
    return np.stack([side.compliance, side.compliance_slope, side.gap, side.gap_slope], axis=-1)


def _rows(side: GearTable, offset: int) -> NDArray[np.int64]:
    """Table row of every tooth, -1 for a missing one, (tooth,)."""
    return np.where(side.present[side.kind], side.kind + offset, -1)
