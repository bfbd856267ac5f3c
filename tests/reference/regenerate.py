"""Write the reference tables again: ``python -m tests.reference.regenerate
[healthy|tooth|crack|...]``.

Without names, all of them; see ``TABLES``. Compliances are dimensionless, compliance * E * W; a
plane compliance in
this form is the same for every module, modulus and face width, and depends on Poisson's ratio (0.3
here) and the plane
state.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import platform
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.geometry.tooth_profile import root_curve_point
from gensig.material import Material
from tests.reference.finite_elements import (
    Plane,
    contact_radii,
    crack_increment,
    cross_compliance,
    root_stress_factor,
    structural_compliance,
    tooth_compliance,
)
from tests.reference.gear_mesh import Crack, Resolution
from tests.reference.three_d import three_d

Array = NDArray[np.float64]
Row = dict[str, Any]

DATA = Path(__file__).parent / "data"
STEEL = Material(youngs_modulus=206e9, poisson_ratio=0.3, density_kg_per_m3=7850.0)
BASE = Gear(
    name="gear",
    n_teeth=23,
    normal_module=2e-3,
    pressure_angle=math.radians(20.0),
    addendum_coefficient=1.0,
    clearance_coefficient=0.25,
    cutter_tip_radius_coefficient=0.38,
    profile_shift=0.0,
    face_width=20e-3,
    bore_radius=9e-3,
)
N_CONTACTS = 10
TIP_MARGIN = 0.15e-3  # keeps the point load off the tip corner
BODY_RATIO = 2.3  # root radius over bore radius where no bore is given
CRACK_ANGLES_DEG = (30.0, 45.0, 60.0, 75.0)
CRACK_DEPTHS = (
    0.05,
    0.1,
    0.2,
    0.3,
    0.4,
    0.5,
    0.6,
    0.7,
    0.8,
)  # over the chord at the crack's start
BORE_PAIRS_MM = (
    (5.0, 10.0),
    (7.0, 12.5),
    (9.0, 15.0),
    (10.0, 20.0),
    (12.0, 30.0),
    (14.0, 40.0),
)


def _gear(n_teeth: int, *, bore_radius: float | None = None, **changes: float) -> Gear:
    """The basic rack's gear; without ``bore_radius``, its bore follows ``BODY_RATIO``."""
    gear = replace(
        BASE, **({"n_teeth": n_teeth, "bore_radius": bore_radius or 1e-3} | changes)
    )  # type: ignore[arg-type]
    return (
        gear
        if bore_radius
        else replace(gear, bore_radius=gear.root_radius / BODY_RATIO)
    )


GEARS: dict[str, Gear] = {
    "z23_bore9": _gear(23, bore_radius=9e-3),
    "z84_bore15": _gear(84, bore_radius=15e-3),
    "z17_x03": _gear(17, profile_shift=0.3),
    "z20": _gear(20),
    "z23": _gear(23),
    "z32": _gear(32),
    "z40": _gear(40),
    "z50": _gear(50),
    "z84": _gear(84),
    "z120": _gear(120),
    "z30_alpha25": _gear(
        30, pressure_angle=math.radians(25.0), cutter_tip_radius_coefficient=0.3
    ),
    "z25_sharp": _gear(25, cutter_tip_radius_coefficient=0.2),
    "z30_long": _gear(30, addendum_coefficient=1.15),
}
ONLY_STRESSED = {"z54": _gear(54)}
CRACKED = ("z23_bore9", "z40", "z84", "z17_x03", "z30_alpha25", "z25_sharp")
STRESSED = (
    "z17_x03",
    "z23",
    "z25_sharp",
    "z30_alpha25",
    "z30_long",
    "z40",
    "z54",
    "z84",
)
TIP_DISTANCES = (
    0.02,
    0.15,
    0.3,
    0.45,
    0.6,
    0.75,
    0.9,
    1.05,
)  # base pitches from the tip
FINE_ROOT = Resolution(flank=0.05, root=0.015, inside=1.0)
ALL_ANGLES = ("z23_bore9", "z40", "z84")


def _plane(elasticity: str) -> Plane:
    return Plane(elasticity=elasticity, material=STEEL, face_width=BASE.face_width)


STRAIN = _plane("plane_strain")


def _gear_columns(case: str) -> Row:
    gear = GEARS.get(case) or ONLY_STRESSED[case]
    return {
        "case": case,
        "n_teeth": gear.n_teeth,
        "pressure_angle_deg": math.degrees(gear.pressure_angle),
        "profile_shift": gear.profile_shift,
        "addendum_coefficient": gear.addendum_coefficient,
        "cutter_tip_radius_coefficient": gear.cutter_tip_radius_coefficient,
        "bore_radius_over_module": gear.bore_radius / gear.normal_module,
    }


