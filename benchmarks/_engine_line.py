"""The engine of the timing-gear paper as plain arrays, its meshes non-linear: the shaft-line
integrator is timed on it.

Table A1 of Sun et al., J. Vib. Eng. 37 (2024) 1969, as printed, with true speed ratios.
Assumed: supports, backlash, damping, the ripple of mesh stiffness, torques.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks._phase_mesh import phase_table, plain_pair
from gensig.dynamics.equations import (
    A_TURN,
    A_X,
    A_Y,
    B_TURN,
    B_X,
    B_Y,
    N_IN_PLANE,
    NONE,
    Equations,
    Mesh,
)
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.dynamics.motion.course import ShaftTorque, constant_speed
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.geometry.contact import GearPair

Array = NDArray[np.float64]

CAMS = [0.005, *[0.0021] * 9]
INERTIA = [
    1.042,
    0.492,
    0.181,
    1.706,
    1.507,
    0.927,
    1.507,
    1.507,
    1.507,
    1.507,
    0.927,
    1.507,
    1.706,
    11.94,
    8.622,
    17.1,
    75.0,
    0.01914,
    0.00483,
    0.03876,
    0.01544,
    *CAMS,
    0.02945,
    *CAMS,
    0.0065,
    0.00648,
    0.01138,
    *[0.0002] * 7,
    0.00037,
    0.00037,
    *[0.0002] * 10,
    0.00034,
    0.04523,
    0.00483,
]  # kg m2, nodes 1 to 67
SHAFTS = [
    *zip(
        range(1, 17), [100, 100, 10.42, *[8.35] * 9, 12.66, 25, 0.96, 25], strict=True
    ),
    (21, 0.18),
    *[(i, 0.2) for i in range(22, 31)],
    (32, 0.18),
    *[(i, 0.2) for i in range(33, 42)],
    (45, 0.29),
    *[(i, 1.1) for i in range(46, 53)],
    (53, 0.15),
    *[(i, 1.1) for i in range(54, 65)],
]  # MN m/rad, from a node to the next
RIGID = ((18, 19), (20, 21))
MESHES = (
    (3, 18, 59, 59, 18.0, 3.31),
    (19, 20, 33, 66, 18.0, 2.18),
    (19, 32, 33, 66, 18.0, 3.23),
    (20, 43, 66, 41, 18.0, 2.64),
    (32, 44, 66, 41, 18.0, 2.4),
    (21, 45, 54, 54, 0.0, 1.74),
    (3, 66, 59, 68, 18.0, 3.6),
    (66, 67, 68, 40, 18.0, 2.6),
)  # driver, driven, teeth, helix angle in degrees, MN m/rad
MASS = {
    3: 4.2608,
    66: 6.851,
    67: 2.0185,
    18: 3.3467,
    19: 2.5686,
    45: 2.7469,
    20: 6.0784,
    21: 3.8131,
    43: 2.4102,
    32: 4.5783,
    44: 2.4033,
}  # kg
MODULE, PRESSURE_ANGLE = 3e-3, math.radians(20.0)
SUPPORT, SUPPORT_RATIO = 5e8, 0.03  # N/m and damping ratio, assumed
LOSS_FACTOR, LOSS_AT = (
    0.03,
    2.0 * math.pi * 100.0,
)  # of shafts, made viscous at an assumed frequency
BACKLASH, MESH_DAMPING = 1.5e-4, 2e-4  # m and s/m, assumed
RIPPLE = (0.1, 0.03, 0.01)  # of mesh stiffness: shares of its first harmonics, assumed
HOUSING_MASS = 20.0  # kg, what each bearing carries along, assumed
END_GEARS, DRAG = (
    (28, 39, 40, 41, 62, 64),
    40.0,
)  # places of the ends of the branches in the line; N m, assumed


def engine_pair(z_a: int, z_b: int, helix: float) -> GearPair:
    """Two gears of the engine's module; helix angle in degrees."""
    angle = math.radians(helix)
    across = math.atan(math.tan(PRESSURE_ANGLE) / math.cos(angle))
    base_radius = 0.5 * z_a * MODULE / math.cos(angle) * math.cos(across)
    return plain_pair((z_a, z_b), base_radius, angle)


