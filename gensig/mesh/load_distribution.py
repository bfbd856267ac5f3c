"""Static equilibrium of the pairs in contact: C F = approach - gap with F >= 0."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gensig.arrays import Array
from gensig.geometry.contact import GearPair
from gensig.geometry.tooth import Tooth
from gensig.material import Material
from gensig.mesh._static_kernels import (
    add_part,
    locate_pairs,
    share_over_pairs,
)
from gensig.mesh.modification import PLAIN, PairModification
from gensig.mesh.options import MeshOptions
from gensig.mesh.pair_table import pair_table
from gensig.mesh.tooth_table import GearTeeth, ToothTable

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
    gears, n_nodes = (table.pinion, table.wheel), len(table.position)
    errors, tilts = (
        [_of_teeth(each, teeth) for each, teeth in zip(values, gears, strict=True)]
        for values in (meeting.errors, meeting.tilts)
    )
    shape = len(roll), table.n_pairs
    position, share, back = np.empty(shape), np.empty(shape), np.empty(shape)
    cell, pinion, wheel = np.empty((3, *shape), dtype=np.int64)
    locate_pairs(
        roll,
        table.pair.base_pitch,
        table.first_pitch,
        (table.position[0], table.position[-1], n_nodes - 1),
        table.pair.pitch_point + table.half_lag,
        table.present,
        meeting.start_teeth,
        *(teeth.kind for teeth in gears),
        *errors,
        *tilts,
        position,
        cell,
        share,
        pinion,
        wheel,
        back,
    )
    compliance = np.full((*shape, len(table.depth)), -table.shared_compliance)
    gap = np.repeat(back[:, :, None], len(table.depth), axis=2)
    for part in table.parts:
        add_part(part.compliance, part.gap, pinion, wheel, cell, share, compliance, gap)
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
