"""gensig's values beside ROSS's.

Paper's terms, defaults, and the paper's terms with ROSS's choices put in.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.geometry.tooth import healthy_tooth
from gensig.geometry.tooth_profile import involute_point, load_angle
from gensig.mesh.compliance import tooth_compliance
from gensig.mesh.fillet_foundation import (
    body_coefficients,
    fillet_foundation_compliance,
)
from gensig.plan.request import read_request
from gensig.systems.pair_machine import GearPairMachine
from gensig.systems.registry import read_system

Array = NDArray[np.float64]
Height = Callable[[Gear, Array], Array]
Values = dict[tuple[str, str], float]  # (quantity, point), SI

PAPER = ("mesh.law=paper", "mesh.pair_coupling=sum", "mesh.contact=linear")
PAIRS: dict[str, tuple[str, ...]] = {
    "23/84": (),
    "25/50": (
        "gear.normal_module_mm=3",
        (
            "gear.pinion={n_teeth: 25, face_width_mm: 25, bore_radius_mm: 12, mass_kg: null, "
            "inertia_kg_m2: null}"
        ),
        (
            "gear.wheel={n_teeth: 50, face_width_mm: 25, bore_radius_mm: 20, mass_kg: null, "
            "inertia_kg_m2: null}"
        ),
    ),
}
N_PHASES, N_POSITIONS = 20, 2001
TERMS = ("bending", "shear", "axial", "foundation")
ROOT_ANGLES = ("root_half_angle", "root_curve_half_angle")


def machine(pair: str, overrides: Sequence[str] = ()) -> GearPairMachine:
    """One of the compared pairs under the given conventions."""
    return read_system(read_request([*PAIRS[pair], *overrides]).config)


def positions(pair: GearPair) -> dict[str, float]:
    """Positions from A of the named points, m.

    A, E ends of the path, B, D of the single zone, C pitch point.
    """
    path, pitch = pair.path_of_contact, pair.base_pitch
    a, b, c, d, e = 0.0, path - pitch, pair.pitch_point, pitch, path
    return {
        "A": a,
        "AB": (a + b) / 2,
        "B": b,
        "BD": (b + d) / 2,
        "C": c,
        "D": d,
        "DE": (d + e) / 2,
        "E": e,
    }


def phases() -> list[tuple[str, float]]:
    """Names and shares of a base pitch at which the mesh stiffness is compared."""
    return [
        (f"cycle {share:.3f}", share)
        for share in (np.arange(N_PHASES) + 0.5) / N_PHASES
    ]


def job(system: GearPairMachine) -> dict[str, Any]:
    """Values of a pair that ``_ross_values`` needs, SI."""
    pair, material = system.pair, system.material

    def contact(position: float, point: str = "") -> dict[str, Any]:
        radii = {
            "pinion": pair.pinion_curvature(position),
            "wheel": pair.wheel_curvature(position),
        }
        return {"point": point, **radii, "share": position / pair.path_of_contact}

    def contacts(share: float) -> list[dict[str, Any]]:
        newest = share * pair.base_pitch
        return [
            contact(s)
            for s in (newest, newest + pair.base_pitch)
            if s <= pair.path_of_contact
        ]

    return {
        "gears": {gear.name: _gear_job(gear) for gear in (pair.pinion, pair.wheel)},
        "youngs_modulus": material.youngs_modulus,
        "poisson_ratio": material.poisson_ratio,
        "density": material.density_kg_per_m3,
        "points": [
            contact(position, point) for point, position in positions(pair).items()
        ],
        "phases": [
            {"point": point, "share_of_pitch": share, "contacts": contacts(share)}
            for point, share in phases()
        ],
    }


def _gear_job(gear: Gear) -> dict[str, Any]:
    return {
        "n_teeth": gear.n_teeth,
        "module": gear.normal_module,
        "pr_angle": gear.pressure_angle,
        "addendum_coeff": gear.addendum_coefficient,
        "tip_clearance_coeff": gear.clearance_coefficient,
        "width": gear.face_width,
        "bore_radius": gear.bore_radius,
    }


def gensig_values(system: GearPairMachine) -> Values:
    """gensig's value of everything that ROSS computes, under the system's conventions."""
    pair, options = system.pair, system.mesh
    points, shares = (
        list(positions(pair)),
        np.array(list(positions(pair).values())) / pair.base_pitch,
    )
    curves = system.stiffness_curves(n_positions=N_POSITIONS, points_per_tooth=N_PHASES)

    def at_points(curve: Array) -> Array:
        return np.interp(shares, curves.contact_position, curve)

    values: Values = {("contact_ratio", ""): pair.transverse_contact_ratio}
    for gear in (pair.pinion, pair.wheel):
        for term in TERMS:
            values |= _by_point(
                f"{gear.name}_{term}_compliance",
                points,
                at_points(curves.compliance[gear.name][term]),
            )
        values |= {
            (f"{gear.name}_{angle}", ""): gear.root_half_angle for angle in ROOT_ANGLES
        }
        if options.body == "sainsot":
            values |= _coefficient_values(gear, gear.root_half_angle)
    contact = at_points(
        curves.compliance["pinion"]["contact"] + curves.compliance["wheel"]["contact"]
    )
    values |= _by_point("contact_compliance", points, contact)
    values["contact_compliance", ""] = float(contact[points.index("C")])
    names = [point for point, _ in phases()]
    for path in ("", "_own_path"):
        values |= _by_point(
            f"pair_stiffness{path}", points, at_points(curves.single_pair_stiffness)
        )
        values |= _by_point(
            f"mesh_stiffness{path}", names, curves.mesh_stiffness[:N_PHASES]
        )
    return values


def ross_choices(system: GearPairMachine) -> Values:
    """The paper's terms of gensig with nothing but ROSS's choices put in, to show that these
    explain the difference.
    """
    system = replace(system, pair=ross_rounding(system.pair))
    pair, material = system.pair, system.material
    points, position = list(positions(pair)), np.array(list(positions(pair).values()))
    shares = position / pair.path_of_contact
    values: Values = {}
    for gear, curvature in sides(pair, position):
        parts = tooth_compliance(healthy_tooth(gear), curvature, material)
        body = foundation(
            gear,
            curvature,
            system,
            half_angle=ross_half_angle(gear),
            height=contact_height,
        )
        for term in TERMS:
            result = body if term == "foundation" else getattr(parts, term)
            values |= _by_point(f"{gear.name}_{term}_compliance", points, result)
        values[f"{gear.name}_root_half_angle", ""] = ross_half_angle(gear)
        values |= _coefficient_values(gear, ross_half_angle(gear))
    true, own = sides(pair, position), ross_path(pair, shares)
    values |= _by_point(
        "pair_stiffness",
        points,
        ross_pair_stiffness(system, *(radii for _, radii in true)),
    )
    values |= _by_point(
        "pair_stiffness_own_path", points, ross_pair_stiffness(system, *own)
    )
    for point, share in phases():
        inside = np.array(
            [s for s in (share, share + 1.0) if s <= pair.transverse_contact_ratio]
        )
        radii = [curvature for _, curvature in sides(pair, inside * pair.base_pitch)]
        own_radii = ross_path(pair, inside / pair.transverse_contact_ratio)
        values["mesh_stiffness", point] = float(
            ross_pair_stiffness(system, *radii).sum()
        )
        values["mesh_stiffness_own_path", point] = float(
            ross_pair_stiffness(system, *own_radii).sum()
        )
    return values


def foundation(
    gear: Gear,
    curvature: Array,
    system: GearPairMachine,
    *,
    half_angle: float,
    height: Height,
) -> Array:
    """gensig's body term of the paper with the two choices that differ between the programs put
    in, (phase,) m/N.
    """
    angle = load_angle(gear, curvature)
    reach = (gear.root_radius + height(gear, curvature)) * np.cos(
        angle
    )  # the function takes u_f = reach/cos - r_f
    stand_in = _stand_in(gear, root_half_angle=half_angle, base_radius=reach)
    return fillet_foundation_compliance(
        stand_in, angle, system.material, allow_extrapolation=True
    )


def centerline_height(gear: Gear, curvature: Array) -> Array:
    """u_f from the root circle to where the load crosses the tooth centreline, m.

    Sainsot's and gensig's.
    """
    return gear.base_radius / np.cos(load_angle(gear, curvature)) - gear.root_radius


def contact_height(gear: Gear, curvature: Array) -> Array:
    """u_f from the root circle to the contact point, along the centreline, m: ROSS's."""
    return involute_point(gear, curvature)[0] - gear.root_radius


