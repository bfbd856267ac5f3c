"""Compliance of teeth and gear bodies, each by itself, by the names that the rows use."""

from __future__ import annotations

import csv
import warnings
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from gensig.dynamics.pair import solid_disc
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import Tooth, healthy_tooth
from gensig.geometry.tooth_profile import load_angle
from gensig.mesh.body_coupling import cross_compliance
from gensig.mesh.fillet_foundation import (
    ExtrapolationWarning,
    body_coefficients,
    fillet_foundation_compliance,
)
from gensig.mesh.pair_table import structural_terms
from validation.case import Array, Case
from validation.checks.geometry_checks import Check
from validation.checks.mesh_checks import (
    N_MEAN,
    contact_compliance,
    mean_mesh_stiffness,
    single_pair_stiffness,
)
from validation.root_variants import other_root_angle, straight_root_tooth
from validation.rows import printed_value

TIMES = Path(__file__).resolve().parents[3] / "reference/data/stiffness_time.csv"

SIDES = ("pinion", "wheel")


@lru_cache(maxsize=8)
def _straight_tooth(gear: Gear) -> Tooth:
    return straight_root_tooth(gear)


def terms(
    case: Case, side: str, curvature: Array, *, root: str = "true"
) -> dict[str, Array]:
    """Bending, shear, axial and body compliance of a sound tooth, (phase,) m/N each.

    ``root`` may be ``straight``.
    """
    make = {"true": healthy_tooth, "straight": _straight_tooth}[root]
    tooth = make(case.gear(side))
    return structural_terms(tooth, curvature, case.structure_material, case.system.mesh)


def structure(case: Case, side: str, curvature: Array) -> Array:
    """Their sum, (phase,) m/N."""
    return np.sum(list(terms(case, side, curvature).values()), axis=0)


def _load_angle(side: str, case: Case, at: str) -> float:
    return float(load_angle(case.gear(side), case.curvature(side, at))[0])


def _term(side: str, name: str, case: Case, at: str) -> float:
    return float(terms(case, side, case.curvature(side, at))[name][0])


def _tooth(side: str, root: str, case: Case, at: str) -> float:
    """Sum of bending, shear and axial compliance, with the true or the straight root curve."""
    parts = terms(case, side, case.curvature(side, at), root=root)
    return float(sum(parts[name][0] for name in ("bending", "shear", "axial")))


def _structure(side: str, case: Case, at: str) -> float:
    return float(structure(case, side, case.curvature(side, at))[0])


def _body_coefficient(side: str, case: Case, at: str) -> float:
    return body_coefficients(case.gear(side), allow_extrapolation=False)[at]


def _sainsot(gear: Gear, case: Case, side: str, point: str) -> float:
    """Sainsot's body under the loaded tooth, also where the fit was not checked.

    Rows show what becomes of it.
    """
    angle = load_angle(gear, case.curvature(side, point))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)
        result = fillet_foundation_compliance(
            gear, angle, case.system.material, allow_extrapolation=True
        )
    return float(result[0])


def _sainsot_over_fe_body(side: str, case: Case, at: str) -> float:
    """Sainsot's body over that of finite elements.

    ``at`` is ``point row``, the row that prints the latter.
    """
    point, row = at.split()
    return _sainsot(case.gear(side), case, side, point) / printed_value(
        "spur_reference", row
    )


def _double_zone(case: Case, at: str) -> tuple[Array, Array]:
    """Positions of the entering and the leaving pair.

    ``at`` is the former in mm, ``mid`` of the zone, or ``mean``.
    """
    pair = case.pair
    zone = pair.path_of_contact - pair.base_pitch
    if at == "mean":
        entering = (np.arange(N_MEAN) + 0.5) / N_MEAN * zone
    elif at == "mid":
        entering = np.array([0.5 * zone])
    else:
        entering = np.array([float(at) * 1e-3])
    return entering, np.minimum(entering + pair.base_pitch, pair.path_of_contact)


def _pair_structure(which: int, case: Case, at: str) -> float:
    """Teeth and bodies of the entering (0) or the leaving (1) pair in the double zone."""
    position = _double_zone(case, at)[which]
    return float(
        sum(
            structure(case, side, case.curvature_at(side, position))[0]
            for side in SIDES
        )
    )


def _cross(side: str, case: Case, at: str) -> float:
    """Body compliance between the two pairs of the double zone."""
    gear = case.gear(side)
    angles = [
        load_angle(gear, case.curvature_at(side, position))
        for position in _double_zone(case, at)
    ]
    pitches = {"pinion": 1, "wheel": -1}[side]
    material = case.structure_material
    return float(cross_compliance(gear, material, *angles, pitches=pitches)[0])


def _cross_over_body(side: str, case: Case, at: str) -> float:
    """Shared body compliance over the mean of the two pairs' own, in the middle of the double
    zone.
    """
    bodies = [
        terms(case, side, case.curvature_at(side, place))["foundation"][0]
        for place in _double_zone(case, "mid")
    ]
    return _cross(side, case, "mid") / float(np.mean(bodies))


