"""Fit the crack's intensity factors to stored finite elements: ``python -m
tests.reference.calibrate_crack``.

Writes ``gensig/mesh/root_crack_coefficients.py`` and prints how well the fit holds, gear by gear,
and how well it
holds for gears that were left out of it.
"""

from __future__ import annotations

import csv
import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gensig.geometry.gear import Gear
from gensig.geometry.tooth import RootCrack
from gensig.geometry.tooth_profile import load_angle, root_curve_point, root_curve_slope
from gensig.mesh.root_crack import basis, root_loads

Array = NDArray[np.float64]

DATA = Path(__file__).parent / "data" / "crack.csv"
TARGET = Path(__file__).parents[2] / "gensig" / "mesh" / "root_crack_coefficients.py"
MODULE, WIDTH, POISSON = (
    2e-3,
    20e-3,
    0.3,
)  # of the stored plane-strain runs, which state E W compliance
# a crack almost along the outline cuts the tooth off: no intensity factor of the root's resultants
# describes it
LEFT_OUT = {("z84", 75.0)}

# the one gear with every angle from both starts: without it the others span too little to judge it
MOST_ANGLES = "z23_bore9"


@dataclass(frozen=True, slots=True, kw_only=True)
class Series:
    """One crack: increments of E' W compliance at several contact points, with the fit's design
    matrix, (point, _).
    """

    case: str
    angle_deg: float
    depth_over_chord: float
    side: str
    increment: Array
    design: Array


def read_series() -> list[Series]:
    """All stored cracks."""
    groups: dict[tuple[str, ...], list[dict[str, str]]] = defaultdict(list)
    with DATA.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            groups[
                row["case"],
                row["side"],
                row["start"],
                row["crack_angle_deg"],
                row["depth_over_chord"],
            ].append(row)
    return [_series(rows) for rows in groups.values()]


def reference_gear(row: dict[str, str]) -> Gear:
    """The gear of a stored row."""
    return Gear(
        name="pinion",
        n_teeth=int(row["n_teeth"]),
        normal_module=MODULE,
        pressure_angle=math.radians(float(row["pressure_angle_deg"])),
        addendum_coefficient=float(row["addendum_coefficient"]),
        clearance_coefficient=0.25,
        cutter_tip_radius_coefficient=float(row["cutter_tip_radius_coefficient"]),
        profile_shift=float(row["profile_shift"]),
        face_width=WIDTH,
        bore_radius=float(row["bore_radius_over_module"]) * MODULE,
    )


def _series(rows: list[dict[str, str]]) -> Series:
    first, gear = rows[0], reference_gear(rows[0])
    abscissa, half = root_curve_point(gear, first["start"])
    depth = float(first["depth_over_chord"])
    crack = RootCrack(
        depth=np.array([2.0 * half * depth]),
        mouth_abscissa=abscissa,
        mouth_half_thickness=half,
        mouth_slope=root_curve_slope(gear, first["start"]),
        angle=math.radians(float(first["crack_angle_deg"])),
        side=first["side"],
        breathing=False,
    )
    curvature = (
        np.array([float(row["curvature_radius_over_module"]) for row in rows]) * MODULE
    )
    loads = root_loads(gear, crack, load_angle(gear, curvature))
    functions = basis(np.array([depth]), crack.angle, crack.mouth_slope)[0]
    return Series(
        case=first["case"],
        angle_deg=float(first["crack_angle_deg"]),
        depth_over_chord=depth,
        side=first["side"],
        increment=np.array([float(row["increment"]) for row in rows])
        / (1.0 - POISSON**2),
        design=(loads.T[:, :, None] * functions).reshape(len(rows), -1),
    )


def fit(series: Sequence[Series]) -> Array:
    """Coefficients (3, function) that make the relative error of the intensities least."""
    root = np.concatenate([np.sqrt(one.increment) for one in series])
    design = np.concatenate([one.design for one in series]) / root[:, None]
    scale = np.linalg.norm(design, axis=0)
    result = np.linalg.lstsq(design / scale, np.ones(len(root)), rcond=1e-6)[0] / scale
    return result.reshape(3, -1)


def errors(series: Sequence[Series], coefficients: Array) -> Array:
    """Relative errors of the increments."""
    return np.concatenate(
        [
            (one.design @ coefficients.ravel()) ** 2 / one.increment - 1.0
            for one in series
        ]
    )


def _print_row(name: str, error: Array) -> None:
    rms, far = np.sqrt(np.mean(error**2)), np.quantile(np.abs(error), 0.95)
    percent = [100 * value for value in (rms, far, error.min(), error.max())]
    columns = "".join(f"{value:>8.1f}" for value in percent)
    print(f"{name:<28}{len(error):>6}{columns}")


def main() -> None:
    """Fit, write, report."""
    everything = read_series()
    tension = [one for one in everything if one.side == "tension"]
    used = [one for one in tension if (one.case, one.angle_deg) not in LEFT_OUT]
    coefficients = fit(used)
    lines = ",\n".join(
        "    (" + ", ".join(f"{value:.6g}" for value in row) + ")"
        for row in coefficients
    )
    TARGET.write_text(
        '"""Written by ``python -m tests.reference.calibrate_crack``.\n\n'
        "For moment, shear and normal force, one number a function of "
        '``gensig.mesh.root_crack.basis``.\n"""\n\n'
        f"COEFFICIENTS = (\n{lines},\n)\n",
        encoding="utf-8",
    )
    columns = "".join(f"{name:>8}" for name in ("rms %", "95 %", "least", "most"))
    print(f"{'increment over finite elements':<28}{'n':>4}{columns}")
    _print_row("all that was fitted", errors(used, coefficients))
    for case in sorted({one.case for one in used}):
        _print_row(
            case, errors([one for one in used if one.case == case], coefficients)
        )
        if case != MOST_ANGLES:
            held_out = fit([one for one in used if one.case != case])
            _print_row(
                "  left out of the fit",
                errors([one for one in used if one.case == case], held_out),
            )
    for angle in sorted({one.angle_deg for one in used}):
        _print_row(
            f"angle {angle:g}",
            errors([one for one in used if one.angle_deg == angle], coefficients),
        )
    others = [one for one in tension if (one.case, one.angle_deg) in LEFT_OUT]
    for name, some in (
        ("not fitted: z84, 75 deg", others),
        (
            "compression side, open",
            [one for one in everything if one.side != "tension"],
        ),
    ):
        if some:
            _print_row(name, errors(some, coefficients))


if __name__ == "__main__":
    main()
