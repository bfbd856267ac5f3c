"""Small geared lines, states of a line at its internal rate, and the law of one mesh at chosen
instants.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from benchmarks._phase_mesh import phase_table, plain_pair
from gensig.driveline.time import _layout as layout
from gensig.driveline.time._line_mesh_kernels import mesh_law
from gensig.driveline.time.line_arrays import pack_meshes
from gensig.driveline.time.newmark import LineMotion, LineSolver, _Run, _scratch
from gensig.dynamics.equations import (
    A_TURN,
    B_TURN,
    N_IN_PLANE,
    NONE,
    Equations,
    Mesh,
)
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.dynamics.motion.course import ShaftTorque, constant_speed
from gensig.dynamics.motion.dynamics import Dynamics

RADII, INERTIAS, TEETH = (0.05, 0.1), (0.01, 0.05), (20, 40)
STIFFNESS = 3e8  # N/m
# words that give a two-stage set the implicit method, at a rate that suits it
IMPLICIT = (
    "sensing=geared_line",
    "solver.backend=newmark",
    "solver.oversampling=12",
)


def line_of(system: Equations, names: Sequence[str] = (), **more) -> Dynamics:
    """A line that turns at 0 rad/s and feels nothing."""
    n = len(system.mass)
    return Dynamics(
        **{
            "dofs": tuple(names) or tuple(f"disc_{i}" for i in range(n)),
            "system": system,
            "nominal": constant_speed(0.0),
            "torques": (),
            "friction_torque": np.zeros(n),
            "reference_force": np.ones(len(system.meshes)),
            **more,
        }
    )


def bodies(
    mass: np.ndarray,
    stiffness: np.ndarray,
    damping: np.ndarray,
    rotation: np.ndarray,
    meshes: Sequence[Mesh] = (),
    **governor,
) -> Equations:
    """Bodies, springs and meshes; no governor unless one is given."""
    return Equations(
        mass=mass,
        stiffness=stiffness,
        damping=damping,
        rotation=rotation,
        **{"held": np.zeros(len(mass)), "held_damping": 0.0, **governor},
        meshes=tuple(meshes),
        sources=(),
        reference=int(np.argmin(np.abs(rotation - 1.0))),
        angles=(),
    )


def turning_mesh(teeth: MeshTeeth, damping: float = 0.0) -> Mesh:
    """A mesh between the first two bodies, which only turn."""
    pair = teeth.pair
    reach = np.zeros(N_IN_PLANE)
    reach[[A_TURN, B_TURN]] = pair.pinion.base_radius, -pair.wheel.base_radius
    return Mesh(
        name="pair",
        teeth=teeth,
        touched=np.array([NONE, NONE, 0, NONE, NONE, 1]),
        reach=reach,
        slide=np.zeros(N_IN_PLANE),
        stiffness=teeth.mean_stiffness(1.0),
        damping=damping,
        mean_force=1.0,
        speed=1.0,
    )


def two_gears(
    *,
    stiffness: np.ndarray | None = None,
    gap: np.ndarray | None = None,
    backlash: float = 0.0,
    damping: float = 0.0,
    drive: tuple[float, float] | None = None,
    **more,
) -> Dynamics:
    """Two inertias and one mesh between them; ``drive`` is a spring and a damper of the first to
    the nominal angle.
    """
    if stiffness is None:
        stiffness = np.full((1, 8), STIFFNESS)
    held, damped = np.zeros((2, 2, 2))
    if drive is not None:
        held[0, 0], damped[0, 0] = drive
    pair = replace(plain_pair(TEETH, RADII[0]), backlash=backlash)
    mesh = turning_mesh(MeshTeeth.perfect(phase_table(pair, stiffness, gap)), damping)
    system = bodies(np.array(INERTIAS), held, damped, np.array([1.0, 0.5]), [mesh])
    return line_of(system, ("first", "second"), **more)


def chain(n: int, *, loss: float = 2e-5, seed: int = 0) -> Dynamics:
    """A free chain of inertias without gears."""
    rng = np.random.default_rng(seed)
    stiffness = np.zeros((n, n))
    for i, value in enumerate(rng.uniform(1e4, 3e4, n - 1)):
        stiffness[[i, i + 1], [i, i + 1]] += value
        stiffness[[i, i + 1], [i + 1, i]] -= value
    mass = rng.uniform(0.01, 0.1, n)
    return line_of(bodies(mass, stiffness, loss * stiffness, np.ones(n)))


def constant_torques(values: np.ndarray) -> tuple[ShaftTorque, ...]:
    return tuple(
        ShaftTorque(dof=i, table=np.array([value])) for i, value in enumerate(values)
    )


def with_system(line: Dynamics, **changes) -> Dynamics:
    """The line with other numbers of its bodies, springs and meshes."""
    return replace(line, system=replace(line.system, **changes))


def state_after(
    line: Dynamics,
    start: tuple[np.ndarray, np.ndarray],
    duration: float,
    n_steps: int,
) -> tuple[np.ndarray, np.ndarray, LineMotion]:
    """q and v (dof,) after ``n_steps`` steps from time 0, and what the run tells of itself."""
    solver = LineSolver(
        sampling_rate=0.5 * n_steps / duration, oversampling=2, max_energy_residual=1e-3
    )
    run = _Run(line, solver, start, [])
    run.begin(0)
    run.skip(n_steps)
    motion = run.motion(np.empty((0, 0)), np.empty(0), np.empty(0))
    return *motion.end, motion


def law_at(
    mesh: Mesh,
    turned: float,
    approach: float,
    rate: float = 0.0,
    roll_rate: float = 0.0,
) -> np.ndarray:
    """Law of a mesh, (N_LAW,), when it has rolled so many pitches beyond its start phase."""
    n = int(mesh.touched.max()) + 1
    nothing = np.zeros((n, n))
    system = bodies(np.ones(n), nothing, nothing, np.ones(n), [mesh])
    law = np.zeros((1, layout.N_LAW))
    mesh_law(
        pack_meshes(system, np.arange(n)),
        0,
        mesh.teeth.start_phase + turned,
        roll_rate,
        approach,
        rate,
        law,
        _scratch(system),
    )
    return law[0]


def steps(sampling_rate: float, oversampling: int) -> LineSolver:
    return LineSolver(
        sampling_rate=sampling_rate, oversampling=oversampling, max_energy_residual=1e-3
    )


def order_of(errors: list[float], ratio: float = 2.0) -> float:
    """Measured order over all the halvings."""
    return math.log(errors[0] / errors[-1], ratio) / (len(errors) - 1)