def _contact_rows(
    head: Row, radii: Array, labels: Sequence[Row] | None = None, **compliances: Array
) -> Iterator[Row]:
    """One row per contact; compliances (contact,) in m/N become dimensionless. ``labels`` adds
    columns per contact.
    """
    for index, radius in enumerate(radii):
        label = labels[index] if labels else {}
        values = {
            name: value[index] / STRAIN.unit_compliance
            for name, value in compliances.items()
        }
        yield {
            **head,
            **label,
            "curvature_radius_over_module": radius / BASE.normal_module,
            **values,
        }


def healthy() -> Iterator[Row]:
    """Total, tooth and body compliance of the reference pair 23/84 at its named contact points."""
    pair = _pair(9.0, 15.0)
    named = _named_positions(pair)
    for elasticity in ("plane_stress", "plane_strain"):
        plane = _plane(elasticity)
        for gear in (pair.pinion, pair.wheel):
            radii = _radii(pair, gear, np.array(list(named.values())))
            total, clamped = (
                structural_compliance(gear, radii, plane),
                tooth_compliance(gear, radii, plane),
            )
            head = {"gear": gear.name, "elasticity": elasticity}
            labels = [{"point": point} for point in named]
            yield from _contact_rows(
                head, radii, labels, total=total, tooth=clamped, body=total - clamped
            )


def tooth() -> Iterator[Row]:
    """Total, tooth and body compliance of many gears over their involute, plane strain."""
    for case, gear in GEARS.items():
        radii = contact_radii(gear, N_CONTACTS, tip_margin=TIP_MARGIN)
        total = structural_compliance(gear, radii, STRAIN)
        clamped = tooth_compliance(gear, radii, STRAIN)
        yield from _contact_rows(
            _gear_columns(case), radii, total=total, tooth=clamped, body=total - clamped
        )


def crack() -> Iterator[Row]:
    """Compliance increments of cracks of many starts, angles and depths, plane strain."""
    for case in CRACKED:
        gear = GEARS[case]
        radii = contact_radii(gear, N_CONTACTS, tip_margin=TIP_MARGIN)
        for start, angle, side in _crack_families(case):
            chord = 2.0 * root_curve_point(gear, start)[1]
            for share in CRACK_DEPTHS:
                slit = Crack(
                    start=start,
                    angle=math.radians(angle),
                    depth=share * chord,
                    side=side,
                )
                head = _gear_columns(case) | {
                    "start": start,
                    "crack_angle_deg": angle,
                    "depth_over_chord": share,
                    "depth_over_module": slit.depth / gear.normal_module,
                    "side": side,
                }
                yield from _contact_rows(
                    head, radii, increment=crack_increment(gear, radii, STRAIN, slit)
                )


def _crack_families(case: str) -> Iterator[tuple[str, float, str]]:
    """Start, angle (deg) and side of the cracks of one gear."""
    for start in ("gamma_mid", "arc_mid"):
        yield start, 45.0, "tension"
    if case in ALL_ANGLES:
        for angle in CRACK_ANGLES_DEG:
            if angle != 45.0:
                yield "arc_mid", angle, "tension"
    if case == "z23_bore9":
        for start in ("gamma_mid", "arc_mid"):
            yield start, 45.0, "compression"
        for angle in CRACK_ANGLES_DEG:
            if angle != 45.0:
                yield "gamma_mid", angle, "tension"


def bores() -> Iterator[Row]:
    """Self compliances at the named points and cross compliances over the double zone, over bore
    radii.
    """
    for elasticity in ("plane_stress", "plane_strain"):
        plane = _plane(elasticity)
        for bore_pair in BORE_PAIRS_MM:
            pair = _pair(*bore_pair)
            named = _named_positions(pair)
            double = np.linspace(0.0, pair.path_of_contact - pair.base_pitch, 7)
            for gear, neighbour in ((pair.pinion, 1), (pair.wheel, -1)):
                head = {
                    "gear": gear.name,
                    "elasticity": elasticity,
                    "bore_radius_over_module": gear.bore_radius / gear.normal_module,
                }
                radii = _radii(pair, gear, np.array(list(named.values())))
                labels = [
                    _position("self", point, position)
                    for point, position in named.items()
                ]
                own = structural_compliance(gear, radii, plane)
                yield from _contact_rows(head, radii, labels, compliance=own)
                radii = _radii(pair, gear, double)
                labels = [_position("cross", "", position) for position in double]
                cross = cross_compliance(gear, radii, plane, tooth=neighbour)
                yield from _contact_rows(head, radii, labels, compliance=cross)


