"""ROSS's own values for the pairs of ``benchmarks.ross``: ``python _ross_values.py JOB.json
VALUES.csv``.

Runs in ROSS's environment and knows nothing of gensig. A job holds, in SI units, the gears and
the curvature radii of the contacts of rigid involutes, so that both programs are asked for the
same contact positions.
"""

from __future__ import annotations

import csv
import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import ross

HEADER = (
    "pair",
    "quantity",
    "point",
    "pinion_curvature_radius_mm",
    "share_of_path",
    "value",
    "unit",
    "ross_version",
)
TERMS = {
    "bending": "_inv_kb",
    "shear": "_inv_ks",
    "axial": "_inv_ka",
    "foundation": "_inv_kf",
}

Row = tuple[
    str, str, float | None, float | None, float, str
]  # quantity, point, m, share, value, unit


def main() -> None:
    """Read the job, write the values."""
    job = json.loads(Path(sys.argv[1]).read_text())
    rows = [(name, *row) for name, pair in job.items() for row in pair_rows(pair)]
    with open(sys.argv[2], "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEADER)
        for name, quantity, point, radius, share, value, unit in rows:
            place = [
                "" if radius is None else f"{radius * 1e3:.9g}",
                "" if share is None else f"{share:.9g}",
            ]
            writer.writerow(
                [name, quantity, point, *place, f"{value:.9g}", unit, ross.__version__]
            )


def pair_rows(pair: dict[str, Any]) -> Iterator[Row]:
    """Every quantity that ROSS computes for one pair."""
    material = ross.Material(
        name="steel",
        rho=pair["density"],
        E=pair["youngs_modulus"],
        Poisson=pair["poisson_ratio"],
    )
    gears = {
        name: read_gear(pair["gears"][name], material) for name in ("pinion", "wheel")
    }
    mesh = ross.Mesh(gears["pinion"], gears["wheel"])
    yield "contact_ratio", "", None, None, mesh.contact_ratio, "1"
    yield "contact_compliance", "", None, None, 1.0 / mesh.hertzian_stiffness, "m/N"
    yield "constant_mesh_stiffness", "", None, None, mesh.stiffness, "N/m"
    for name, gear in gears.items():
        yield from body_rows(name, gear)
    for contact in pair["points"]:
        yield from point_rows(contact, gears, mesh)
    for phase in pair["phases"]:
        place = (
            phase["point"],
            phase["contacts"][0]["pinion"],
            phase["contacts"][0]["share"],
        )
        roll = phase["share_of_pitch"] * 2.0 * math.pi / gears["pinion"].n_teeth
        yield (
            "mesh_stiffness_own_path",
            *place,
            mesh.get_variable_stiffness(roll),
            "N/m",
        )
        total = sum(
            pair_stiffness(contact, gears, mesh) for contact in phase["contacts"]
        )
        yield "mesh_stiffness", *place, total, "N/m"


def read_gear(values: dict[str, Any], material: Any) -> Any:
    """ROSS's gear from SI values; ROSS takes the bore as a diameter."""
    return ross.GearElementTVMS(
        n=0, material=material, bore_diameter=2.0 * values.pop("bore_radius"), **values
    )


def body_rows(name: str, gear: Any) -> Iterator[Row]:
    """Half angles of the root, of the body term and of the root curve, and L*, M*, P*, Q*."""
    y, x, _, _ = gear._compute_transition_curve(0.5 * math.pi)
    yield (
        f"{name}_root_half_angle",
        "",
        None,
        None,
        gear.tooth_dict["root_angle"],
        "rad",
    )
    yield f"{name}_root_curve_half_angle", "", None, None, math.atan2(x, y), "rad"
    for letter, value in body_coefficients(gear).items():
        yield f"{name}_coefficient_{letter}", "", None, None, value, "1"


def body_coefficients(gear: Any) -> dict[str, float]:
    """L*, M*, P* and Q*, which ROSS keeps to itself.

    From its body compliance at four chosen heights and angles.
    """
    root = gear.radii_dict["root"]
    chord = 2.0 * root * gear.tooth_dict["root_angle"]

    def bracket(lever: float, angle: float) -> float:
        place = (root + lever * chord, 0.0, 0.0, 0.0)
        with mock.patch.object(gear, "_compute_involute_curve", return_value=place):
            return float(
                gear._inv_kf(angle)
                * gear.material.E
                * gear.width
                / math.cos(angle) ** 2
            )

    p, up, down = bracket(0.0, 0.0), bracket(1.0, 0.0), bracket(-1.0, 0.0)
    q = bracket(0.0, 0.25 * math.pi) / p - 1.0
    return {"L": 0.5 * (up + down) - p, "M": 0.5 * (up - down), "P": p, "Q": q}


def point_rows(
    contact: dict[str, Any], gears: dict[str, Any], mesh: Any
) -> Iterator[Row]:
    """Terms and single-pair stiffness at one contact.

    The pair also where ROSS itself puts this share of the path.
    """
    place = (contact["point"], contact["pinion"], contact["share"])
    for name, gear in gears.items():
        beta = gear._to_tau(contact_angle(contact[name], gear))
        for term, method in TERMS.items():
            yield (
                f"{name}_{term}_compliance",
                *place,
                float(getattr(gear, method)(beta)),
                "m/N",
            )
    yield "pair_stiffness", *place, pair_stiffness(contact, gears, mesh), "N/m"
    angles = gears["pinion"].pr_angles_dict
    advance = contact["share"] * (angles["addendum"] - angles["start_point"])
    yield (
        "pair_stiffness_own_path",
        *place,
        mesh._angular_equivalent_stiffness(advance),
        "N/m",
    )


def contact_angle(curvature: float, gear: Any) -> float:
    """Pressure angle of the contact at a curvature radius."""
    return math.atan(curvature / gear.base_radius)


def pair_stiffness(contact: dict[str, Any], gears: dict[str, Any], mesh: Any) -> float:
    """ROSS's series of both gears and the contact, at the contact of rigid involutes."""
    teeth = sum(
        1.0 / gear._compute_stiffness(contact_angle(contact[name], gear))
        for name, gear in gears.items()
    )
    return float(1.0 / (1.0 / mesh.hertzian_stiffness + teeth))


if __name__ == "__main__":
    main()
