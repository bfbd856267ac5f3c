"""Small geared lines, states of a line at its internal rate, and the law of one mesh at chosen
instants.
"""

from __future__ import annotations

import math

import numpy as np

from benchmarks._phase_mesh import phase_mesh
from gensig.driveline.time import _layout as layout
from gensig.driveline.time._line_mesh_kernels import mesh_law
from gensig.driveline.time.course import LineCourse, ShaftTorque, constant_speed
from gensig.driveline.time.geared_line import GearedLine, pack_meshes
from gensig.driveline.time.line_mesh import LineMesh
from gensig.driveline.time.mesh_friction import MeshFriction, mesh_friction
from gensig.driveline.time.newmark import LineMotion, LineSolver, _Run, _scratch
from gensig.dynamics.pair import PairDynamics

RADII, INERTIAS, TEETH = (0.05, 0.1), (0.01, 0.05), (20, 40)
STIFFNESS = 3e8  # N/m
# words that give a two-stage set the implicit method, at a rate that suits it
IMPLICIT = (
    "sensing=geared_line",
    "solver.backend=newmark",
    "solver.oversampling=12",
)


def two_gears(
    *,
    stiffness: np.ndarray | None = None,
    damping: float = 0.0,
    drive: tuple[float, float] | None = None,
    **mesh,
) -> GearedLine:
    """Two inertias and one mesh between them; ``drive`` is a spring and a damper of the first to
    the nominal angle.
    """
    if stiffness is None:
        stiffness = np.full((1, 8), STIFFNESS)
    direction = np.array([RADII[0], -RADII[1]])
    held, damped = np.zeros((2, 2, 2))
    if drive is not None:
        held[0, 0], damped[0, 0] = drive
    one = phase_mesh(
        "pair",
        direction=direction,
        roll_dof=0,
        n_teeth=TEETH,
        stiffness=stiffness,
        damping=damping,
        **mesh,
    )
    return GearedLine(
        names=("first", "second"),
        mass=np.diag(INERTIAS),
        damping=damped,
        stiffness=held,
        rotation=np.array([1.0, 0.5]),
        meshes=(one,),
    )


def chain(n: int, *, loss: float = 2e-5, seed: int = 0) -> GearedLine:
    """A free chain of inertias without gears."""
    rng = np.random.default_rng(seed)
    stiffness = np.zeros((n, n))
    for i, value in enumerate(rng.uniform(1e4, 3e4, n - 1)):
        stiffness[[i, i + 1], [i, i + 1]] += value
        stiffness[[i, i + 1], [i + 1, i]] -= value
    return GearedLine(
        names=tuple(f"disc_{i}" for i in range(n)),
        mass=np.diag(rng.uniform(0.01, 0.1, n)),
        damping=loss * stiffness,
        stiffness=stiffness,
        rotation=np.ones(n),
        meshes=(),
    )


def pair_line(dynamics: PairDynamics, mesh: LineMesh) -> GearedLine:
    """A gear pair with its supports and drive as a line with one mesh."""
    system = dynamics.system()
    return GearedLine(
        names=system.names,
        mass=np.diag(system.mass),
        damping=system.damping,
        stiffness=system.stiffness,
        rotation=system.rotation,
        meshes=(mesh,),
    )


def pair_friction(dynamics: PairDynamics) -> MeshFriction:
    """The friction of a gear pair, whose pinion turns against its frame."""
    return mesh_friction(
        dynamics.table,
        dynamics.approach_direction(),
        range(6),
        dynamics.system().rotation,
        -1.0,
    )


def constant_torques(values: np.ndarray) -> list[ShaftTorque]:
    return [
        ShaftTorque(dof=i, table=np.array([value])) for i, value in enumerate(values)
    ]


def state_after(
    line: GearedLine,
    start: tuple[np.ndarray, np.ndarray],
    duration: float,
    n_steps: int,
    *,
    torques: list[ShaftTorque] | None = None,
    course: LineCourse | None = None,
) -> tuple[np.ndarray, np.ndarray, LineMotion]:
    """q and v (dof,) after ``n_steps`` steps from time 0, and what the run tells of itself."""
    solver = LineSolver(
        sampling_rate=0.5 * n_steps / duration, oversampling=2, max_energy_residual=1e-3
    )
    run = _Run(line, course or constant_speed(0.0), torques or [], solver, start, [])
    run.begin(0)
    run.skip(n_steps)
    motion = run.motion(np.empty((0, 0)), np.empty(0), np.empty(0))
    return *motion.end, motion


def law_at(
    mesh: LineMesh,
    turned: float,
    approach: float,
    rate: float = 0.0,
    roll_rate: float = 0.0,
) -> np.ndarray:
    """Law of a mesh, (N_LAW,), when it has rolled so many pitches beyond its start phase."""
    n = len(mesh.direction)
    line = GearedLine(
        names=tuple(map(str, range(n))),
        mass=np.eye(n),
        damping=np.zeros((n, n)),
        stiffness=np.zeros((n, n)),
        rotation=np.where(np.arange(n) == mesh.roll_dof, 1.0, 0.0),
        meshes=(),
    )
    with_mesh = _Unchecked(line, mesh)
    law = np.zeros((1, layout.N_LAW))
    mesh_law(
        pack_meshes(with_mesh, np.arange(n)),
        0,
        mesh.start_phase + turned,
        roll_rate,
        approach,
        rate,
        law,
        _scratch(with_mesh),
    )
    return law[0]


class _Unchecked:
    """A line of one mesh whose kinematics do not matter."""

    def __init__(self, line: GearedLine, mesh: LineMesh) -> None:
        self.names, self.rotation, self.meshes = line.names, line.rotation, (mesh,)


def steps(sampling_rate: float, oversampling: int) -> LineSolver:
    return LineSolver(
        sampling_rate=sampling_rate, oversampling=oversampling, max_energy_residual=1e-3
    )


def order_of(errors: list[float], ratio: float = 2.0) -> float:
    """Measured order over all the halvings."""
    return math.log(errors[0] / errors[-1], ratio) / (len(errors) - 1)
