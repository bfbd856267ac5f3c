"""Compliance and stiffness of the mesh, by the names that the rows use."""

from __future__ import annotations

from functools import lru_cache, partial

import numpy as np

from gensig.dynamics.pair import solid_disc
from gensig.faults.base import faulty_teeth
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth, healthy_tooth
from gensig.geometry.tooth_profile import load_angle
from gensig.material import Material
from gensig.mesh.body_coupling import cross_compliance
from gensig.mesh.compliance import tooth_compliance
from gensig.mesh.fillet_foundation import body_coefficients, fillet_foundation_compliance
from gensig.mesh.load_distribution import pair_states, static_mesh
from gensig.mesh.local_contact import linear_contact
from gensig.mesh.pair_table import pair_compliance, structural_compliance
from gensig.validation.case import Array, Case, read_case, with_fault
from gensig.validation.geometry_checks import Check
from gensig.validation.rows import printed_value
from gensig.validation.straight_root import straight_root_tooth

N_MEAN = 4000  # points of a mean over a zone


@lru_cache(maxsize=8)
def _sound_tooth(gear: Gear) -> Tooth:
    return healthy_tooth(gear)


@lru_cache(maxsize=8)
def _straight_tooth(gear: Gear) -> Tooth:
    return straight_root_tooth(gear)


def _load_angle(side: str, case: Case, at: str) -> float:
    return float(load_angle(case.gear(side), case.curvature(side, at))[0])


def _term(side: str, name: str, case: Case, at: str) -> float:
    """One compliance term of a sound tooth at a named point."""
    gear = case.gear(side)
    if name == "foundation":
        angle = load_angle(gear, case.curvature(side, at))
        return float(fillet_foundation_compliance(gear, angle, case.system.material, allow_extrapolation=False)[0])
    parts = tooth_compliance(_sound_tooth(gear), case.curvature(side, at), case.system.material)
    return float(getattr(parts, name)[0])


def _tooth(side: str, root: str, case: Case, at: str) -> float:
    """Bending, shear and axial compliance together, with the true root curve or the straight one."""
    tooth = (_straight_tooth if root == "straight" else _sound_tooth)(case.gear(side))
    return float(tooth_compliance(tooth, case.curvature(side, at), case.system.material).total[0])


def _structural(side: str, case: Case, at: str) -> float:
    tooth = _sound_tooth(case.gear(side))
    return float(structural_compliance(tooth, case.curvature(side, at), case.system.material, case.system.mesh)[0])


def _body_coefficient(side: str, case: Case, at: str) -> float:
    return body_coefficients(case.gear(side), allow_extrapolation=False)[at]


def _contact(case: Case, at: str) -> float:
    law = linear_contact(np.zeros(1), case.system.material)
    return float(law.compliance(case.pair.pinion.face_width, 1.0)[0])


def _pair_stiffness(case: Case, position: Array) -> Array:
    if not all(tooth.present for tooth in faulty_teeth(case.pair, case.faults).values()):
        return np.zeros_like(position)
    return 1.0 / pair_compliance(case.table, position, **case.faulty_kinds)


def single_pair_stiffness(case: Case, at: str) -> float:
    """Stiffness of one pair, faulty where the case has a fault, at a named point, N/m."""
    return float(_pair_stiffness(case, np.array([case.position(at)]))[0])


def _mean_stiffness(case: Case, at: str) -> float:
    """Mean over a cycle, the single or the double zone, of a train of pairs that are all alike."""
    pair = case.pair
    pitch, path = pair.base_pitch, pair.path_of_contact
    share = (np.arange(N_MEAN) + 0.5) / N_MEAN
    if at == "cycle":
        return float(_pair_stiffness(case, share * path).mean()) * path / pitch
    if at == "single":
        return float(_pair_stiffness(case, path - pitch + share * (2.0 * pitch - path)).mean())
    entering = share * (path - pitch)
    return float((_pair_stiffness(case, entering) + _pair_stiffness(case, entering + pitch)).mean())