def ross_half_angle(gear: Gear) -> float:
    """ROSS's theta_f: b1 / r without the clearance c* in b1."""
    return (
        gear.root_half_angle
        - 2.0
        * gear.clearance_coefficient
        * math.tan(gear.pressure_angle)
        / gear.n_teeth
    )


def ross_rounding(pair: GearPair) -> GearPair:
    """The pair with ROSS's cutter tip, r_rho = c* m / (1 - sin(alpha))."""
    return replace(
        pair,
        pinion=_with_ross_rounding(pair.pinion),
        wheel=_with_ross_rounding(pair.wheel),
    )


def ross_path(pair: GearPair, share: Array) -> tuple[Array, Array]:
    """Curvature radii of pinion and wheel where ROSS puts a share of the path, (phase,) m.

    The pinion's pressure angle runs evenly from its own junction with the root curve to its
    tip, the wheel's falls
    from its tip by the gear ratio.
    """
    pinion, wheel = pair.pinion, pair.wheel
    start = math.atan(pinion.junction_curvature_radius / pinion.base_radius)
    advance = share * (math.acos(pinion.base_radius / pinion.tip_radius) - start)
    tip = math.acos(wheel.base_radius / wheel.tip_radius)
    return pinion.base_radius * np.tan(start + advance), wheel.base_radius * np.tan(
        tip - advance / pair.ratio
    )