def root_stress() -> Iterator[Row]:
    """Largest tension along the root curve, over the force along the line of action / (W m)."""
    for case in STRESSED:
        gear = GEARS.get(case) or ONLY_STRESSED[case]
        tip = math.sqrt(gear.tip_radius**2 - gear.base_radius**2)
        radii = tip - np.array(TIP_DISTANCES) * gear.base_pitch
        inside = radii > gear.junction_curvature_radius + TIP_MARGIN
        factor, slope = root_stress_factor(
            gear, radii[inside], _plane("plane_stress"), resolution=FINE_ROOT
        )
        for distance, value, angle in zip(
            np.array(TIP_DISTANCES)[inside], factor, np.degrees(slope), strict=True
        ):
            yield _gear_columns(case) | {
                "tip_distance_over_base_pitch": float(distance),
                "stress_factor": float(value),
                "tangent_deg": float(angle),
            }


def _position(kind: str, point: str, position: float) -> Row:
    return {
        "kind": kind,
        "point": point,
        "position_over_module": position / BASE.normal_module,
    }


def _pair(pinion_bore_mm: float, wheel_bore_mm: float) -> GearPair:
    pinion = replace(BASE, name="pinion", bore_radius=pinion_bore_mm * 1e-3)
    wheel = replace(BASE, name="wheel", n_teeth=84, bore_radius=wheel_bore_mm * 1e-3)
    return GearPair(pinion=pinion, wheel=wheel, backlash=0.0)


def _named_positions(pair: GearPair) -> dict[str, float]:
    """Positions s from A, m: start A and end E of contact, single zone B..D, pitch point C,
    midpoints.
    """
    end, pitch = pair.path_of_contact, pair.base_pitch
    b, c, d = end - pitch, pair.pitch_point, pitch
    return {
        "A": 0.0,
        "AB": b / 2,
        "B": b,
        "BD": (b + d) / 2,
        "C": c,
        "D": d,
        "DE": (d + end) / 2,
        "E": end,
    }


def _radii(pair: GearPair, gear: Gear, position: Array) -> Array:
    """Curvature radii of one of the gears, kept on its involute against rounding."""
    radii = (
        pair.pinion_curvature(position)
        if gear is pair.pinion
        else pair.wheel_curvature(position)
    )
    return np.minimum(radii, math.sqrt(gear.tip_radius**2 - gear.base_radius**2))


def three_d_tables() -> dict[str, Iterable[Row]]:
    """Faults over a part of the face width of the reference pinion."""
    pair = _pair(9.0, 15.0)
    named = _named_positions(pair)
    points = {
        point: float(_radii(pair, pair.pinion, np.array([named[point]]))[0])
        for point in "CBDE"
    }
    return dict(three_d(pair.pinion, points, STEEL.poisson_ratio))


TABLES: dict[str, Callable[[], dict[str, Iterable[Row]]]] = {
    "healthy": lambda: {"healthy": healthy()},
    "tooth": lambda: {"tooth": tooth()},
    "crack": lambda: {"crack": crack()},
    "bores": lambda: {"bores": bores()},
    "root_stress": lambda: {"root_stress": root_stress()},
    "three_d": three_d_tables,
}


def write_table(path: Path, table: Iterable[Row]) -> int:
    """Write all rows once they are known; returns their number."""
    rows = [_rounded(row) for row in table]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return len(rows)


def _rounded(row: Row) -> Row:
    return {
        key: f"{value:.8g}" if isinstance(value, float) else value
        for key, value in row.items()
    }


def main(arguments: list[str] | None = None) -> None:
    """Command line: which tables to write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "tables",
        nargs="*",
        metavar="table",
        help=f"one or more of {', '.join(TABLES)}; default all",
    )
    chosen = parser.parse_args(arguments).tables or list(TABLES)
    unknown = sorted(set(chosen) - set(TABLES))
    if unknown:
        parser.error(f"unknown table {unknown[0]!r}; choose from {', '.join(TABLES)}")
    DATA.mkdir(exist_ok=True)
    for group in chosen:
        start = time.perf_counter()
        for name, rows in TABLES[group]().items():
            count = write_table(DATA / f"{name}.csv", rows)
            print(
                f"{name}.csv: {count} rows, {time.perf_counter() - start:.0f} s",
                flush=True,
            )
    packages = ("gmsh", "numpy", "scikit-fem", "scipy")
    versions = {"python": platform.python_version()} | {
        name: version(name) for name in packages
    }
    (DATA / "versions.json").write_text(
        json.dumps(versions, indent=2) + "\n", encoding="utf-8"
    )


if __name__ == "__main__":
    main()
