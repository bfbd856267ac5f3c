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
from gensig.mesh._static_kernels import add_part, share_over_pairs
from gensig.mesh.modification import PLAIN, PairModification
from gensig.mesh.options import MeshOptions
from gensig.mesh.pair_table import pair_table
from gensig.mesh.tooth_table import GearTeeth, ToothTable

Array = NDArray[np.float64]

LOAD_ROUNDS = 3
LEAST_LOAD_SHARE = 0.02  # local compliance has no limit as the load falls to 0


@dataclass(frozen=True, slots=True, kw_only=True)
class PairStates:
    """Chords of the tooth pairs at each phase, in order of entry.

    ``compliance`` less the shared part and ``gap`` are (phase, pair, chord), ``position`` (phase,
    pair) m. An absent pair has infinite gaps.
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
    return np.maximum(cell, 0), scaled - cell


OfTeeth = tuple[Array | None, Array | None]  # of pinion and wheel, (tooth,); None: 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Meeting:
    """Start teeth of a mesh, and the errors of single teeth, of pinion and wheel.

    Parameters
    ----------
    start_teeth : teeth that enter at A at roll 0; of helical ones their first slices
    errors : m     gap at the pitch point
    tilts : m/m    growth of the gap with the position along the path
    """

    start_teeth: tuple[int, int] = (0, 0)
    errors: OfTeeth = (None, None)
    tilts: OfTeeth = (None, None)


PERFECT = Meeting()


def pair_states(
    table: ToothTable, roll: Array, meeting: Meeting = PERFECT
) -> PairStates:
    """Pairs at the pinion's roll, (phase,) m along the line of action.

    Errors and tilts of the teeth are those of the middle of the face.
    """
    pitch = table.pair.base_pitch
    newest = np.floor(roll / pitch).astype(np.int64) - table.first_pitch
    index = newest[:, None] - np.arange(table.n_pairs)
    position = roll[:, None] - index * pitch
    cell, share = cells(table.position, position)
    beyond = position - table.pair.pitch_point - table.half_lag
    kinds, back = [], np.zeros(position.shape)
    gears = zip(
        (table.pinion, table.wheel),
        meeting.start_teeth,
        meeting.errors,
        meeting.tilts,
        strict=True,
    )
    for teeth, start, errors, tilts in gears:
        tooth = (index + start) % len(teeth.kind)
        kinds.append(teeth.kind[tooth])
        back += (
            _of_teeth(errors, teeth)[tooth] + _of_teeth(tilts, teeth)[tooth] * beyond
        )
    back[~table.present[kinds[0], kinds[1]]] = np.inf
    shape = *position.shape, len(table.depth)
    compliance = np.full(shape, -table.shared_compliance)
    gap = np.broadcast_to(back[:, :, None], shape).copy()
    for part in table.parts:
        add_part(part.compliance, part.gap, *kinds, cell, share, compliance, gap)
    return PairStates(compliance=compliance, gap=gap, position=position)


def _of_teeth(values: Array | None, teeth: GearTeeth) -> Array:
    """Values of a gear's teeth, (tooth,); 0 for None, ValueError for another number of teeth."""
    nothing = np.zeros(len(teeth.kind))
    return nothing if values is None else nothing + values


def static_mesh(table: ToothTable, states: PairStates, force: float) -> StaticMesh:
    """Load sharing, approach and tangent stiffness dF/d(approach) under a total mesh force in N.

    ``mesh.law=paper`` has no gaps: pairs on the path share by stiffness, and where none is on it
    the stiffness is 0 and the approach infinite.
    """
    gap = states.gap
    if table.options.law == "paper":
        end = table.pair.path_of_contact + 2.0 * table.half_lag
        on_path = (states.position >= 0.0) & (states.position <= end)
        gap = np.where(on_path[:, :, None] & np.isfinite(gap), 0.0, np.inf)
    n_phases = len(gap)
    approach, load = np.empty(n_phases), np.empty(gap.shape[:2])
    stiffness = np.empty(n_phases)
    given = states.compliance, gap, table.depth, force, table.shared_compliance
    share_over_pairs(*given, approach, load, stiffness)
    return StaticMesh(approach=approach, load=load, stiffness=stiffness)


def loaded_pair_table(
    pair: GearPair,
    material: Material,
    options: MeshOptions,
    teeth: Mapping[tuple[str, int], Tooth] | None = None,
    *,
    force: float,
    modification: PairModification = PLAIN,
) -> ToothTable:
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


def _sound_states(table: ToothTable) -> PairStates:
    """Healthy tooth pairs at every node of one pitch, in order of entry."""
    per_pitch = table.options.points_per_pitch

    def of_pairs(nodes: Array) -> Array:
        by_pair = nodes[:-1].reshape(table.n_pairs, per_pitch)
        return np.ascontiguousarray(by_pair.T)

    compliance, _, gap, _ = (column[0, 0, 0] for column in table.pairs)
    return PairStates(
        compliance=of_pairs(compliance - table.shared_compliance)[:, :, None],
        gap=of_pairs(gap)[:, :, None],
        position=of_pairs(table.position),
    )