def ross_pair_stiffness(system: GearPairMachine, pinion: Array, wheel: Array) -> Array:
    """Single-pair stiffness from gensig's terms with ROSS's body choices, (phase,) N/m."""
    material = system.material
    contact = (
        4.0
        * (1.0 - material.poisson_ratio**2)
        / (math.pi * material.youngs_modulus * system.pair.pinion.face_width)
    )
    total = np.full_like(pinion, contact)
    for gear, curvature in ((system.pair.pinion, pinion), (system.pair.wheel, wheel)):
        total = total + tooth_compliance(healthy_tooth(gear), curvature, material).total
        total = total + foundation(
            gear,
            curvature,
            system,
            half_angle=ross_half_angle(gear),
            height=contact_height,
        )
    return 1.0 / total


def sides(pair: GearPair, position: Array) -> list[tuple[Gear, Array]]:
    """Both gears with the curvature radii of their flanks at positions from A, (phase,) m."""
    return [
        (pair.pinion, np.asarray(pair.pinion_curvature(position))),
        (pair.wheel, np.asarray(pair.wheel_curvature(position))),
    ]


def _coefficient_values(gear: Gear, half_angle: float) -> Values:
    result = body_coefficients(
        _stand_in(gear, root_half_angle=half_angle), allow_extrapolation=True
    )
    return {
        (f"{gear.name}_coefficient_{letter}", ""): value
        for letter, value in result.items()
    }


def _with_ross_rounding(gear: Gear) -> Gear:
    rounding = gear.clearance_coefficient / (1.0 - math.sin(gear.pressure_angle))
    return replace(gear, cutter_tip_radius_coefficient=rounding)


def _stand_in(gear: Gear, **changes: Any) -> Any:
    """Quantities of a gear that the body term reads, derived ones replaced by ``changes``."""
    asked = (
        "name",
        "root_radius",
        "bore_radius",
        "face_width",
        "root_half_angle",
        "base_radius",
    )
    return SimpleNamespace(**{key: getattr(gear, key) for key in asked} | changes)


def _by_point(quantity: str, points: Sequence[str], values: Array) -> Values:
    return {
        (quantity, point): float(value)
        for point, value in zip(points, values, strict=True)
    }