def engine_line(
    *,
    lateral: bool = True,
    linear: bool = False,
    torques: Sequence[ShaftTorque] = (),
    speed: float = 0.0,
) -> Dynamics:
    """The whole line, rigid compounds merged: 65 rotations, and 44 lateral motions of 11 gears on
    their bearings.

    ``linear`` meshes have no backlash and do not ripple, so that the natural frequencies are
    those of the table.
    """
    merged = {second: first for first, second in RIGID}
    nodes = [node for node in range(1, 68) if node not in merged]
    at_of = {node: nodes.index(merged.get(node, node)) for node in range(1, 68)}
    n = len(nodes) + (4 * len(MASS) if lateral else 0)
    mass, damping, stiffness = np.zeros((3, n, n))
    for node, inertia in enumerate(INERTIA, start=1):
        mass[at_of[node], at_of[node]] += inertia
    for node, value in SHAFTS:
        _spring(stiffness, at_of[node], at_of[node + 1], value * 1e6)
    damping[:] = LOSS_FACTOR / LOSS_AT * stiffness
    names, side_of = [f"node_{node}" for node in nodes], {}
    for i, (node, weight) in enumerate(MASS.items() if lateral else ()):
        x = len(nodes) + 4 * i  # gear x, gear y, bearing x, bearing y
        side_of[node] = x
        names += [
            f"{part}_{node}_{axis}" for part in ("gear", "bearing") for axis in "xy"
        ]
        for axis in range(2):
            gear, bearing = x + axis, x + 2 + axis
            mass[gear, gear], mass[bearing, bearing] = weight, HOUSING_MASS
            for matrix, value in (
                (stiffness, SUPPORT),
                (damping, 2.0 * SUPPORT_RATIO * math.sqrt(SUPPORT * weight)),
            ):
                _spring(matrix, gear, bearing, value)
                matrix[bearing, bearing] += value
    rotation, meshes = np.zeros(n), []
    rotation[: at_of[18]] = 1.0
    for driver, driven, z_a, z_b, helix, value in sorted(
        MESHES, key=lambda mesh: (mesh[0] > 21, mesh[0], mesh[1])
    ):
        a, b = at_of[driver], at_of[driven]
        pair = engine_pair(z_a, z_b, helix)
        radii = pair.pinion.base_radius, pair.wheel.base_radius
        rotation[b] = -rotation[a] * z_a / z_b
        touched = np.array([NONE, NONE, a, NONE, NONE, b])
        reach = np.zeros(N_IN_PLANE)
        reach[[A_TURN, B_TURN]] = np.copysign(radii, rotation[a])
        if lateral:  # lines of action lie at assumed angles
            angle = 0.7 * len(meshes)
            along = math.cos(angle), math.sin(angle)
            touched[[A_X, A_Y]] = side_of[driver], side_of[driver] + 1
            touched[[B_X, B_Y]] = side_of[driven], side_of[driven] + 1
            reach[[A_X, A_Y]], reach[[B_X, B_Y]] = along, np.negative(along)
        teeth = _teeth(pair, value * 1e6 / (radii[0] * radii[1]), linear)
        meshes.append(
            Mesh(
                name=f"{driver}-{driven}",
                teeth=teeth,
                touched=touched,
                reach=reach,
                slide=np.zeros(N_IN_PLANE),
                stiffness=teeth.mean_stiffness(1.0),
                damping=MESH_DAMPING * (not linear),
                mean_force=1.0,
                speed=abs(rotation[a]) * speed,
            )
        )
    for node, _ in SHAFTS:  # camshafts and pump shafts turn with their gear
        if rotation[at_of[node + 1]] == 0.0:
            rotation[at_of[node + 1]] = rotation[at_of[node]]
    system = Equations(
        mass=np.diag(mass),
        damping=damping,
        stiffness=stiffness,
        rotation=rotation,
        held=np.zeros(n),
        held_damping=0.0,
        meshes=tuple(meshes),
        sources=(),
        reference=0,
        angles=(),
    )
    return Dynamics(
        dofs=tuple(names),
        system=system,
        nominal=constant_speed(speed),
        torques=tuple(torques),
        friction_torque=np.zeros(n),
        reference_force=np.ones(len(meshes)),
    )


def engine_torques(mean: float = 5e3, pulse: float = 30.0) -> list[ShaftTorque]:
    """Pulses on ten throws and on pump and valve cams, N m over two turns of the crank, against
    the dynamometer.
    """
    angle = np.linspace(0.0, 4.0 * math.pi, 720, endpoint=False)
    gas = (
        6.0
        * mean
        / 10.0
        * np.exp(-0.5 * (((angle - 2.0 * math.pi) % (4.0 * math.pi) - 0.6) / 0.35) ** 2)
    )
    gas *= 0.1 * mean / gas.mean()
    torques = [
        ShaftTorque(
            dof=3 + i,
            table=gas,
            period=4.0 * math.pi,
            phase=(7 * i % 10) * 0.4 * math.pi,
        )
        for i in range(10)
    ]
    cam = (
        -pulse
        * np.clip(
            np.sin(np.linspace(0.0, 2.0 * math.pi, 360, endpoint=False)), 0.0, None
        )
        ** 2
    )
    for i, dof in enumerate([*range(19, 29), *range(30, 40), *range(43, 63)]):
        torques.append(ShaftTorque(dof=dof, table=cam, phase=0.3 * math.pi * i))
    return [
        *torques,
        ShaftTorque(dof=16, table=np.array([-mean + 40 * 0.5 * 0.25 * pulse])),
    ]


def _teeth(pair: GearPair, stiffness: float, linear: bool) -> MeshTeeth:
    """Teeth whose stiffness ripples, or not."""
    ripple = np.zeros(64)
    if not linear:
        pair = replace(pair, backlash=BACKLASH)
        u = np.arange(len(ripple)) / len(ripple)
        for i, share in enumerate(RIPPLE):
            ripple += share * np.cos(2.0 * math.pi * (i + 1) * u + i)
    return MeshTeeth.perfect(phase_table(pair, stiffness * (1.0 + ripple)[None]))


def _spring(matrix: Array, one: int, other: int, value: float) -> None:
    matrix[[one, other], [one, other]] += value
    matrix[[one, other], [other, one]] -= value
