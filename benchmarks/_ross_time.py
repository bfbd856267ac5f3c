"""Time of ROSS's response of the 23/84 pair.

It is stored, so that it can be shown where ROSS is not installed.
Stored with it is the rate of the scalar Numba code in the same run: the quotient of both is
what carries over to another machine.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from benchmarks import _gensig_values as ours
from benchmarks import _rates
from benchmarks._measure import machine

STORED = Path(__file__).with_name("ross_time.json")
PAIR, DURATION, RUNS = "23/84", 0.02, 3  # s
MACHINE = (
    "cpu_model",
    "cpu_target",
    "load_at_start",
    "created",
    "python",
    "numpy",
    "numba",
)
OVERSAMPLING = 5  # of the scalar code; ROSS takes one step a sample


def job() -> dict[str, Any]:
    """Values of the pair that ``_ross_time_response`` needs, SI."""
    system = ours.machine(PAIR)
    bodies = {"pinion": system.pinion.support, "wheel": system.wheel.support}
    supports = {
        name: {
            "kxx": one.stiffness_x,
            "kyy": one.stiffness_y,
            "cxx": one.damping_x,
            "cyy": one.damping_y,
        }
        for name, one in bodies.items()
    }
    values = ours.job(system)
    return {
        **{
            key: values[key]
            for key in ("gears", "youngs_modulus", "poisson_ratio", "density")
        },
        "supports": supports,
        "torque": system.operating.torque,
        "wheel_torque": system.operating.torque * system.pair.ratio,
        "speed": system.operating.speed,
        "sampling_rate": system.sensing.sampling_rate,
        "duration": DURATION,
        "runs": RUNS,
    }


def store(told: dict[str, Any]) -> None:
    """Keep what ROSS took, with what the scalar code takes here and now."""
    scalar = _rates.rates(
        {"": _rates.scalar(_rates.machines(n=8), OVERSAMPLING)}, 5 * RUNS
    )[""]
    result = {
        **told,
        "ross_simulated_s_per_core_s": told["simulated_s"] / told["cpu_s"],
        "scalar_simulated_s_per_core_s": scalar,
        **{name: value for name, value in machine().items() if name in MACHINE},
    }
    STORED.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


def stored() -> dict[str, Any] | None:
    """Latest stored result, None where there is none."""
    return json.loads(STORED.read_text(encoding="utf-8")) if STORED.exists() else None


def stored_rate() -> float | None:
    """Rate of ROSS as a share of that of the scalar code, None where ROSS never ran."""
    result = stored()
    return (
        None
        if result is None
        else result["ross_simulated_s_per_core_s"]
        / result["scalar_simulated_s_per_core_s"]
    )


def lines() -> list[str]:
    """Stored result in words."""
    result = stored()
    if result is None:
        return ["ROSS's time response was never timed here."]
    rate, scalar = (
        result["ross_simulated_s_per_core_s"],
        result["scalar_simulated_s_per_core_s"],
    )
    return [
        f"ROSS {result['ross_version']}, run_time_response with TVMS gears: "
        f"{result['n_dof']} degrees of freedom, "
        f"Newmark's method, one step a sample at 51.2 kHz",
        f"{result['cpu_s']:.3g} CPU s for {result['simulated_s']:.3g} s: {rate:.3g} "
        "simulated s per core-s; scalar Numba "
        f"RK4 x{OVERSAMPLING} in the same run {scalar:.3g}, {scalar / rate:.3g} times as many",
        (
            f"on {result['cpu_model']} ({result['cpu_target']}), load {result['load_at_start']} "
            f"after it, {result['created']}"
        ),
    ]
