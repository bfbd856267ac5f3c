"""Force over (phase, approach) of one pair of helical teeth, for every distinct pair of teeth, as
the dynamics asks it.

The force of a pair in slices is convex in the approach: the deeper it bites, the more slices
bear. It is kept as chords between fixed depths of bite, so that each is a compliance and a gap
like that of a spur pair, and the law of the mesh is one for both.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

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

Array = NDArray[np.float64]

N_CHORDS = 8
N_TRIED, N_SAMPLES = 32, 24  # depths and positions at which chords are chosen
PER_SLICE = 4  # positions looked at from one slice's entry to the next one's
SLICES_PER_STEP = 10  # few slices enter with a jolt: every node is looked at
UNMET_STEP = 8  # nodes between the positions looked at for teeth that never meet on their working flanks
DEEPEST = 3.0  # largest depth, in largest static ones
LEAST_REACH = 1e-4  # m; first gaps up to here are tabulated, so that teeth that stand proud find their force
FARTHEST = 1e-3  # m; first gaps beyond are all alike
N_PHASES = 32
MOST_PAIRS = 400  # of different teeth, about a tenth of a second and 0.8 MB each
OFF_PATH = 1e3  # times the least compliance, where mesh.law=paper has no contact


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SlicedTable:
    """Chords of the force of single pairs at positions s of the slice that enters first.

    Chord l of a pair that is alone is force = (approach - gap[l]) / compliance[l]. Beside others,
    as for spur pairs, force = (within - gap[l]) / (compliance[l] - shared_compliance), ``within``
    being the approach less shared_compliance x total force. It holds where within - gap[0] lies
    between depth[l] and depth[l + 1], the last one beyond; gap[0] is where the pair touches
    first. Neighbours meet at their common depth, and as the force is convex it is that of the
    chord that has the largest.

    Parameters
    ----------
    position : (node,) m      equally spaced, ``points_per_pitch`` a base pitch, from ``first_pitch`` to ``last_pitch``
    first_pitch, last_pitch : whole base pitches; pairs followed at once are last_pitch - first_pitch
    depth : (chord,) m        from 0 on
    compliance, compliance_slope, gap, gap_slope : (pinion kind, wheel kind, chord, node) m/N, 1/N, m, 1
    pinion_kind, wheel_kind : (tooth,)    which kind every tooth is; 0 is sound
    pinion_present, wheel_present : (kind,)
    shared_compliance : m/N   of the bodies, that all pairs share
    set_chord : chord of the set torque's mean load, for what asks for one spring
    middle_lag : m            how much further along its way the first slice is than the middle of the face: what grows
        with the contact's position (tilts of single teeth, sliding) does so with position - middle_lag
    """

    pair: GearPair
    options: MeshOptions
    position: Array
    first_pitch: int
    last_pitch: int
    depth: Array
    compliance: Array
    compliance_slope: Array
    gap: Array
    gap_slope: Array
    pinion_kind: NDArray[np.int64]
    wheel_kind: NDArray[np.int64]
    pinion_present: NDArray[np.bool_]
    wheel_present: NDArray[np.bool_]
    shared_compliance: float
    set_chord: int
    middle_lag: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Known:
    """Something large that is told apart by what it holds."""

    key: bytes
    value: Tooth | NDArray[np.float64] | None = field(compare=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Setting:
    """What all pairs of one table have in common.

    ``pinion`` and ``wheel`` are the teeth that meet most.
    """

    pair: GearPair
    material: Material
    options: MeshOptions
    slices: SliceOptions
    deviation: _Known
    force: float
    pinion: _Known
    wheel: _Known


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Frame:
    """Depths of bite (knot,) m, 0 left out.

    Positions (node,) m; how far gaps are followed, m; see `SlicedTable`.
    """

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
) -> SlicedTable:
    """Tabulate the mesh of a pair cut into slices.

    Parameters
    ----------
    teeth : the teeth that are not sound, by (gear, tooth), as ``faulty_teeth`` gives them
    force : N    along the transverse line of action; the depths reach three times its deepest bite
    deviation : (slice, node) m    see ``sliced_mesh``

    Raises
    ------
    ConfigError, GeometryError    for a force that is not positive, or where nothing can touch
    FaultError    for more different pairs of teeth than can be tabulated
    """
    odd = dict(teeth or {})
    (pinion, pinion_kind), (wheel, wheel_kind) = (
        distinct_teeth(
            healthy_tooth(gear),
            {
                number: odd[name, number]
                for name, number in sorted(odd)
                if name == gear.name
            },
        )
        for gear in (pair.pinion, pair.wheel)
    )
    if (n_pairs := len(pinion) * len(wheel)) > MOST_PAIRS:
        raise FaultError(
            f"{len(pinion)} different teeth of the pinion and {len(wheel)} of the wheel make {n_pairs} pairs, above "
            f"{MOST_PAIRS}; put faults that differ from tooth to tooth on one gear or on fewer teeth"
        )
    setting = _Setting(
        pair=pair,
        material=material,
        options=options,
        slices=slices,
        deviation=_Known(key=_digest(deviation), value=deviation),
        force=force,
        pinion=_known(pinion[np.bincount(pinion_kind).argmax()]),
        wheel=_known(wheel[np.bincount(wheel_kind).argmax()]),
    )
    frame = _frame(setting)
    first = np.empty((len(pinion), len(wheel), len(frame.position)))
    loads = np.empty((*first.shape, len(frame.depth)))
    met = set(pinion_kind.tolist()), set(wheel_kind.tolist())
    # where all teeth have a common form the sound one is met by nobody, but the back flanks are
    # sound
    healthy = _curves(setting, *_healthy(pair), 0 in met[0] and 0 in met[1])
    for a, one in enumerate(pinion):
        for b, other in enumerate(wheel):
            asked = a in met[0] and b in met[1] and one.present and other.present
            first[a, b], loads[a, b] = (
                _curves(setting, _known(one), _known(other), True) if asked else healthy
            )
    compliance, gap = _chords(first, loads, frame.depth)
    mesh = _mesh(setting, setting.pinion, setting.wheel)
    shared = mesh.shared_compliance
    columns = _smoothed(
        compliance + shared, gap, float(frame.position[1] - frame.position[0])
    )
    return SlicedTable(
        pair=pair,
        options=options,
        position=frame.position,
        first_pitch=frame.first_pitch,
        last_pitch=frame.last_pitch,
        depth=np.concatenate([[0.0], frame.depth[:-1]]),
        compliance=columns[0],
        compliance_slope=columns[1],
        gap=columns[2],
        gap_slope=columns[3],
        pinion_kind=pinion_kind,
        wheel_kind=wheel_kind,
        pinion_present=np.array([tooth.present for tooth in pinion]),
        wheel_present=np.array([tooth.present for tooth in wheel]),
        shared_compliance=shared,
        set_chord=frame.set_chord,
        middle_lag=0.5 * float(mesh.lag[0] + mesh.lag[-1]),
    )


def _chords(first: Array, loads: Array, depth: Array) -> tuple[Array, Array]:
    """Compliance less what pairs share and gap of the chords, (pinion kind, wheel kind, chord,
    node) each.

    Parameters
    ----------
    first : (pinion kind, wheel kind, node) m
    loads : (pinion kind, wheel kind, node, knot) N    at the depths
    depth : (knot,) m
    """
    knots = np.concatenate([[0.0], depth])
    begun = np.concatenate([np.zeros((*loads.shape[:3], 1)), loads], axis=3)
    compliance = np.diff(knots) / np.diff(begun, axis=3)
    gap = first[..., None] + knots[:-1] - begun[..., :-1] * compliance
    return np.moveaxis(compliance, 3, 2), np.moveaxis(gap, 3, 2)


def _smoothed(compliance: Array, gap: Array, distance: float) -> list[Array]:
    """Compliance and gap, each with its slope, chord by chord as ``smooth`` has it."""
    columns = [np.empty_like(compliance) for _ in range(4)]
    for chord in range(compliance.shape[2]):
        soft, far = (
            values[:, :, chord].reshape(-1, values.shape[3])
            for values in (compliance, gap)
        )
        found = (
            *smooth(soft, distance, SMOOTHED_SHARE * float(soft[0].min())),
            *smooth(far, distance, SMOOTHED_GAP),
        )
        for column, values in zip(columns, found, strict=True):
            column[:, :, chord] = values.reshape(column[:, :, chord].shape)
    return columns


def _digest(*arrays: Array | None) -> bytes:
    found = hashlib.sha256()
    for array in arrays:
        found.update(
            b"none"
            if array is None
            else repr(array.shape).encode() + np.ascontiguousarray(array).tobytes()
        )
    return found.digest()


def _known(tooth: Tooth) -> _Known:
    cracks = [
        repr(replace(crack, depth=np.empty(0))).encode() + _digest(crack.depth)
        for crack in tooth.cracks
    ]
    arrays = (tooth.slice_edges, tooth.material_loss, tooth.flank_deviation)
    return _Known(
        key=b"".join([_digest(*arrays), *cracks, bytes([tooth.present])]), value=tooth
    )


def _healthy(pair: GearPair) -> tuple[_Known, _Known]:
    return _known(healthy_tooth(pair.pinion)), _known(healthy_tooth(pair.wheel))


@lru_cache(maxsize=8)
def _mesh(setting: _Setting, pinion: _Known, wheel: _Known) -> SlicedMesh:
    """The pair whose teeth are all the same two."""
    deviation, odd = setting.deviation.value, {}
    for gear, known in ((setting.pair.pinion, pinion), (setting.pair.wheel, wheel)):
        assert isinstance(known.value, Tooth)
        if known.key != _known(healthy_tooth(gear)).key:
            odd.update(
                {(gear.name, number): known.value for number in range(gear.n_teeth)}
            )
    assert not isinstance(deviation, Tooth)
    return sliced_mesh(
        setting.pair,
        setting.material,
        setting.options,
        setting.slices,
        deviation=deviation,
        teeth=odd,
    )


@lru_cache(maxsize=8)
def _frame(setting: _Setting) -> _Frame:
    """Depths and positions, from the static load of the teeth that meet most."""
    mesh, pitch = _mesh(setting, setting.pinion, setting.wheel), setting.pair.base_pitch
    contact = loaded_contact(
        mesh, pitch * (np.arange(N_PHASES) + 0.5) / N_PHASES, setting.force
    )
    per_pitch = setting.options.points_per_pitch
    highest = math.ceil(float(mesh.position[-1] + mesh.lag[-1]) / pitch)
    nodes = np.arange(FIRST_PITCH * per_pitch, highest * per_pitch + 1)
    first = _at(mesh, nodes * pitch / per_pitch)[1].min(axis=1)
    sound = _at(_mesh(setting, *_healthy(setting.pair)), nodes * pitch / per_pitch)[
        1
    ].min(axis=1)
    bite = contact.approach - mesh.shared_compliance * setting.force - first.min()
    set_depth, deepest = float(bite.mean()), DEEPEST * float(bite.max())
    near = nodes[sound <= sound.min() + max(LEAST_REACH, deepest)]
    first_pitch, last_pitch = (
        math.floor(near[0] / per_pitch),
        math.ceil(near[-1] / per_pitch),
    )
    depth = np.array([set_depth])
    if setting.options.law != "paper":
        sample = nodes[first <= first.min() + deepest]
        sample = sample[:: max(1, len(sample) // N_SAMPLES)] * pitch / per_pitch
        depth = _knots(
            setting, mesh, sample, np.linspace(0.0, deepest, N_TRIED + 1)[1:]
        )
    return _Frame(
        depth=depth,
        position=pitch
        / per_pitch
        * np.arange(first_pitch * per_pitch, last_pitch * per_pitch + 1),
        first_pitch=first_pitch,
        last_pitch=last_pitch,
        reach=float(first.min()) + max(LEAST_REACH, deepest),
        set_chord=min(int(np.searchsorted(depth, set_depth)), len(depth) - 1),
    )


def _knots(setting: _Setting, mesh: SlicedMesh, position: Array, tried: Array) -> Array:
    """The ``N_CHORDS`` of the depths ``tried``, the last among them, whose chords err least, by
    dynamic programming.

    The largest error over the positions counts. ``tried`` (knot,) m.
    """
    _, force = _bitten(setting, mesh, position, tried, np.inf)
    depth, force = (
        np.append(0.0, tried),
        np.column_stack([np.zeros(len(position)), force]),
    )
    n_tried = len(depth)
    error = np.full((n_tried, n_tried), np.inf)
    for begin in range(n_tried - 1):
        for end in range(begin + 1, n_tried):
            part = (depth[begin : end + 1] - depth[begin]) / (depth[end] - depth[begin])
            chord = (
                force[:, begin, None]
                + (force[:, end] - force[:, begin])[:, None] * part
            )
            error[begin, end] = np.abs(chord - force[:, begin : end + 1]).max()
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
    """Structure, gap, constant of the contact and width of every slice of two teeth of ``_mesh``
    where the first slice is at ``position``, (node, slice) each."""
    places = position[:, None] - mesh.lag
    share = np.ones_like(places)
    if mesh.options.law == "paper":
        places, share = cut_by_field(mesh, places)
    structure = np.interp(places, mesh.position, mesh.structure)
    gap = np.empty_like(places)
    gaps = mesh.gap + mesh.pinion.gap[-1] + mesh.wheel.gap[-1]
    softer = mesh.pinion.softening[-1] + mesh.wheel.softening[-1]
    is_softer = bool(softer.any())
    for j in range(places.shape[1]):
        gap[:, j] = np.interp(places[:, j], mesh.position, gaps[j])
        if is_softer:
            structure[:, j] += np.interp(places[:, j], mesh.position, softer[j])
    constant = np.interp(places, mesh.position, mesh.contact_constant)
    return structure, gap, constant, share * mesh.slice_width


def _bitten(
    setting: _Setting, mesh: SlicedMesh, position: Array, depth: Array, reach: float
) -> tuple[Array, Array]:
    """First gap (node,) m, and force (node, knot) N at depths beyond it, 0 where it is beyond
    ``reach``.
    """
    structure, gap, constant, width = _at(mesh, position)
    first, force = np.empty(len(position)), np.empty((len(position), len(depth)))
    n_unsettled = bite_forces(
        structure, mesh.contact_factor, constant, mesh.log_weight, np.where(gap < 0.1 * NO_FLANK, gap, np.inf), width,
        mesh.slice_width, mesh.coupling_length_squared, setting.force / setting.pair.face_width, depth, reach, first,
        force,
    )  # fmt: skip
    if n_unsettled:
        raise GeometryError(
            f"the bearing slices of a pair of teeth never settle at {n_unsettled} positions and depths"
        )
    return first, force


@lru_cache(maxsize=128)
def _curves(
    setting: _Setting, pinion: _Known, wheel: _Known, are_met: bool
) -> tuple[Array, Array]:
    """First gap (node,) m and force (node, knot) N of one pair of teeth at the depths of the
    frame.
    """
    frame, mesh = _frame(setting), _mesh(setting, pinion, wheel)
    looked, n_looks = _looked(setting, frame.position, mesh, are_met)
    first, force = _bitten(setting, mesh, looked, frame.depth, frame.reach)
    if n_looks:
        first, force = over_slice(first, force, frame.depth, n_looks, FARTHEST)
        looked = looked[n_looks // 2 : n_looks // 2 + len(first)]
    found = np.flatnonzero(first <= frame.reach)
    if not len(found):  # no flank is left to touch: what is sound, out of reach
        return np.full(len(frame.position), FARTHEST), _curves(
            setting, *_healthy(setting.pair), False
        )[1]
    if setting.options.law == "paper":
        first, force = np.zeros_like(first), np.maximum(force, force.max() / OFF_PATH)
    else:  # beyond reach, the forces of the nearest position within
        nearest = np.searchsorted(0.5 * (found[1:] + found[:-1]), np.arange(len(first)))
        first, force = np.minimum(first, FARTHEST), force[found[nearest]]
    if len(looked) != len(frame.position) or n_looks:
        force = np.stack(
            [np.interp(frame.position, looked, column) for column in force.T], axis=1
        )
        first = np.interp(frame.position, looked, first)
    return first, force


def _looked(
    setting: _Setting, position: Array, mesh: SlicedMesh, are_met: bool
) -> tuple[Array, int]:
    """Positions at which two teeth are looked at, m, and, where slices enter one by one, how many
    of their distances make the way from one slice to the next, an even number; else 0."""
    node = position[1] - position[0]
    if (
        not mesh.lag[-1] > 0.0 or setting.options.law == "paper"
    ):  # whose slices the edge of the field cuts
        return (
            position if are_met else np.append(position[:-1:UNMET_STEP], position[-1])
        ), 0
    n_slices = setting.slices.n_slices
    later = (
        float(setting.pair.face_width * math.tan(setting.pair.base_helix_angle))
        / n_slices
    )
    apart = (
        min(later / PER_SLICE, n_slices / SLICES_PER_STEP * node)
        if are_met
        else UNMET_STEP * node
    )
    n_looks = 2 * max(1, round(0.5 * later / max(apart, node)))
    n_beside, distance = n_looks // 2, later / n_looks
    n_steps = math.ceil((position[-1] - position[0]) / distance)
    return position[0] + distance * np.arange(
        -n_beside, n_steps + n_beside + 1
    ), n_looks
