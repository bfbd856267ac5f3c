"""Steady vibration of a linear shaft line under torques that repeat with the cycle of an engine,
by orders.

Orders are multiples of the crank's speed; a four-stroke cycle has the half orders 0.5, 1, 1.5,
... Damping is a loss factor in the stiffness, viscous, or both. E. J. Nestorides, A Handbook on
Torsional Vibration (1958); D. J. Ewins, Modal Testing (2000), section 2.4 (complex stiffness).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gensig.arrays import Array, Complex
from gensig.driveline.linear.matrices import LineMatrices
from gensig.dynamics.linear_system import LinearSystem
from gensig.errors import SimulationError

TURNS_PER_CYCLE = 2
USUAL_ORDERS = 200  # half orders: up to order 100
UNBALANCED = 1e-6  # of the largest mean torque, that a free line may be left with
RIGID = 1e-9  # of the largest stiffness eigenvalue: nothing holds such a motion


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Elements:
    """Springs between degrees of freedom: shafts, couplings and meshes.

    ``directions`` (element, dof) give an element's deflection, ``stiffness`` and ``loss``
    (element,) its stiffness and the imaginary part of it. A torsional element has rad and N
    m/rad; a mesh along its line of action m and N/m.
    """

    directions: Array
    stiffness: Array
    loss: Array

    def stiffness_matrix(self) -> Array:
        """Sum of stiffness times d d^T, (dof, dof)."""
        return (self.directions.T * self.stiffness) @ self.directions

    def loss_matrix(self) -> Array:
        """Its imaginary part, (dof, dof)."""
        return (self.directions.T * self.loss) @ self.directions


def closed_line(matrices: LineMatrices) -> tuple[LinearSystem, Elements]:
    """A line whose meshes never lose contact, each a spring of its stiffness, and those meshes."""
    meshes = Elements(
        directions=matrices.directions,
        stiffness=matrices.mesh_stiffness,
        loss=matrices.mesh_loss_factor * matrices.mesh_stiffness,
    )
    dampers = (matrices.directions.T * matrices.mesh_damping) @ matrices.directions
    line = LinearSystem(
        mass=matrices.mass,
        stiffness=matrices.stiffness + meshes.stiffness_matrix(),
        loss=matrices.loss_stiffness + meshes.loss_matrix(),
        damping=matrices.damping + dampers,
    )
    return line, meshes


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SteadyResponse:
    """Steady vibration at one speed (rad/s) of the crank.

    ``orders`` (order,) are 0.5, 1, ...; ``angle`` (dof, order) rad complex amplitudes, so that
    the deviation from even rotation is Re sum angle exp(i order a) over the crank angle a.
    ``twist`` (dof,) rad is what the mean torques add, 0 in the mean weighted with mass over the
    motions that nothing holds.
    """

    speed: float
    orders: Array
    angle: Complex
    twist: Array

    @property
    def speed_deviation(self) -> Complex:
        """Complex amplitudes of the speed, (dof, order) rad/s."""
        return 1j * self.speed * self.orders * self.angle

    def speed_over_cycle(self, n_points: int) -> Array:
        """Deviation of the speed from its mean over the cycle, (dof, point) rad/s."""
        return over_cycle(self.speed_deviation, n_points)

    def fluctuation(self) -> Array:
        """Half the peak to peak of the speed over the cycle, (dof,) rad/s.

        What is printed as plus or minus.
        """
        return 0.5 * np.ptp(self.speed_over_cycle(32 * len(self.orders)), axis=1)

    def element_forces(self, elements: Elements) -> tuple[Array, Complex]:
        """Mean (element,) and complex amplitudes (element, order) of what the elements carry, N m
        or N.
        """
        complex_stiffness = elements.stiffness + 1j * elements.loss
        return (
            elements.stiffness * (elements.directions @ self.twist),
            complex_stiffness[:, None] * (elements.directions @ self.angle),
        )


def over_cycle(amplitudes: Complex, n_points: int) -> Array:
    """Values over the cycle, (..., point), of complex amplitudes at orders 0.5, 1, ..., (...,
    order).

    Raises
    ------
    ValueError    for too few points to hold the highest order
    """
    n_orders = amplitudes.shape[-1]
    if n_points <= 2 * n_orders:
        raise ValueError(
            f"{n_points} points of a cycle cannot hold {n_orders} orders; more than "
            f"{2 * n_orders} can"
        )
    spectrum = np.zeros((*amplitudes.shape[:-1], n_points // 2 + 1), dtype=complex)
    spectrum[..., 1 : n_orders + 1] = 0.5 * n_points * amplitudes
    return np.fft.irfft(spectrum, n_points, axis=-1)


def cycle_orders(torque: Array, n_orders: int) -> tuple[Array, Complex]:
    """Mean (...,) and complex amplitudes (..., order) at orders 0.5, 1, ... of a torque over the
    cycle, (..., point).

    Raises
    ------
    ValueError    for more orders than the points hold
    """
    n_points = torque.shape[-1]
    if not 1 <= n_orders < n_points / 2:
        raise ValueError(
            f"n_orders = {n_orders} must lie in 1..{(n_points - 1) // 2}: there are "
            f"{n_points} points"
        )
    spectrum = np.fft.rfft(torque, axis=-1) / n_points
    return spectrum[..., 0].real, 2.0 * spectrum[..., 1 : n_orders + 1]


def steady_response(
    line: LinearSystem, torque: Array, speed: float, *, n_orders: int = USUAL_ORDERS
) -> SteadyResponse:
    """Steady vibration of a line under torques over the cycle.

    Parameters
    ----------
    torque : (dof, point) N m    over two turns of the crank, from angle 0
    speed : rad/s                of the crank
    n_orders : half orders taken; 200 reach order 100, where injection pulses end

    Raises
    ------
    SimulationError    where the mean torques of a free line do not balance: it would not turn
        steadily
    """
    if not speed > 0.0:
        raise ValueError(f"the speed, {speed:g} rad/s, must be positive")
    mean, amplitudes = cycle_orders(torque, n_orders)
    orders = np.arange(1, n_orders + 1) / TURNS_PER_CYCLE
    angle = line.response(amplitudes.T, orders * speed).T
    return SteadyResponse(
        speed=speed, orders=orders, angle=angle, twist=_mean_twist(line, mean)
    )


def disturbance_response(
    line: LinearSystem, dof: int, torque: float, frequency: float
) -> Complex:
    """Complex amplitudes, (dof,) rad, of a torque (N m) of a frequency (rad/s) of its own on one
    degree of freedom.
    """
    force = np.zeros((1, len(line.mass)), dtype=complex)
    force[0, dof] = torque
    return line.response(force, np.array([frequency]))[0]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Waterfall:
    """Amplitudes of one degree of freedom over a run of speeds.

    ``speeds`` (speed,) rad/s; ``orders`` (order,); ``angle`` (speed, order) rad; ``fluctuation``
    (speed,) rad/s.
    """

    speeds: Array
    orders: Array
    angle: Array
    fluctuation: Array

    def spectra(self, frequencies: Array) -> Array:
        """Angular-displacement spectra, (speed, frequency) rad, on even frequencies in Hz.

        Each line in its bin.
        """
        step = frequencies[1] - frequencies[0]
        out = np.zeros((len(self.speeds), len(frequencies)))
        for row, speed, amplitudes in zip(out, self.speeds, self.angle, strict=True):
            bins = np.rint(
                (self.orders * speed / (2.0 * math.pi) - frequencies[0]) / step
            ).astype(int)
            inside = (bins >= 0) & (bins < len(frequencies))
            np.maximum.at(row, bins[inside], amplitudes[inside])
        return out


def run_of_speeds(
    line: LinearSystem,
    torques: Callable[[float], Array],
    speeds: Iterable[float],
    dofs: Sequence[int],
    *,
    n_orders: int = USUAL_ORDERS,
) -> list[Waterfall]:
    """Steady vibration at each of a run of speeds, one waterfall for each degree of freedom asked.

    Parameters
    ----------
    torques : gives the torques (dof, point) at a speed
    speeds : (speed,) rad/s

    Notes
    -----
    Steady at every speed: a run-up that is slow against the line's decay. Up and down are then
    the same.
    """
    responses = [
        steady_response(line, torques(speed), speed, n_orders=n_orders)
        for speed in speeds
    ]
    if not responses:
        raise ValueError("no speed is given")
    angle = np.array([response.angle for response in responses])
    fluctuation = np.array([response.fluctuation() for response in responses])
    return [
        Waterfall(
            speeds=np.array([response.speed for response in responses]),
            orders=responses[0].orders,
            angle=np.abs(angle[:, dof]),
            fluctuation=fluctuation[:, dof],
        )
        for dof in dofs
    ]


@lru_cache(maxsize=4)
def _statics(line: LinearSystem) -> tuple[Array, Array]:
    """Eigenvalues and vectors of the stiffness, kept for the next speed."""
    values, vectors = np.linalg.eigh(line.stiffness)
    return values, vectors


def _mean_twist(line: LinearSystem, mean: Array) -> Array:
    """Static deflection under mean torques that balance over the motions which nothing holds."""
    values, vectors = _statics(line)
    held = values > RIGID * values[-1]
    rest = vectors[:, ~held].T @ mean
    if rest.size and np.max(np.abs(rest)) > UNBALANCED * max(
        float(np.max(np.abs(mean))), 1e-300
    ):
        raise SimulationError(
            f"the mean torques leave {np.max(np.abs(rest)):.4g} N m on a line that "
            "nothing holds; balance them"
        )
    twist = vectors[:, held] @ ((vectors[:, held].T @ mean) / values[held])
    free = vectors[:, ~held]
    if free.size:
        twist = twist - free @ np.linalg.solve(
            free.T @ line.mass @ free, free.T @ (line.mass @ twist)
        )
    return twist
