"""Deep-groove ball bearings under a radial load, and the support of a gear by two and a shaft."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError, SimulationError
from gensig.material import Material
from gensig.units import from_si, unit

CAGE_POSITIONS = (
    64  # over half of the angle between two balls, the other half mirrors it
)
MOST_STEPS = 200
BALANCED = 1e-10  # of the load
# of a loaded ball's stiffness; keeps a Newton step finite where one ball alone carries the load
SOFTEST = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class BallBearing:
    """A deep-groove ball bearing that carries no thrust, so that its contact angle is 0.

    The conformities are the radii of the grooves' cross sections over the ball's diameter.
    ``radial_clearance`` is the play of one ring across the other, from stop to stop, mounted and
    warm; negative is preload. Balls and rings are of the gears' material, the rings round and
    rigid but for the contacts.
    """

    n_balls: int
    ball_diameter: float = unit("mm")
    pitch_diameter: float = unit("mm")
    inner_groove_conformity: float
    outer_groove_conformity: float
    radial_clearance: float = unit("um")

    def __post_init__(self) -> None:
        if not 5 <= self.n_balls <= 60:
            raise ConfigError(f"bearing.n_balls = {self.n_balls} must lie in 5..60")
        if not self.ball_diameter > 0.0:
            diameter = from_si("ball_diameter_mm", self.ball_diameter)
            raise ConfigError(
                f"bearing.ball_diameter_mm = {diameter:g} must be positive"
            )
        least = self.ball_diameter / math.sin(math.pi / self.n_balls)
        if not self.pitch_diameter > least:
            diameter = from_si("pitch_diameter_mm", self.pitch_diameter)
            raise ConfigError(
                f"bearing.pitch_diameter_mm = {diameter:g}: {self.n_balls} balls of this size "
                f"touch each other; give more than {from_si('pitch_diameter_mm', least):.4g}"
            )
        for key in ("inner_groove_conformity", "outer_groove_conformity"):
            if not 0.505 <= getattr(self, key) <= 0.6:
                raise ConfigError(
                    f"bearing.{key} = {getattr(self, key):g} must lie in 0.505..0.6"
                )
        if not -20e-6 <= self.radial_clearance <= 100e-6:
            clearance = from_si("radial_clearance_um", self.radial_clearance)
            raise ConfigError(
                f"bearing.radial_clearance_um = {clearance:g} must lie in -20..100"
            )

    def groove_curvatures(self, race: str) -> tuple[float, float, float, float]:
        """Principal curvatures 1/m of the ball (twice), then of the groove along and across.

        ``race`` is "inner" or "outer".

        Source: Harris, Rolling Bearing Analysis, 4th ed., section 2.4, with contact angle 0: the
        groove's curvature along the race is 2 / (d_m - D) inside and -2 / (d_m + D) outside,
        across it -1 / (f D).
        """
        ball = 2.0 / self.ball_diameter
        sign, conformity = 1.0, self.inner_groove_conformity
        if race == "outer":
            sign, conformity = -1.0, self.outer_groove_conformity
        along = sign * 2.0 / (self.pitch_diameter - sign * self.ball_diameter)
        return ball, ball, along, -1.0 / (conformity * self.ball_diameter)


@dataclass(frozen=True, slots=True, kw_only=True)
class Shaft:
    """A round shaft of the gears' material, with a bearing at each end of ``span``.

    The gear is in the middle.
    """

    diameter: float = unit("mm")
    span: float = unit("mm")

    def __post_init__(self) -> None:
        for key in ("diameter_mm", "span_mm"):
            value = from_si(key, getattr(self, key.removesuffix("_mm")))
            if not value > 0.0:
                raise ConfigError(f"shaft.{key} = {value:g} must be positive")

    def bending_stiffness(self, youngs_modulus: float) -> float:
        """Force over deflection in the middle of a simply supported beam, N/m.

        48 E I / L^3 with I = pi d^4 / 64.
        """
        return 0.75 * math.pi * youngs_modulus * self.diameter**4 / self.span**3


def point_contact_coefficient(
    curvatures: tuple[float, float, float, float], material: Material
) -> float:
    """K of Q = K delta^1.5 for two bodies of one material in Hertzian point contact, N/m^1.5.

    Parameters
    ----------
    curvatures : 1/m    of the first body, then of the second, with coinciding principal planes,
        in the same order of planes; concave is negative

    Source: Harris, Rolling Bearing Analysis, 4th ed., section 6.3: the ellipticity kappa solves
    F(rho) = ((kappa^2 + 1) E - 2 K) / ((kappa^2 - 1) E) with the complete elliptic integrals of
    modulus 1 - 1 / kappa^2, and delta = delta* (3 Q (1 - nu^2) / (E' sum rho))^(2/3) sum rho / 2
    with delta* = (2 K / pi) (pi / (2 kappa^2 E))^(1/3). Solved exactly, no fit.
    """
    along, across = curvatures[0] + curvatures[2], curvatures[1] + curvatures[3]
    total = along + across
    ellipticity = _ellipticity(abs(along - across) / total)
    first, second = _elliptic_integrals(ellipticity)
    root = (math.pi / (2.0 * ellipticity**2 * second)) ** (1.0 / 3.0)
    deflection = 2.0 * first / math.pi * root
    compliance = (1.0 - material.poisson_ratio**2) / material.youngs_modulus
    unit_load = deflection * (3.0 * compliance / total) ** (2.0 / 3.0) * 0.5 * total
    return float(unit_load**-1.5)


def _elliptic_integrals(ellipticity: float) -> tuple[float, float]:
    from scipy.special import ellipe, ellipk

    parameter = 1.0 - 1.0 / ellipticity**2
    return float(ellipk(parameter)), float(ellipe(parameter))


def _ellipticity(difference: float) -> float:
    """Ratio of the axes of the contact ellipse, at least 1.

    ``difference`` is the curvature difference F(rho) in 0..1.
    """
    if difference < 1e-6:  # a circle; the equation below is 0 / 0 there
        return 1.0
    from scipy.optimize import brentq

    def excess(logarithm: float) -> float:
        square = math.exp(2.0 * logarithm)
        first, second = _elliptic_integrals(math.exp(logarithm))
        numerator = (square + 1.0) * second - 2.0 * first
        return numerator / ((square - 1.0) * second) - difference

    return math.exp(brentq(excess, 1e-4, 12.0, xtol=1e-12))


@lru_cache(maxsize=64)
def ball_coefficient(bearing: BallBearing, material: Material) -> float:
    """K of Q = K delta^1.5 for a ball between both races, N/m^1.5.

    Deflections of inner and outer contact add.
    """
    contacts = [
        point_contact_coefficient(bearing.groove_curvatures(race), material)
        for race in ("inner", "outer")
    ]
    return sum(value ** (-2.0 / 3.0) for value in contacts) ** -1.5


@dataclass(frozen=True, slots=True, kw_only=True)
class BearingState:
    """Static equilibria under a radial load along y, at some cage positions.

    ``displacement`` (position, 2) m of the inner ring, x and y; ``ball_load`` (position, ball) N;
    ``stiffness`` (position, 2, 2) N/m, the tangent of the forces on x and y.
    """

    displacement: Array
    ball_load: Array
    stiffness: Array


def cage_positions(bearing: BallBearing) -> Array:
    """Angles of a ball from the load, (position,) rad.

    Over half of the angle between two balls, without its ends.
    """
    shares = (np.arange(CAGE_POSITIONS) + 0.5) / CAGE_POSITIONS
    return shares * math.pi / bearing.n_balls


def bearing_equilibrium(
    bearing: BallBearing, material: Material, load: float, positions: Array
) -> BearingState:
    """Equilibria of the inner ring under a radial ``load`` in N along y.

    ``positions`` (position,) rad are those of the cage. Ball j at theta_j = position + 2 pi j / Z
    from y is pressed by delta_j = x sin(theta_j) + y cos(theta_j) - P / 2, P the clearance, with
    the force K max(0, delta_j)^1.5. Newton's method over x and y on the potential energy, which
    is convex, with steps halved until it falls.

    Source: Harris, Rolling Bearing Analysis, 4th ed., section 7.3, without his sums over a ball
    on the load's line.

    Raises
    ------
    SimulationError    without an equilibrium
    """
    coefficient = ball_coefficient(bearing, material)
    gap = 0.5 * bearing.radial_clearance
    balls = 2.0 * math.pi * np.arange(bearing.n_balls) / bearing.n_balls
    angle = positions[:, None] + balls
    direction = np.stack(
        [np.sin(angle), np.cos(angle)], axis=-1
    )  # (position, ball, axis)
    force = np.array([0.0, load])

    def pressed(ring: Array) -> Array:
        return np.maximum(0.0, np.einsum("pba,pa->pb", direction, ring) - gap)

    def energy(ring: Array) -> Array:
        return 0.4 * coefficient * (pressed(ring) ** 2.5).sum(axis=1) - ring @ force

    largest = (5.0 * load / (bearing.n_balls * coefficient)) ** (2.0 / 3.0)
    ring = np.tile([0.0, gap + largest], (len(positions), 1))
    softest = SOFTEST * coefficient * math.sqrt(largest) * np.eye(2)
    for _ in range(MOST_STEPS):
        delta = pressed(ring)
        ball_load = coefficient * delta**1.5
        springs = 1.5 * coefficient * np.sqrt(delta)
        tangent = np.einsum("pb,pba,pbc->pac", springs, direction, direction)
        rest = np.einsum("pb,pba->pa", ball_load, direction) - force
        if np.abs(rest).max() <= BALANCED * load:
            return BearingState(
                displacement=ring, ball_load=ball_load, stiffness=tangent
            )
        step = np.linalg.solve(tangent + softest, -rest[:, :, None])[:, :, 0]
        longest = np.abs(step).max(axis=1, keepdims=True)
        allowed = abs(gap) + 4.0 * largest
        step *= np.minimum(1.0, allowed / np.maximum(longest, 1e-300))
        before, share = energy(ring), np.ones((len(ring), 1))
        slope = np.einsum("pa,pa->p", rest, step)
        for _ in range(40):
            decrease = 1e-4 * share[:, 0] * slope
            bound = before + decrease + 1e-14 * np.abs(before)
            worse = energy(ring + share * step) > bound
            if not worse.any():
                break
            share[worse] *= 0.5
        ring = ring + share * step
    raise SimulationError(
        f"a bearing finds no equilibrium under {load:g} N; check its sizes and its clearance"
    )


def bearing_stiffness(
    bearing: BallBearing, material: Material, load: float
) -> tuple[float, float]:
    """Tangent stiffness across and along a radial load in N, N/m.

    Averaged over the position of the cage. The coupling of the two averages to 0 by symmetry.
    """
    state = bearing_equilibrium(bearing, material, load, cage_positions(bearing))
    across, along = np.diagonal(state.stiffness.mean(axis=0)).tolist()
    return across, along


@lru_cache(maxsize=1024)
def support_stiffness(
    bearing: BallBearing, shaft: Shaft, material: Material, force: float
) -> tuple[float, float]:
    """Stiffness under a gear across and along its static force in N, N/m.

    Two bearings in series with their shaft. Each carries half of the force, since the gear is in
    the middle of the span. Housing and seats are rigid.
    """
    bending = shaft.bending_stiffness(material.youngs_modulus)
    across, along = bearing_stiffness(bearing, material, 0.5 * force)
    return 1.0 / (0.5 / across + 1.0 / bending), 1.0 / (0.5 / along + 1.0 / bending)
