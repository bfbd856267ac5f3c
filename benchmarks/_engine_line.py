"""The engine of the timing-gear paper as plain arrays, its meshes non-linear: the shaft-line
integrator is timed on it.

Table A1 of Sun et al., J. Vib. Eng. 37 (2024) 1969, as printed, with true speed ratios.
Assumed: supports, backlash, damping, the ripple of mesh stiffness, torques.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from benchmarks._phase_mesh import phase_mesh
from gensig.driveline.time.course import ShaftTorque
from gensig.driveline.time.geared_line import GearedLine
from gensig.driveline.time.line_mesh import LineMesh

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


def base_radius(n_teeth: int, helix_angle: float) -> float:
    """Base radius in m of a gear with a helix angle in degrees."""
    helix = math.radians(helix_angle)
    transverse = math.atan(math.tan(PRESSURE_ANGLE) / math.cos(helix))
    return 0.5 * n_teeth * MODULE / math.cos(helix) * math.cos(transverse)


def engine_line(*, lateral: bool = True, linear: bool = False) -> GearedLine:
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
        radii = base_radius(z_a, helix), base_radius(z_b, helix)
        rotation[b] = -rotation[a] * z_a / z_b
        direction = np.zeros(n)
        direction[a], direction[b] = (
            math.copysign(radii[0], rotation[a]),
            math.copysign(radii[1], rotation[a]),
        )
        if lateral:  # lines of action lie at assumed angles
            angle = 0.7 * len(meshes)
            for node, sign in ((driver, 1.0), (driven, -1.0)):
                direction[side_of[node] : side_of[node] + 2] = (
                    sign * math.cos(angle),
                    sign * math.sin(angle),
                )
        meshes.append(
            _mesh(
                f"{driver}-{driven}",
                direction,
                a,
                (z_a, z_b),
                value * 1e6 / (radii[0] * radii[1]),
                linear,
            )
        )
    for node, _ in SHAFTS:  # camshafts and pump shafts turn with their gear
        if rotation[at_of[node + 1]] == 0.0:
            rotation[at_of[node + 1]] = rotation[at_of[node]]
    return GearedLine(
        names=tuple(names),
        mass=mass,
        damping=damping,
        stiffness=stiffness,
        rotation=rotation,
        meshes=tuple(meshes),
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


def _mesh(
    name: str,
    direction: Array,
    a: int,
    n_teeth: tuple[int, int],
    stiffness: float,
    linear: bool,
) -> LineMesh:
    u = np.arange(64) / 64
    ripple = sum(
        share * np.cos(2.0 * math.pi * (i + 1) * u + i)
        for i, share in enumerate(RIPPLE)
    )
    return phase_mesh(
        name,
        direction=direction,
        roll_dof=a,
        n_teeth=n_teeth,
        stiffness=stiffness * np.ones((1, 64))
        if linear
        else stiffness * (1.0 + ripple)[None],
        backlash=0.0 if linear else BACKLASH,
        damping=0.0 if linear else MESH_DAMPING,
    )


def _spring(matrix: Array, one: int, other: int, value: float) -> None:
    matrix[[one, other], [one, other]] += value
    matrix[[one, other], [other, one]] -= value