def _stiffness_body_once(case: Case, at: str) -> float:
    """Mean stiffness of the double zone where each body is counted once: teeth and contacts side
    by side, in series with the mean of the bodies under either pair."""
    own, body = [], []
    for position in _double_zone(case, "mean"):
        parts = [terms(case, side, case.curvature_at(side, position)) for side in SIDES]
        body.append(sum(part["foundation"] for part in parts))
        own.append(
            contact_compliance(case, position)
            + sum(sum(part.values()) for part in parts)
            - body[-1]
        )
    together = 1.0 / (1.0 / own[0] + 1.0 / own[1])
    return float(np.mean(1.0 / (together + 0.5 * (body[0] + body[1]))))


def _body_once_error(case: Case, at: str) -> float:
    """That stiffness over the one with shared bodies, less 1."""
    return _stiffness_body_once(case, at) / mean_mesh_stiffness(case, "double") - 1.0


def _stiffness_other_root_angle(case: Case, at: str) -> float:
    """Single pair at C with another half angle of the tooth's root in the body term."""
    change = 0.0
    for side in SIDES:
        gear = case.gear(side)
        change += _sainsot(other_root_angle(gear, at), case, side, "C") - _sainsot(
            gear, case, side, "C"
        )
    return 1.0 / (1.0 / single_pair_stiffness(case, "C") + change)


def _straight_root_stiffness(case: Case, at: str) -> float:
    """Single pair with the straight root in both teeth; body and contact as they are."""
    change = sum(
        _tooth(side, "straight", case, at) - _tooth(side, "true", case, at)
        for side in SIDES
    )
    return 1.0 / (1.0 / single_pair_stiffness(case, at) + change)


def _straight_root_change(case: Case, at: str) -> float:
    return _straight_root_stiffness(case, at) / single_pair_stiffness(case, at) - 1.0


def _straight_over_true_error(case: Case, at: str) -> float:
    """Error of the straight root over that of the true curve against finite elements.

    ``at`` is ``what point``.
    """
    what, point = at.split()
    if what == "pair":
        exact = printed_value("spur_reference", f"fe_pair_stress.{point}")
        result = (
            single_pair_stiffness(case, point),
            _straight_root_stiffness(case, point),
        )
    else:
        exact = printed_value("spur_reference", f"fe_tooth.{what}.{point}")
        result = (
            _tooth(what, "true", case, point),
            _tooth(what, "straight", case, point),
        )
    return abs(result[1] - exact) / abs(result[0] - exact)


def _times_faster(case: Case, at: str) -> float:
    """CPU time of coarse finite elements over that of potential energy, as stored.

    ``at`` is the convention of the potential energy. ``python -m benchmarks.stiffness_time``
    measures; nothing is timed here.
    """
    with TIMES.open(encoding="utf-8", newline="") as file:
        spent = {row["method"]: float(row["cpu_ms"]) for row in csv.DictReader(file)}
    return spent["finite elements coarse"] / spent[f"potential energy {at}"]


def _disc(index: int, case: Case, at: str) -> float:
    gear = case.gear(at)
    density = case.system.material.density_kg_per_m3
    return solid_disc(gear.pitch_radius, gear.bore_radius, gear.face_width, density)[
        index
    ]


BODY: dict[str, Check] = {
    **{
        f"{side}_{name}": partial(_term, side, name)
        for side in SIDES
        for name in ("bending", "shear", "axial", "foundation")
    },
    **{f"{side}_load_angle": partial(_load_angle, side) for side in SIDES},
    **{f"{side}_tooth": partial(_tooth, side, "true") for side in SIDES},
    **{
        f"{side}_tooth_straight_root": partial(_tooth, side, "straight")
        for side in SIDES
    },
    **{f"{side}_structure": partial(_structure, side) for side in SIDES},
    **{f"{side}_body_coefficient": partial(_body_coefficient, side) for side in SIDES},
    **{
        f"{side}_sainsot_over_fe_body": partial(_sainsot_over_fe_body, side)
        for side in SIDES
    },
    **{f"{side}_cross_compliance": partial(_cross, side) for side in SIDES},
    **{f"{side}_cross_over_body": partial(_cross_over_body, side) for side in SIDES},
    "entering_pair_structure": partial(_pair_structure, 0),
    "leaving_pair_structure": partial(_pair_structure, 1),
    "stiffness_body_once": _stiffness_body_once,
    "body_once_error": _body_once_error,
    "stiffness_other_root_angle": _stiffness_other_root_angle,
    "straight_root_change": _straight_root_change,
    "straight_over_true_error": _straight_over_true_error,
    "times_faster": _times_faster,
    "disc_mass": partial(_disc, 0),
    "disc_inertia": partial(_disc, 1),
}
