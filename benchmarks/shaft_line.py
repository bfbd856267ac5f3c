"""The engine's whole shaft line: how fast and how accurately by step. ``python -m
benchmarks.shaft_line``

109 degrees of freedom (65 rotations once rigid compounds are one, 44 lateral motions), 8
non-linear meshes, 51 torques over the angle. Errors are relative differences of a channel's
spectrum from 20 Hz to 4 kHz against a step four times as fine as the finest asked for, where no
tooth leaves its mate: where teeth rattle, points of time mean little.
"""

from __future__ import annotations

import argparse
import math
import time

import numpy as np

from benchmarks._engine_line import DRAG, END_GEARS, engine_line, engine_torques
from gensig.driveline.time.newmark import LineMotion, LineSolver, integrate_line
from gensig.dynamics.decimation import in_band_error
from gensig.dynamics.motion.course import ShaftTorque

SPEED = 1688.0 * math.pi / 30.0
RATE = 10240.0
CALM = (
    500.0,
    5.0,
)  # N m of the engine and of a pump cam, with loads on the ends of all branches
LEAD_IN = 0.02  # s, so that all steps begin in the same state
CHANNELS = [
    ("speed", 13),
    ("speed", 42),
    ("acceleration", 42),
    *[("mesh_force", mesh) for mesh in range(8)],
]


def engine_run(
    oversampling: int, duration: float, *, loaded: bool
) -> tuple[LineMotion, float]:
    """A motion of the engine, and the CPU seconds that it took.

    ``loaded`` teeth stay together, others rattle.
    """
    torques = engine_torques()
    if loaded:
        torques = engine_torques(*CALM) + [
            ShaftTorque(dof=dof, table=np.array([-DRAG])) for dof in END_GEARS
        ]
    line = engine_line(torques=torques, speed=SPEED)
    begin = time.process_time()
    motion = integrate_line(
        line,
        LineSolver(
            sampling_rate=RATE, oversampling=oversampling, max_energy_residual=1e-3
        ),
        duration=duration,
        channels=CHANNELS,
        lead_in=LEAD_IN,
    )
    return motion, time.process_time() - begin


def main() -> None:
    """Print one line a step."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--duration",
        type=float,
        default=10.0,
        help="simulated seconds of the timed runs",
    )
    parser.add_argument(
        "--checked",
        type=float,
        default=0.3,
        help="simulated seconds of the runs for the errors",
    )
    parser.add_argument(
        "--oversampling",
        type=int,
        nargs="+",
        default=[5, 10, 20],
        help="steps per sample",
    )
    words = parser.parse_args()
    engine_run(2, 0.01, loaded=False)  # compiles
    print(
        "step us | CPU s for",
        f"{words.duration:g} s | rounds | energy residual | largest share apart, on back flanks",
    )
    for oversampling in words.oversampling:
        motion, spent = engine_run(oversampling, words.duration, loaded=False)
        print(
            f"{1e6 / RATE / oversampling:7.2f} | {spent:14.2f} | {motion.newton_rounds:6.2f} | "
            f"{motion.energy_residual:15.1e} | {motion.contact_loss.max():.2f} "
            f"{motion.back_contact.max():.2f}"
        )
    finest = 4 * max(words.oversampling)
    exact, _ = engine_run(finest, words.checked, loaded=True)
    print(
        "step us | energy residual | error of",
        " ".join(f"{kind} {i}" for kind, i in CHANNELS),
    )
    for oversampling in words.oversampling:
        result, _ = engine_run(oversampling, words.checked, loaded=True)
        errors = [
            float(
                in_band_error(
                    result.signals[c][None, None], exact.signals[c][None, None], RATE
                )[0]
            )
            for c in CHANNELS
        ]
        told = " ".join(f"{error:.1e}" for error in errors)
        print(
            f"{1e6 / RATE / oversampling:7.2f} | {result.energy_residual:.1e} | {told}"
        )


if __name__ == "__main__":
    main()
