"""Static equilibrium of the pairs in contact: C F = approach - gap with F >= 0."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gensig.geometry.contact import GearPair
from gensig.geometry.tooth import Tooth
from gensig.material import Material
from gensig.mesh.modification import PLAIN, PairModification
from gensig.mesh.options import MeshOptions
from gensig.mesh.pair_table import N_PAIRS, PairTable, pair_table

Array = NDArray[np.float64]

LOAD_ROUNDS = 3
LEAST_LOAD_SHARE = 0.02  # local compliance has no limit as the load falls to 0


@dataclass(frozen=True, slots=True, kw_only=True)
class PairStates:
    """Compliance (less the shared part), gap and position of the tooth pairs, (phase, pair).

    Pairs are in order of entry, the pair that approaches A first. An absent pair has an infinite
    gap.
    """

    compliance: Array
    gap: Array
    position: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class StaticMesh:
    """Equilibrium under one force.

    ``approach`` (phase,) m, ``load`` (phase, pair) N, ``stiffness`` (phase,) N/m.
    """

    approach: Array
    load: Array
    stiffness: Array


def cells(nodes: Array, position: Array) -> tuple[NDArray[np.int64], Array]:
    """Cells between equally spaced nodes that hold the positions, and relative positions there."""
    n_cells = len(nodes) - 1
    scaled = (position - nodes[0]) * (n_cells / (nodes[-1] - nodes[0]))
    scaled = np.clip(scaled, 0.0, n_cells)
    cell = np.minimum(scaled.astype(np.int64), n_cells - 1)
    return cell, scaled - cell


def pair_states(
    table: PairTable,
    roll: Array,
    *,
    start_tooth_pinion: int = 0,
    start_tooth_wheel: int = 0,
    pinion_error: Array | None = None,
    wheel_error: Array | None = None,
    pinion_tilt: Array | None = None,
    wheel_tilt: Array | None = None,
) -> PairStates:
    """Pairs at the pinion's roll, (phase,) m along the line of action; at 0 the start teeth enter
    at A.

    ``pinion_error`` and ``wheel_error`` (tooth,) m open the gaps at the pitch point,
    ``pinion_tilt`` and ``wheel_tilt`` (tooth,) m/m by as much more for every metre further along
    the path.
    """
    pitch = table.pair.base_pitch
    newest = np.floor(roll / pitch).astype(np.int64)
    index = newest[:, None] + 1 - np.arange(N_PAIRS)
    position = roll[:, None] - index * pitch
    cell, part = cells(table.position, position)
    compliance = np.full(position.shape, -table.shared_compliance)
    gap = np.zeros(position.shape)
    sides = (
        (table.pinion, start_tooth_pinion, pinion_error, pinion_tilt),
        (table.wheel, start_tooth_wheel, wheel_error, wheel_tilt),
    )
    for side, start, error, tilt in sides:
        teeth = (index + start) % len(side.kind)
        kinds = side.kind[teeth]
        if error is not None:
            gap += error[teeth]
        if tilt is not None:
            gap += tilt[teeth] * (position - table.pair.pitch_point)
        low, high = (kinds, cell), (kinds, cell + 1)
        soft, back = side.compliance, side.gap
        compliance += (1.0 - part) * soft[low] + part * soft[high]
        gap += (1.0 - part) * back[low] + part * back[high]
        gap[~side.present[kinds]] = np.inf
    return PairStates(compliance=compliance, gap=gap, position=position)


def static_mesh(table: PairTable, states: PairStates, force: float) -> StaticMesh:
    """Load sharing, approach and tangent stiffness dF/d(approach) under a total mesh force in N.

    ``mesh.law=paper`` has no gaps: pairs on the path share by stiffness, and where none is on it
    the stiffness is 0 and the approach infinite.
    """
    gap = states.gap
    if table.options.law == "paper":
        end = table.pair.path_of_contact
        on_path = (states.position >= 0.0) & (states.position <= end)
        gap = np.where(on_path & np.isfinite(gap), 0.0, np.inf)
    order = np.argsort(gap, axis=1, kind="stable")
    sorted_gap = np.take_along_axis(gap, order, axis=1)
    compliance = np.take_along_axis(states.compliance, order, axis=1)
    touching = np.isfinite(sorted_gap)
    stiffness = np.cumsum(np.where(touching, 1.0 / compliance, 0.0), axis=1)
    closing = np.where(touching, sorted_gap, 0.0) / compliance
    # approach less the shared deflection if the first m pairs carry
    with np.errstate(divide="ignore"):
        local = (force + np.cumsum(closing, axis=1)) / stiffness
    carried = (local > sorted_gap).sum(axis=1)
    last = np.maximum(carried - 1, 0)
    rows = np.arange(len(last))
    total, approach = stiffness[rows, last], local[rows, last]
    lost = carried == 0
    deflection = np.where(lost, 0.0, approach)[:, None] - gap
    load = np.maximum(deflection, 0.0) / states.compliance
    return StaticMesh(
        approach=np.where(lost, np.inf, approach + table.shared_compliance * force),
        load=np.where(lost[:, None], 0.0, load),
        stiffness=np.where(lost, 0.0, total / (1.0 + table.shared_compliance * total)),
    )


def loaded_pair_table(
    pair: GearPair,
    material: Material,
    options: MeshOptions,
    teeth: Mapping[tuple[str, int], Tooth] | None = None,
    *,
    force: float,
    modification: PairModification = PLAIN,
) -> PairTable:
    """Table for a total force in N: its contact term is the secant at the load of healthy pairs."""
    load: Array | float = force
    if options.contact != "linear":
        load = sound_load(pair, material, options, force, modification)
    return pair_table(
        pair, material, options, teeth, load=load, modification=modification
    )


@lru_cache(maxsize=32)  # shared by the records of a condition
def sound_load(
    pair: GearPair,
    material: Material,
    options: MeshOptions,
    force: float,
    modification: PairModification = PLAIN,
) -> Array:
    """Quasi-static load of a healthy tooth pair at every node, (node,) N, read-only.

    ``force`` is the total in N. Load sharing and local compliance depend on each other; the
    sharing changes by less than 1e-3 after three rounds.
    """
    load: Array | float = force
    for _ in range(LOAD_ROUNDS):
        sound = pair_table(
            pair, material, options, load=load, modification=modification
        )
        shares = static_mesh(sound, _sound_states(sound), force).load
        load = np.maximum(np.append(shares.T.ravel(), 0.0), LEAST_LOAD_SHARE * force)
    loads = np.asarray(load)
    loads.flags.writeable = False
    return loads


def _sound_states(table: PairTable) -> PairStates:
    """Healthy tooth pairs at every node of one pitch, in order of entry."""

    def of_pairs(nodes: Array) -> Array:
        return nodes[:-1].reshape(N_PAIRS, table.options.points_per_pitch).T

    both = table.pinion.compliance[0] + table.wheel.compliance[0]
    return PairStates(
        compliance=of_pairs(both - table.shared_compliance),
        gap=of_pairs(table.pinion.gap[0] + table.wheel.gap[0]),
        position=of_pairs(table.position),
    )