def mesh_stiffness(case: Case, roll: Array) -> Array:
    """Tangent stiffness of all pairs under the set torque, (phase,) N/m."""
    force = case.system.operating.torque / case.pair.pinion.base_radius
    return static_mesh(case.table, pair_states(case.table, roll), force).stiffness


def _mesh_stiffness_at(case: Case, at: str) -> float:
    """At a roll in base pitches from the entry of a pair at A."""
    return float(mesh_stiffness(case, np.array([float(at) * case.pair.base_pitch]))[0])


def _double_zone_stiffness(case: Case, at: str) -> float:
    """At a share of the double zone, its ends taken just inside, or its largest value."""
    zone = case.pair.path_of_contact - case.pair.base_pitch
    if at == "max":
        return float(mesh_stiffness(case, np.linspace(0.001, 0.999, 999) * zone).max())
    return float(mesh_stiffness(case, np.array([np.clip(float(at), 1e-9, 1.0 - 1e-9) * zone]))[0])


def _stiffness_harmonic(case: Case, at: str) -> float:
    """Amplitude of a mesh harmonic of the stiffness over its mean."""
    stiffness = mesh_stiffness(case, case.pair.base_pitch * (np.arange(8192) + 0.5) / 8192)
    spectrum = np.abs(np.fft.rfft(stiffness))
    return float(2.0 * spectrum[int(at)] / spectrum[0])


def _cross(side: str, case: Case, at: str) -> float:
    """Body compliance between two pairs; ``at`` is the entering pair's distance from A in mm, or ``mid`` zone."""
    pair = case.pair
    zone = pair.path_of_contact - pair.base_pitch
    entering = np.array([0.5 * zone if at == "mid" else float(at) * 1e-3])
    return float(_cross_at(pair, case.system.material, side, entering)[0])


def _cross_at(pair: GearPair, material: Material, side: str, entering: Array) -> Array:
    gear = pair.pinion if side == "pinion" else pair.wheel
    curvature = pair.pinion_curvature if side == "pinion" else pair.wheel_curvature
    angles = [load_angle(gear, np.asarray(curvature(entering + shift))) for shift in (0.0, pair.base_pitch)]
    return cross_compliance(gear, material, angles[0], angles[1], pitches=1 if side == "pinion" else -1)


def _fault_increment(case: Case, at: str) -> float:
    """What the fault adds to the compliance of its tooth."""
    fault = case.faults[0]
    tooth = faulty_teeth(case.pair, case.faults)[fault.gear, fault.teeth(case.gear(fault.gear))[0]]
    curvature = case.curvature(fault.gear, at)
    faulty = structural_compliance(tooth, curvature, case.system.material, case.system.mesh)
    return float(faulty[0]) - _structural(fault.gear, case, at)


def stiffness_loss(case: Case, at: str) -> float:
    """Share of the sound pair's stiffness that the fault takes at a named point."""
    return 1.0 - single_pair_stiffness(case, at) / single_pair_stiffness(with_fault(case), at)


def _pit_over_crack(case: Case, at: str) -> float:
    """The pit's loss over that of the paper's 1 mm crack; ``at`` says where the crack starts."""
    crack = with_fault(case, "fault=crack", f"fault.crack_start={at}")
    return stiffness_loss(case, "C") / stiffness_loss(crack, "C")


def _smallest_step(case: Case, at: str) -> float:
    """Smallest growth of the loss at C along a series of severities ``fault key: value value ...``."""
    key, _, values = at.partition(":")
    series = [0.0, *(stiffness_loss(read_case((*case.overrides, f"{key}={value}")), "C") for value in values.split())]
    return float(np.diff(series).min())


