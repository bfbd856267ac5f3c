"""Time of the stiffness by potential energy against finite elements: ``python -m
benchmarks.stiffness_time`` (needs ``pip install -e ".[fem]"``).

The spur paper calls the method of its abstract "more efficient". Both compute the compliance of
tooth and body of both gears of the paper's pair at the same contact points over the path: the
paper's terms and gensig's default ones, and finite elements (``tests/reference``) with a coarse and
with the reference's mesh. CPU time on one core, the least of several runs, nothing kept between
them; the error is the largest against elements half as long as the reference's.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks._measure import machine, write_json
from gensig.geometry import tooth_profile
from gensig.geometry.contact import GearPair
from gensig.geometry.tooth import healthy_tooth
from gensig.material import Material
from gensig.mesh import body_coupling
from gensig.mesh.options import MeshOptions
from gensig.mesh.pair_table import structural_compliance
from gensig.plan.request import read_request
from gensig.systems.registry import read_system

Array = NDArray[np.float64]

SIDES = "pinion", "wheel"
KEPT = (
    healthy_tooth,
    tooth_profile.root_curve_middle,
    tooth_profile.root_curve_point,
    body_coupling.shared_body_compliance,
    body_coupling.arc_flexibility,
)
FINEST = 0.5  # of the reference's edge lengths
RESOLUTIONS = {"coarse": 3.0, "reference": 1.0}
CONVENTIONS = {
    "the paper's terms": ["experiment=paper"],
    "default terms": ["mesh.elasticity=plane_stress"],
}


def by_potential_energy(
    pair: GearPair, material: Material, options: MeshOptions, position: Array
) -> Array:
    """Compliance of tooth and body of both gears, (contact,) m/N."""
    in_plane = material.in_plane(options.elasticity)
    total = np.zeros(len(position))
    for side in SIDES:
        curvature = np.array([pair.curvature(side, s) for s in position])
        tooth = healthy_tooth(pair.gears[side])
        total += structural_compliance(tooth, curvature, in_plane, options)
    return total


def by_finite_elements(
    pair: GearPair, material: Material, position: Array, size: float
) -> Array:
    """The same by elements whose edges are ``size`` times the reference's."""
    from tests.reference import finite_elements
    from tests.reference.gear_mesh import Resolution

    width = pair.pinion.face_width
    plane = finite_elements.Plane(
        elasticity="plane_stress", material=material, face_width=width
    )
    total = np.zeros(len(position))
    for side in SIDES:
        curvature = np.array([pair.curvature(side, s) for s in position])
        total += finite_elements.structural_compliance(
            pair.gears[side], curvature, plane, resolution=Resolution().scaled(size)
        )
    return total


def least_seconds(compute: Callable[[], Array], runs: int) -> tuple[float, Array]:
    """CPU time of a computation, s, and its result."""
    least, result = float("inf"), np.empty(0)
    for _ in range(runs):
        for kept in KEPT:
            kept.cache_clear()
        start = time.process_time()
        result = compute()
        least = min(least, time.process_time() - start)
    return least, result


def main() -> None:
    """One line a method."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--contacts", type=int, default=64, help="over the path")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--json", help="also write the figures to this file")
    wanted = parser.parse_args()
    figures: dict[str, dict[str, float]] = {}
    systems = {
        name: read_system(read_request(words).config)
        for name, words in CONVENTIONS.items()
    }
    system = systems["default terms"]
    pair, material = system.pair, system.material
    # flank of the wheel next to its root: the involute begins there
    position = np.linspace(0.02, 0.98, wanted.contacts) * pair.path_of_contact
    exact = by_finite_elements(pair, material, position, FINEST)
    print(f"{'method':32}{'CPU ms':>10}{'error':>10}")
    for name, size in RESOLUTIONS.items():
        seconds, found = least_seconds(
            lambda size=size: by_finite_elements(pair, material, position, size),
            wanted.runs,
        )
        method = f"finite elements, {name}"
        figures[method] = _told(method, seconds, found, exact)
    for name, each in systems.items():
        options = replace(each.mesh, elasticity="plane_stress")
        seconds, found = least_seconds(
            lambda options=options: by_potential_energy(
                pair, material, options, position
            ),
            wanted.runs,
        )
        method = f"potential energy, {name}"
        figures[method] = _told(method, seconds, found, exact)
    write_json(wanted.json, machine(), figures)


def _told(name: str, seconds: float, found: Array, exact: Array) -> dict[str, float]:
    """CPU seconds and largest relative error of a method, printed too."""
    error = float(np.abs(found / exact - 1.0).max())
    print(f"{name:32}{1e3 * seconds:10.2f}{100 * error:9.2f} %")
    return {"cpu_s": seconds, "largest_error": error}


if __name__ == "__main__":
    main()
