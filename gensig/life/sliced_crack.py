"""Root cracks that grow in teeth cut into slices: the Paris law under the loads of the slices."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from gensig.arrays import Array
from gensig.faults.base import Fault
from gensig.faults.crack import N_STRIPS, Crack
from gensig.geometry.contact import GearPair
from gensig.life.crack_growth import (
    CrackGrowth,
    CrackGrowthOptions,
    crack_depths,
    crack_widths,
    require_open,
)
from gensig.material import Material
from gensig.mesh.sliced.slice_energy import structure_energy
from gensig.mesh.sliced.slices import SlicedMesh, contact_phases, settled_contact

MeshOf = Callable[[Sequence[Fault]], SlicedMesh]

DEPTH_STEP = 10  # nodes of the law between two depths at which the mesh is solved
N_PHASES = 16  # a base pitch, of the first look
N_CLOSER = 16  # between the neighbours of the greatest of them
# base pitches before the next pair enters, and after one has left: there the others carry most
JUST = 1e-9
# of the depth, on either side, over which the energy is differentiated
DEPTH_SHARE = 1e-3
WIDTH_STRIPS = 2  # of the crack's front, on either side, the same over the width


def sliced_crack_growth(
    pair: GearPair,
    material: Material,
    mesh_of: MeshOf,
    crack: Crack,
    options: CrackGrowthOptions,
    torques: Array,
) -> CrackGrowth:
    """Growth law of a crack like ``crack`` in a pair cut into slices.

    Depth, width and front of ``crack`` are not used.

    Parameters
    ----------
    mesh_of : the pair with faults; its cracks are the calibrated ones, beyond the checked range too
    torques : (torque,) N m    of the pinion, ascending, where the mesh is solved: the load
        sharing depends on them

    Energy release rate at constant load G = dU / dA as in ``crack_growth``, with the loads of all
    slices from the equilibrium of the mesh with the crack in it. Every equilibrium is the least
    complementary energy. So a change of the crack changes that energy at first order only by what
    the same loads on the changed structure hold (envelope theorem): the derivative of the
    structure's energy at those loads. It is the mean over the crack's front. The greatest over
    the engagement of the tooth counts.

    Raises
    ------
    ConfigError    for a crack on the compressed side, or a width that is not evaluated
    """
    require_open(crack)
    gear = pair.gears[crack.gear]
    sizes, face = crack_depths(options, crack.root_chord(gear)), gear.face_width
    looked = sizes[::DEPTH_STEP]

    def cut(depth: float, width: float) -> SlicedMesh:
        part = None
        if width < face:
            part = width
        given = replace(
            crack, tooth=0, crack_depth=depth, crack_width=part, crack_front="straight"
        )
        return mesh_of((given,))

    def rates(depth: float, width: float) -> Array:
        """Greatest release rate over the depth, and over the width, (torque, 2) N/m."""
        deeper = [
            cut(depth * (1.0 + step), width) for step in (-DEPTH_SHARE, DEPTH_SHARE)
        ]
        spans = [(deeper, 2.0 * DEPTH_SHARE * depth * width)]
        if width < face:
            step = WIDTH_STRIPS / N_STRIPS * face
            narrow, wide = width - step, min(width + step, face)
            wider = [cut(depth, narrow), cut(depth, wide)]
            spans.append((wider, (wide - narrow) * depth))
        mesh = cut(depth, width)
        forces = [torque / pair.pinion.base_radius for torque in torques]
        return np.array([_greatest(mesh, crack.gear, spans, force) for force in forces])

    width, release = _followed(looked, face, options, rates)
    greatest = np.array([_smooth(looked, column, sizes) for column in release.T])
    strain = material.in_plane("plane_strain")
    intensity = np.sqrt(np.maximum(greatest, 0.0) * strain.youngs_modulus)
    return CrackGrowth(
        options=options,
        crack=crack,
        sizes=sizes,
        width=_smooth(looked, width, sizes),
        torques=torques,
        intensity=intensity / torques[:, None],
        face_width=face,
        meshes=pair.speed_ratio(crack.gear),
    )


def _greatest(
    mesh: SlicedMesh,
    gear: str,
    spans: Sequence[tuple[Sequence[SlicedMesh], float]],
    force: float,
) -> list[float]:
    """Greatest release rates over the engagement of the cracked pair, (span,) N/m.

    ``force`` in N; ``spans`` are meshes with a little less and a little more crack, and the area
    between them in m2.
    """
    pitch = mesh.pair.base_pitch

    def released(roll: Array, ends: Sequence[SlicedMesh], area: float) -> Array:
        """Release rate phase by phase, (phase,) N/m."""
        phases = contact_phases(mesh, roll)
        contact = settled_contact(phases, force)
        cracked = (np.arange(len(roll)), np.argmax(phases.pair_index == 0, axis=1))
        load, position = contact.line_load[cracked], phases.position[cracked]
        rest = phases.structure[cracked] - _softening(mesh, gear, position)
        less, more = (
            structure_energy(
                rest + _softening(end, gear, position),
                load,
                mesh.slice_width,
                mesh.coupling_length_squared,
            )
            for end in ends
        )
        return (more - less) / area

    reach = mesh.pair.path_of_contact + float(mesh.lag[-1])
    n_pitches = math.ceil(reach / pitch)
    entered = pitch * ((np.arange(n_pitches * N_PHASES) + 1.0) / N_PHASES - JUST)
    left = reach - pitch * (np.arange(n_pitches) - JUST)
    coarse = np.concatenate([entered, left])
    greatest = []
    for ends, area in spans:
        rate = released(coarse, ends, area)
        peak = coarse[int(rate.argmax())]
        near = peak + pitch / N_PHASES * (np.arange(1 - N_CLOSER, N_CLOSER) / N_CLOSER)
        closer = released(near, ends, area)
        greatest.append(max(float(rate.max()), float(closer.max()), 0.0))
    return greatest


def _softening(mesh: SlicedMesh, gear: str, position: Array) -> Array:
    """Added compliance of the crack, (phase, slice) m2/N."""
    softening = mesh.sides[gear].softening[-1]
    columns = zip(position.T, softening, strict=True)
    return np.stack([np.interp(at, mesh.position, row) for at, row in columns], axis=1)


def _smooth(looked: Array, values: Array, sizes: Array) -> Array:
    """Values at all sizes from those at some, (node,)."""
    from scipy.interpolate import PchipInterpolator

    return np.asarray(PchipInterpolator(np.log(looked), values)(np.log(sizes)))


def _followed(
    depths: Array,
    face: float,
    options: CrackGrowthOptions,
    rates: Callable[[float, float], Array],
) -> tuple[Array, Array]:
    """Width of each depth at the middle torque, (depth,) m, and release rates, (depth, torque) N/m.

    From depth to depth by the two-step method of Adams and Bashforth over the depth's logarithm.
    """
    width, release = np.full(len(depths), options.width_share * face), []
    if options.width_share < 1.0:
        crack_widths(face, options)  # refuses the narrowest
    steps = np.diff(np.log(depths), append=0.0)
    last = 0.0
    for k, depth in enumerate(depths.tolist()):
        now = float(width[k])
        both = rates(depth, now)
        release.append(both[:, 0])
        if now >= face:
            width[k:] = face
            continue
        by_depth, by_width = both[len(both) // 2]
        wider = 0.0
        if by_depth > 0.0:
            wider = depth * (by_width / by_depth) ** (0.5 * options.exponent)
        pace = wider
        if k > 0:
            pace = wider + 0.5 * steps[k] / steps[k - 1] * (wider - last)
        width[k + 1 :] = min(now + pace * float(steps[k]), face)
        last = wider
    return width, np.array(release)