def _share_without_stiffness(case: Case, at: str) -> float:
    """Part of a mesh cycle, in one turn of the pinion, in which no pair carries."""
    n_points = 1000
    turn = np.arange(case.pair.pinion.n_teeth * n_points) + 0.5
    stiffness = mesh_stiffness(case, case.pair.base_pitch * turn / n_points)
    return float(np.count_nonzero(stiffness == 0.0)) / n_points


def _remaining_pair_deviation(case: Case, at: str) -> float:
    """Largest departure from the remaining pair's own stiffness where the missing tooth was one of two."""
    pitch, zone = case.pair.base_pitch, case.pair.path_of_contact - case.pair.base_pitch
    inside = np.linspace(0.001, 0.999, 500) * zone
    # tooth 0 enters at roll 0 while its forerunner leaves, and leaves while its follower enters
    found = mesh_stiffness(case, np.concatenate([inside, pitch + inside]))
    alone = 1.0 / pair_compliance(case.table, np.concatenate([pitch + inside, inside]))
    return float(np.abs(found / alone - 1.0).max())


def _straight_root_stiffness(case: Case, at: str) -> float:
    """Single pair with the straight root in both teeth; body and contact as they are."""
    change = sum(_tooth(side, "straight", case, at) - _tooth(side, "true", case, at) for side in ("pinion", "wheel"))
    return 1.0 / (1.0 / single_pair_stiffness(case, at) + change)


def _straight_root_change(case: Case, at: str) -> float:
    return _straight_root_stiffness(case, at) / single_pair_stiffness(case, at) - 1.0


def _straight_over_true_error(case: Case, at: str) -> float:
    """Error of the straight root over that of the true curve against finite elements; ``at`` is ``what point``."""
    what, point = at.split()
    if what == "pair":
        exact = printed_value("spur_reference", f"fe_pair_stress.{point}")
        found = single_pair_stiffness(case, point), _straight_root_stiffness(case, point)
    else:
        exact = printed_value("spur_reference", f"fe_tooth.{what}.{point}")
        found = _tooth(what, "true", case, point), _tooth(what, "straight", case, point)
    return abs(found[1] - exact) / abs(found[0] - exact)


def _disc(index: int, case: Case, at: str) -> float:
    gear = case.gear(at)
    density = case.system.material.density_kg_per_m3
    return solid_disc(gear.pitch_radius, gear.bore_radius, gear.face_width, density)[index]


MESH: dict[str, Check] = {
    **{
        f"{side}_{name}": partial(_term, side, name)
        for side in ("pinion", "wheel")
        for name in ("bending", "shear", "axial", "foundation")
    },
    **{f"{side}_load_angle": partial(_load_angle, side) for side in ("pinion", "wheel")},
    **{f"{side}_tooth": partial(_tooth, side, "true") for side in ("pinion", "wheel")},
    **{f"{side}_tooth_straight_root": partial(_tooth, side, "straight") for side in ("pinion", "wheel")},
    **{f"{side}_structure": partial(_structural, side) for side in ("pinion", "wheel")},
    **{f"{side}_body_coefficient": partial(_body_coefficient, side) for side in ("pinion", "wheel")},
    **{f"{side}_cross_compliance": partial(_cross, side) for side in ("pinion", "wheel")},
    "contact": _contact,
    "single_pair_stiffness": single_pair_stiffness,
    "mean_stiffness": _mean_stiffness,
    "mesh_stiffness": _mesh_stiffness_at,
    "double_zone_stiffness": _double_zone_stiffness,
    "stiffness_harmonic": _stiffness_harmonic,
    "fault_increment": _fault_increment,
    "stiffness_loss": stiffness_loss,
    "pit_over_crack_loss": _pit_over_crack,
    "smallest_loss_step": _smallest_step,
    "share_without_stiffness": _share_without_stiffness,
    "remaining_pair_deviation": _remaining_pair_deviation,
    "straight_root_change": _straight_root_change,
    "straight_over_true_error": _straight_over_true_error,
    "disc_mass": partial(_disc, 0),
    "disc_inertia": partial(_disc, 1),
}
