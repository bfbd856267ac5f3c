"""Table of teeth in slices: chords of the force of every distinct pair over its approach.

The force of a sliced tooth pair is convex in the approach: with more depth more slices bear.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

from gensig.arrays import Array, Integers
from gensig.errors import FaultError, GeometryError
from gensig.geometry.contact import GearPair
from gensig.geometry.tooth import Tooth, healthy_tooth
from gensig.material import Material
from gensig.mesh.options import MeshOptions, SliceOptions
from gensig.mesh.pair_table import (
    FIRST_PITCH,
    SMOOTHED_GAP,
    SMOOTHED_SHARE,
    distinct_teeth,
)
from gensig.mesh.sliced._slice_kernels import bite_forces
from gensig.mesh.sliced.slice_entry import over_slice
from gensig.mesh.sliced.slice_teeth import NO_FLANK
from gensig.mesh.sliced.slices import (
    SlicedMesh,
    cut_by_field,
    loaded_contact,
    sliced_mesh,
)
from gensig.mesh.smooth_table import smooth
from gensig.mesh.thermal.paper_growth import PaperGrowth
from gensig.mesh.tooth_table import GearTeeth, TablePart, ToothTable

N_CHORDS = 8
N_TRIED, N_SAMPLES = 32, 24  # depths and positions at which chords are chosen
PER_SLICE = 4  # positions computed from one slice's entry to the next slice's
SLICES_PER_STEP = 10  # fewer slices enter with a jolt: every node is computed
UNMET_STEP = (
    8  # nodes per computed position for teeth that never meet on working flanks
)
DEEPEST = 3.0  # largest depth over the largest static depth
LEAST_REACH = 1e-4  # m; first gaps up to here are tabulated, for teeth that stand proud
FARTHEST = 1e-3  # m; cap of first gaps
N_PHASES = 32
MOST_PAIRS = 400  # distinct tooth pairs, about a tenth of a second and 0.8 MB each
OFF_PATH = 1e3  # times the least compliance, where mesh.law=paper has no contact


@dataclass(frozen=True, slots=True, kw_only=True)
class _Keyed:
    """A tooth or an array that is compared by its content."""

    key: bytes
    value: Any = field(compare=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Setting:
    """Inputs common to all tooth pairs; ``pinion`` and ``wheel`` are the commonest teeth."""

    pair: GearPair
    material: Material
    options: MeshOptions
    slices: SliceOptions
    deviation: _Keyed
    hot_teeth: PaperGrowth | None
    force: float
    pinion: _Keyed
    wheel: _Keyed


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Frame:
    """Depths (knot,) m without 0, positions (node,) m, largest gap m; see `ToothTable`."""

    depth: Array
    position: Array
    first_pitch: int
    last_pitch: int
    reach: float
    set_chord: int


def sliced_table(
    pair: GearPair,
    material: Material,
    options: MeshOptions,
    slices: SliceOptions,
    teeth: Mapping[tuple[str, int], Tooth] | None = None,
    *,
    force: float,
    deviation: Array | None = None,
    hot_teeth: PaperGrowth | None = None,
) -> ToothTable:
    """Tabulate the mesh of a pair cut into slices.

    Parameters
    ----------
    teeth : the faulty teeth by (gear, tooth), from ``faulty_teeth``
    force : N    along the transverse line of action; depths reach three times its largest depth
    deviation : (slice, node) m    see ``sliced_mesh``, as for ``hot_teeth``

    Raises
    ------
    ConfigError, GeometryError    for a force that is not positive, or without any contact
    FaultError    for more distinct tooth pairs than can be tabulated
    """
    (pinion, pinion_kind), (wheel, wheel_kind) = (
        distinct_teeth(healthy_tooth(gear), teeth or {}) for gear in pair.gears.values()
    )
    if (n_pairs := len(pinion) * len(wheel)) > MOST_PAIRS:
        raise FaultError(
            f"{len(pinion)} different teeth of the pinion and {len(wheel)} of the wheel make "
            f"{n_pairs} pairs, above {MOST_PAIRS}; put faults that differ from tooth to tooth on "
            "one gear or on fewer teeth"
        )
    setting = _Setting(
        pair=pair,
        material=material,
        options=options,
        slices=slices,
        deviation=_Keyed(key=_digest(deviation), value=deviation),
        hot_teeth=hot_teeth,
        force=force,
        pinion=_keyed(pinion[np.bincount(pinion_kind).argmax()]),
        wheel=_keyed(wheel[np.bincount(wheel_kind).argmax()]),
    )
    frame = _frame(setting)
    first, loads = _all_curves(setting, pinion, wheel, pinion_kind, wheel_kind)
    compliance, gap = _chords(first, loads, frame.depth)
    shared = _mesh(setting, setting.pinion, setting.wheel).shared_compliance
    distance = float(frame.position[1] - frame.position[0])
    columns = _smoothed(compliance + shared, gap, distance)
    return ToothTable(
        pair=pair,
        options=options,
        position=frame.position,
        first_pitch=frame.first_pitch,
        last_pitch=frame.last_pitch,
        depth=np.concatenate([[0.0], frame.depth[:-1]]),
        pinion=_gear_teeth(pinion, pinion_kind),
        wheel=_gear_teeth(wheel, wheel_kind),
        parts=(columns,),
        shared_compliance=shared,
        set_chord=frame.set_chord,
    )


def _gear_teeth(distinct: list[Tooth], kind: Integers) -> GearTeeth:
    present = np.array([tooth.present for tooth in distinct])
    return GearTeeth(kind=kind, present=present)


def _all_curves(
    setting: _Setting,
    pinion: list[Tooth],
    wheel: list[Tooth],
    pinion_kind: Integers,
    wheel_kind: Integers,
) -> tuple[Array, Array]:
    """First gap and force of every tooth pair by kinds, (pinion kind, wheel kind, ...)."""
    frame = _frame(setting)
    first = np.empty((len(pinion), len(wheel), len(frame.position)))
    loads = np.empty((*first.shape, len(frame.depth)))
    # no tooth need be of the sound kind, but the back flanks are healthy
    sound_met = 0 in pinion_kind and 0 in wheel_kind
    first[:], loads[:] = _curves(setting, *_healthy(setting.pair), sound_met)
    for a in np.unique(pinion_kind):
        for b in np.unique(wheel_kind):
            if pinion[a].present and wheel[b].present:
                both = _keyed(pinion[a]), _keyed(wheel[b])
                first[a, b], loads[a, b] = _curves(setting, *both, True)
    return first, loads


def _chords(first: Array, loads: Array, depth: Array) -> tuple[Array, Array]:
    """Compliance less the shared part, and gap: (pinion kind, wheel kind, chord, node) each.

    Parameters
    ----------
    first : (pinion kind, wheel kind, node) m
    loads : (pinion kind, wheel kind, node, knot) N    at the depths
    depth : (knot,) m
    """
    knots = np.concatenate([[0.0], depth])
    forces = np.concatenate([np.zeros((*loads.shape[:3], 1)), loads], axis=3)
    compliance = np.diff(knots) / np.diff(forces, axis=3)
    gap = first[..., None] + knots[:-1] - forces[..., :-1] * compliance
    return np.moveaxis(compliance, 3, 2), np.moveaxis(gap, 3, 2)


def _smoothed(compliance: Array, gap: Array, distance: float) -> TablePart:
    """Compliance and gap with their slopes, smoothed chord by chord."""
    n_nodes, columns = compliance.shape[3], []
    for chord in range(compliance.shape[2]):
        soft = compliance[:, :, chord].reshape(-1, n_nodes)
        far = gap[:, :, chord].reshape(-1, n_nodes)
        limit = SMOOTHED_SHARE * float(soft[0].min())
        columns.append(
            [*smooth(soft, distance, limit), *smooth(far, distance, SMOOTHED_GAP)]
        )
    kinds = compliance.shape[:2]
    stacked = [np.stack(column, axis=1) for column in zip(*columns, strict=True)]
    return TablePart._make(values.reshape(*kinds, -1, n_nodes) for values in stacked)


def _digest(*arrays: Array | None) -> bytes:
    digest = hashlib.sha256()
    for array in arrays:
        if array is not None:
            digest.update(repr(array.shape).encode())
            digest.update(np.ascontiguousarray(array).tobytes())
    return digest.digest()


def _keyed(tooth: Tooth) -> _Keyed:
    arrays = (tooth.slice_edges, tooth.material_loss, tooth.flank_deviation)
    depths = [crack.depth for crack in tooth.cracks]
    cracks = [replace(crack, depth=np.empty(0)) for crack in tooth.cracks]
    numbers = repr((cracks, tooth.present)).encode()
    return _Keyed(key=_digest(*arrays, *depths) + numbers, value=tooth)


def _healthy(pair: GearPair) -> tuple[_Keyed, _Keyed]:
    return _keyed(healthy_tooth(pair.pinion)), _keyed(healthy_tooth(pair.wheel))


@lru_cache(maxsize=8)
def _mesh(setting: _Setting, pinion: _Keyed, wheel: _Keyed) -> SlicedMesh:
    """The sliced mesh of gears whose teeth are all alike."""
    teeth = {}
    for gear, tooth in ((setting.pair.pinion, pinion), (setting.pair.wheel, wheel)):
        if tooth != _keyed(healthy_tooth(gear)):
            for number in range(gear.n_teeth):
                teeth[gear.name, number] = tooth.value
    return sliced_mesh(
        setting.pair,
        setting.material,
        setting.options,
        setting.slices,
        deviation=setting.deviation.value,
        teeth=teeth,
        hot_teeth=setting.hot_teeth,
    )


@lru_cache(maxsize=8)
def _frame(setting: _Setting) -> _Frame:
    """Depths and positions, from the static load of the commonest teeth."""
    pitch, per_pitch = setting.pair.base_pitch, setting.options.points_per_pitch
    mesh = _mesh(setting, setting.pinion, setting.wheel)
    phases = pitch * (np.arange(N_PHASES) + 0.5) / N_PHASES
    contact = loaded_contact(mesh, phases, setting.force)
    highest = math.ceil(float(mesh.position[-1] + mesh.lag[-1]) / pitch)
    nodes = np.arange(FIRST_PITCH * per_pitch, highest * per_pitch + 1)
    position = nodes * pitch / per_pitch
    first = _at(mesh, position)[1].min(axis=1)
    sound = _at(_mesh(setting, *_healthy(setting.pair)), position)[1].min(axis=1)
    static = contact.approach - mesh.shared_compliance * setting.force - first.min()
    set_depth, deepest = float(static.mean()), DEEPEST * float(static.max())
    near = nodes[sound <= sound.min() + max(LEAST_REACH, deepest)]
    first_pitch = math.floor(near[0] / per_pitch)
    last_pitch = math.ceil(near[-1] / per_pitch)
    table_nodes = np.arange(first_pitch * per_pitch, last_pitch * per_pitch + 1)
    depth = np.array([set_depth])
    if setting.options.law != "paper":
        sample = position[first <= first.min() + deepest]
        sample = sample[:: max(1, len(sample) // N_SAMPLES)]
        tried = np.linspace(0.0, deepest, N_TRIED + 1)[1:]
        depth = _knots(setting, mesh, sample, tried)
    return _Frame(
        depth=depth,
        position=pitch / per_pitch * table_nodes,
        first_pitch=first_pitch,
        last_pitch=last_pitch,
        reach=float(first.min()) + max(LEAST_REACH, deepest),
        set_chord=min(int(np.searchsorted(depth, set_depth)), len(depth) - 1),
    )


def _knots(setting: _Setting, mesh: SlicedMesh, position: Array, tried: Array) -> Array:
    """The ``N_CHORDS`` of the depths ``tried`` whose chords have the least error.

    The last depth is always chosen. The error is the largest over the positions, minimised by
    dynamic programming. ``tried`` (knot,) m.
    """
    _, loads = _forces(setting, mesh, position, tried, np.inf)
    depth = np.append(0.0, tried)
    force = np.column_stack([np.zeros(len(position)), loads])
    n_tried = len(depth)
    error = np.full((n_tried, n_tried), np.inf)
    for begin in range(n_tried - 1):
        for end in range(begin + 1, n_tried):
            span = slice(begin, end + 1)
            part = (depth[span] - depth[begin]) / (depth[end] - depth[begin])
            low = force[:, begin, None]
            chord = low + (force[:, end, None] - low) * part
            error[begin, end] = np.abs(chord - force[:, span]).max()
    least, before = error[0], []
    for _ in range(N_CHORDS - 1):
        worst = np.maximum(least[:, None], error)
        before.append(worst.argmin(axis=0))
        least = worst.min(axis=0)
    chosen = [n_tried - 1]
    for way in reversed(before):
        chosen.append(int(way[chosen[-1]]))
    return depth[chosen[::-1]]


def _at(mesh: SlicedMesh, position: Array) -> tuple[Array, Array, Array, Array]:
    """Structure, gap, contact constant and width of every slice of a tooth pair of ``_mesh``.

    (node, slice) each, with the first slice at ``position``.
    """
    at_slices = position[:, None] - mesh.lag
    share = np.ones_like(at_slices)
    if mesh.options.law == "paper":
        at_slices, share = cut_by_field(mesh, at_slices)
    structure = np.interp(at_slices, mesh.position, mesh.structure)
    gap = np.empty_like(at_slices)
    gaps = mesh.gap + mesh.pinion.gap[-1] + mesh.wheel.gap[-1]
    softer = mesh.pinion.softening[-1] + mesh.wheel.softening[-1]
    is_softer = bool(softer.any())
    for j, at_slice in enumerate(at_slices.T):
        gap[:, j] = np.interp(at_slice, mesh.position, gaps[j])
        if is_softer:
            structure[:, j] += np.interp(at_slice, mesh.position, softer[j])
    constant = np.interp(at_slices, mesh.position, mesh.contact_constant)
    return structure, gap, constant, share * mesh.slice_width


def _forces(
    setting: _Setting, mesh: SlicedMesh, position: Array, depth: Array, reach: float
) -> tuple[Array, Array]:
    """First gap (node,) m, and force (node, knot) N at depths beyond it; 0 beyond ``reach``."""
    structure, gap, constant, width = _at(mesh, position)
    first, force = np.empty(len(position)), np.empty((len(position), len(depth)))
    n_unsettled = bite_forces(
        structure,
        mesh.contact_factor,
        constant,
        mesh.log_weight,
        np.where(gap < 0.1 * NO_FLANK, gap, np.inf),
        width,
        mesh.slice_width,
        mesh.coupling_length_squared,
        setting.force / setting.pair.face_width,
        depth,
        reach,
        first,
        force,
    )
    if n_unsettled:
        raise GeometryError(
            f"the bearing slices of a pair of teeth never settle at {n_unsettled} positions and "
            "depths"
        )
    return first, force


@lru_cache(maxsize=128)
def _curves(
    setting: _Setting, pinion: _Keyed, wheel: _Keyed, are_met: bool
) -> tuple[Array, Array]:
    """First gap (node,) m and force (node, knot) N of one tooth pair at the frame's depths."""
    frame, mesh = _frame(setting), _mesh(setting, pinion, wheel)
    sample, n_per_slice = _sample(setting, frame.position, mesh, are_met)
    first, force = _forces(setting, mesh, sample, frame.depth, frame.reach)
    if n_per_slice:
        first, force = over_slice(first, force, frame.depth, n_per_slice, FARTHEST)
        sample = sample[n_per_slice // 2 : n_per_slice // 2 + len(first)]
    within = np.flatnonzero(first <= frame.reach)
    if not len(within):  # no flank is left: sound forces out of reach
        _, force = _curves(setting, *_healthy(setting.pair), False)
        return np.full(len(frame.position), FARTHEST), force
    if setting.options.law == "paper":
        first, force = np.zeros_like(first), np.maximum(force, force.max() / OFF_PATH)
    else:  # beyond reach, the forces of the nearest position within
        between = 0.5 * (within[1:] + within[:-1])
        nearest = np.searchsorted(between, np.arange(len(first)))
        first, force = np.minimum(first, FARTHEST), force[within[nearest]]
    if sample is not frame.position:
        columns = [np.interp(frame.position, sample, column) for column in force.T]
        force = np.stack(columns, axis=1)
        first = np.interp(frame.position, sample, first)
    return first, force


def _sample(
    setting: _Setting, position: Array, mesh: SlicedMesh, are_met: bool
) -> tuple[Array, int]:
    """Positions at which a tooth pair is computed, m, and their number per slice of lag.

    The number is even where slices enter one by one, else 0.
    """
    is_cut = setting.options.law == "paper"  # the edge of the field cuts slices
    if is_cut or not mesh.lag[-1] > 0.0:
        if are_met:
            return position, 0
        return np.append(position[:-1:UNMET_STEP], position[-1]), 0
    n_slices, pair = setting.slices.n_slices, setting.pair
    lag = float(pair.face_width * math.tan(pair.base_helix_angle)) / n_slices
    node = position[1] - position[0]
    step = UNMET_STEP * node
    if are_met:
        step = min(lag / PER_SLICE, n_slices / SLICES_PER_STEP * node)
    n_half = max(1, round(0.5 * lag / max(step, node)))
    distance = lag / (2 * n_half)
    n_steps = math.ceil((position[-1] - position[0]) / distance)
    steps = np.arange(-n_half, n_steps + n_half + 1)
    return position[0] + distance * steps, 2 * n_half
