"""Force of one element of a linear line with torsional dampers, and the dampers that minimise it.

Dampers change the dynamic stiffness at their nodes only, so that a line is solved once for all of
them: with R the receptance between the nodes and D the dampers' dynamic stiffness, their torques
on the nodes are -(1 + D R)^-1 D q. Source: J. P. Den Hartog, Mechanical Vibrations (1956), 3.3;
H. N. Oezgueven, Structural modifications using frequency response functions, Mechanical Systems
and Signal Processing 4 (1990) 53-63.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array, Complex
from gensig.driveline.linear.dampers import TorsionalDamper
from gensig.driveline.linear.forced import (
    TURNS_PER_CYCLE,
    Elements,
    cycle_orders,
    over_cycle,
    steady_response,
)
from gensig.dynamics.linear_system import LinearSystem
from gensig.errors import ConfigError

LEAST_INERTIA = 0.05  # of the largest allowed: a smaller ring is no damper
# searched, of the ring on its spring; assumed: rubber has a loss factor of 0.1 and more
DAMPING_RATIOS = (0.05, 5.0)
# by which the rate damping over inertia of a viscous damper may leave the excited frequencies
RATE_MARGIN = 10.0
POPULATION, GENERATIONS = 10, 100  # per unknown, and at most
SETTLED = 1e-3  # of the population's spread; the simplex goes on from there


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NodeResponse:
    """Force of one element, and the motion of the nodes where dampers may sit, over speeds and
    orders.

    Parameters
    ----------
    nodes : (damper node,) numbers of the nodes
    frequency : (speed, order) rad/s
    mean : (speed,) N or N m           mean force of the element
    force : (speed, order)             its complex amplitudes without dampers
    angle : (speed, order, damper node) rad  of the nodes without dampers
    receptance : (speed, order, damper node, damper node) rad/(N m)
    transfer : (speed, order, damper node)   force of the element per torque on a node
    """

    nodes: tuple[int, ...]
    frequency: Array
    mean: Array
    force: Complex
    angle: Complex
    receptance: Complex
    transfer: Complex

    def force_with(self, dampers: Sequence[TorsionalDamper]) -> Complex:
        """Complex amplitudes of the element's force with dampers on some of the nodes, (speed,
        order).
        """
        stiffness = np.zeros((*self.frequency.shape, len(self.nodes)), dtype=complex)
        for damper in dampers:
            stiffness[..., self.nodes.index(damper.node)] += damper.dynamic_stiffness(
                self.frequency
            )
        matrix = np.eye(len(self.nodes)) + stiffness[..., :, None] * self.receptance
        torque = -np.linalg.solve(matrix, (stiffness * self.angle)[..., None])[..., 0]
        return self.force + np.sum(self.transfer * torque, axis=-1)

    def largest_force(
        self, dampers: Sequence[TorsionalDamper], *, n_points: int | None = None
    ) -> Array:
        """Largest force of the element over a cycle, whichever way it acts, (speed,) N or N m.

        ``n_points`` of the cycle; by default 8 a period of the highest order.
        """
        amplitudes = self.force_with(dampers)
        points = n_points or 8 * amplitudes.shape[-1]
        return np.abs(self.mean[:, None] + over_cycle(amplitudes, points)).max(axis=1)


def response_at_nodes(
    line: LinearSystem,
    elements: Elements,
    element: int,
    torques: Callable[[float], Array],
    speeds: Iterable[float],
    dof_of_node: dict[int, int],
    *,
    n_orders: int,
) -> NodeResponse:
    """Solve a line for its own torques and for unit torques on the nodes where dampers may sit.

    Parameters
    ----------
    element : index in ``elements``
    torques : gives the torques (dof, point) over the cycle at a speed in rad/s
    speeds : (speed,) rad/s
    dof_of_node : degree of freedom by node number
    n_orders : half orders taken
    """
    dofs = list(dof_of_node.values())
    direction = elements.directions[element]
    complex_stiffness = elements.stiffness[element] + 1j * elements.loss[element]
    frequency, mean, solved = [], [], []
    for speed in speeds:
        torque = torques(speed)
        amplitudes = cycle_orders(torque, n_orders)[1]
        frequency.append(speed * np.arange(1, n_orders + 1) / TURNS_PER_CYCLE)
        still = steady_response(line, torque, speed, n_orders=1)
        mean.append(float(elements.stiffness[element] * (direction @ still.twist)))
        loads = np.zeros((n_orders, len(direction), 1 + len(dofs)), dtype=complex)
        loads[:, :, 0] = amplitudes.T
        loads[:, dofs, np.arange(1, 1 + len(dofs))] = 1.0
        solved.append(np.linalg.solve(line.dynamic_stiffness(frequency[-1]), loads))
    response = np.array(solved)  # (speed, order, dof, load)
    carried = complex_stiffness * np.einsum("d,sodl->sol", direction, response)
    return NodeResponse(
        nodes=tuple(dof_of_node),
        frequency=np.array(frequency),
        mean=np.array(mean),
        force=carried[..., 0],
        angle=response[:, :, dofs, 0],
        receptance=response[:, :, dofs, 1:],
        transfer=carried[..., 1:],
    )


def tune_dampers(
    seen: NodeResponse,
    most_inertia: Sequence[float],
    *,
    viscous: bool = False,
    seed: int = 0,
) -> tuple[TorsionalDamper, ...]:
    """Dampers, one on each node, that make the largest force over all speeds least.

    Parameters
    ----------
    most_inertia : (damper node,) kg m2
        largest ring on each node; the smallest is a twentieth of it
    viscous : rings that the fluid alone holds, else by a spring too

    Notes
    -----
    Unknowns are the logarithms of inertia, frequency of the ring within the excited ones, and
    damping ratio; for viscous dampers inertia and the rate damping over inertia. The largest of
    many peaks has kinks and several minima: differential evolution (Storn & Price 1997), then a
    simplex (Nelder & Mead). The seed alone decides the path.

    Raises
    ------
    ConfigError    for an inertia that is not positive
    """
    from scipy.optimize import differential_evolution, minimize

    if len(most_inertia) != len(seen.nodes) or not all(
        0.0 < inertia < math.inf for inertia in most_inertia
    ):
        raise ConfigError(
            f"largest inertias {list(most_inertia)} kg m2: give a positive one for each damper"
        )
    bounds = _bounds(seen, most_inertia, viscous=viscous)

    def dampers(unknowns: Array) -> tuple[TorsionalDamper, ...]:
        rows = np.exp(np.reshape(unknowns, (len(seen.nodes), -1)))
        return tuple(map(_damper, seen.nodes, rows))

    def worst(unknowns: Array) -> float:
        return float(seen.largest_force(dampers(unknowns)).max())

    coarse = differential_evolution(
        worst,
        bounds,
        popsize=POPULATION,
        maxiter=GENERATIONS,
        tol=SETTLED,
        rng=seed,
        polish=False,
        init="sobol",
    )
    fine = minimize(
        worst,
        coarse.x,
        method="Nelder-Mead",
        bounds=bounds,
        options={"xatol": 1e-4, "fatol": 1e-9},
    )
    return dampers(min((fine, coarse), key=lambda result: result.fun).x)


def _bounds(
    seen: NodeResponse, most_inertia: Sequence[float], *, viscous: bool
) -> list[tuple[float, float]]:
    """Least and most of every unknown, logarithms."""
    low, high = float(seen.frequency.min()), float(seen.frequency.max())
    bounds = []
    for most in most_inertia:
        bounds.append((LEAST_INERTIA * most, most))
        if viscous:
            bounds.append((low / RATE_MARGIN, high * RATE_MARGIN))
        else:
            bounds += [(low, high), DAMPING_RATIOS]
    return [(math.log(least), math.log(most)) for least, most in bounds]


def _damper(node: int, row: Array) -> TorsionalDamper:
    """Of inertia and rate, or of inertia, own frequency and damping ratio."""
    inertia, frequency = float(row[0]), float(row[1])
    if len(row) == 2:
        return TorsionalDamper(
            node=node, ring_inertia=inertia, damping=inertia * frequency, stiffness=0.0
        )
    return TorsionalDamper(
        node=node,
        ring_inertia=inertia,
        damping=2.0 * float(row[2]) * inertia * frequency,
        stiffness=inertia * frequency**2,
    )
