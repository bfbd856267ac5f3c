"""ROSS's own time for one time response: ``python _ross_time_response.py JOB.json TIME.json``.

Runs in ROSS's environment and knows nothing of gensig. Two shafts of two elements each carry a
gear in the middle and a bearing at either end; the mesh stiffness is taken anew at every step,
which ROSS integrates by Newmark's method.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import ross

MIDDLE, ENDS = 1, (0, 2)  # nodes of a shaft


def main() -> None:
    """Read the job, time the response, write what it took."""
    job = json.loads(Path(sys.argv[1]).read_text())
    pair = two_shafts(job)
    response(pair, job, 20)  # compiles
    n_steps = round(job["duration"] * job["sampling_rate"])
    result = [timed(pair, job, n_steps) for _ in range(job["runs"])]
    told = {
        "ross_version": ross.__version__,
        "cpu_s": min(result),
        "simulated_s": (n_steps - 1) / job["sampling_rate"],
        "n_dof": pair.ndof,
    }
    Path(sys.argv[2]).write_text(json.dumps(told))


def two_shafts(job: dict[str, Any]) -> Any:
    """Both rotors and their mesh, whose stiffness varies."""
    steel = ross.Material(
        name="steel",
        rho=job["density"],
        E=job["youngs_modulus"],
        Poisson=job["poisson_ratio"],
    )
    driving, driven = (
        rotor(job["gears"][name], job["supports"][name], steel)
        for name in ("pinion", "wheel")
    )
    return ross.MultiRotor(
        driving, driven, coupled_nodes=(MIDDLE, MIDDLE), update_mesh_stiffness=True
    )


def rotor(gear: dict[str, Any], support: dict[str, float], steel: Any) -> Any:
    """A shaft as thick as the bore, with its gear; either bearing has half of the support."""
    bore = 2.0 * gear["bore_radius"]
    shaft = [
        ross.ShaftElement(L=gear["width"], idl=0.0, odl=bore, material=steel)
        for _ in range(2)
    ]
    values = {name: value for name, value in gear.items() if name != "bore_radius"}
    disk = ross.GearElementTVMS(n=MIDDLE, material=steel, bore_diameter=bore, **values)
    half = {name: 0.5 * value for name, value in support.items()}
    return ross.Rotor(
        shaft, [disk], [ross.BearingElement(n=node, **half) for node in ENDS]
    )


def response(pair: Any, job: dict[str, Any], n_steps: int) -> Any:
    """ROSS's time response under the torques of both shafts, from rest."""
    times = np.arange(n_steps) / job["sampling_rate"]
    force = np.zeros((n_steps, pair.ndof))
    for gear, torque in (
        (pair.mesh.driving_gear, job["torque"]),
        (pair.mesh.driven_gear, -job["wheel_torque"]),
    ):
        force[:, list(gear.dof_global_index.values())[-1]] = torque
    return pair.run_time_response(job["speed"], force, times, method="newmark")


def timed(pair: Any, job: dict[str, Any], n_steps: int) -> float:
    """CPU seconds of one response."""
    start = time.process_time()
    result = response(pair, job, n_steps).yout
    spent = time.process_time() - start
    if not (
        np.all(np.isfinite(result))
        and np.ptp(result[:, pair.number_dof * MIDDLE + 1]) > 0.0
    ):
        raise ArithmeticError("ROSS's response is not finite, or nothing moves")
    return spent


if __name__ == "__main__":
    main()
