"""Tones of a sound ball bearing: its orders, and the waviness that drives them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gensig.dynamics.response import LinearMachine
from gensig.errors import ConfigError
from gensig.sensing.tones import (
    MOST_HARMONICS,
    Draws,
    Limits,
    Nuisance,
    Tones,
    fixed,
    turning,
)
from gensig.units import unit


@dataclass(frozen=True, slots=True, kw_only=True)
class BearingOrders:
    """Turns and passages per turn of the inner ring, the outer one at rest."""

    cage: float
    outer_race: float
    inner_race: float
    ball: float


def bearing_orders(
    n_balls: int,
    ball_diameter: float,
    pitch_diameter: float,
    contact_angle: float,
    slip: float = 0.0,
) -> BearingOrders:
    """Orders of a ball bearing whose cage lags by the share ``slip`` and whose balls roll on the
    outer race.

    Source: kinematics as in Harris & Kotzalas (2007), Essential Concepts of Bearing Technology,
    ch. 8.
    """
    ratio = ball_diameter / pitch_diameter * math.cos(contact_angle)
    cage = 0.5 * (1.0 - ratio) * (1.0 - slip)
    return BearingOrders(
        cage=cage,
        outer_race=n_balls * cage,
        inner_race=n_balls * (1.0 - cage),
        ball=cage * (1.0 + ratio) * pitch_diameter / ball_diameter,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Bearing(Nuisance):
    """The waviness of a sound ball bearing, which pushes with the stiffness of the gear's support.

    Four families: the outer race as balls pass it, k BPFO in a fixed direction; the inner race, k
    BPFI plus and minus one shaft order, forward and backward; the balls, 2 k BSF plus and minus
    one cage order; balls of unlike size, one force that turns with the cage. Harmonic k has k^-p
    of the family's waviness (uniform in its logarithm), p the ``harmonic_exponent``. Slip of the
    cage (uniform) and the angles of cage and balls are drawn for the record.

    Source: orders as in Wensing (1998), On the dynamics of ball bearings, ch. 2.
    """

    n_balls: int
    ball_diameter: float = unit("mm")
    pitch_diameter: float = unit("mm")
    contact_angle: float = unit("deg")
    waviness: tuple[float, ...] = unit("um")
    slip: tuple[float, ...]
    n_harmonics: int
    harmonic_exponent: float
    limits: ClassVar[Limits] = {
        "n_balls": (3, 200),
        "ball_diameter": (1e-4, 1.0),
        "pitch_diameter": (1e-3, 10.0),
        "contact_angle": (0.0, math.radians(60.0)),
        "n_harmonics": (1, MOST_HARMONICS),
        "harmonic_exponent": (0.0, 10.0),
    }
    ranges: ClassVar[Limits] = {"waviness": (1e-10, 1e-4), "slip": (0.0, 0.2)}

    def __post_init__(self) -> None:
        Nuisance.__post_init__(self)
        if not self.n_balls * self.ball_diameter < math.pi * self.pitch_diameter:
            raise ConfigError(
                f"{self.n_balls} balls of ball_diameter_mm = {1e3 * self.ball_diameter:g} "
                f"do not fit on pitch_diameter_mm = {1e3 * self.pitch_diameter:g}"
            )

    def draw(self, of_unit: Draws, of_record: Draws, machine: LinearMachine) -> Tones:
        """As ``Nuisance.draw``."""
        n = self.n_balls
        outer, inner, ball, cage = (
            of_unit.logarithmic(self.waviness) for _ in range(4)
        )
        along = fixed(of_unit.angle())
        # as many draws whatever n_harmonics is
        phases = of_unit.angles(5, MOST_HARMONICS)
        slip = of_record.uniform(self.slip)
        cage_angle, ball_angle = of_record.angles(2)
        orders = bearing_orders(
            n, self.ball_diameter, self.pitch_diameter, self.contact_angle, slip
        )
        turned = machine.shaft(self.gear)
        forward = turning(turned.sense)
        backward = forward.conj()
        multiples, forces = [(0, 1, 0)], [cage * np.exp(1j * phases[0, 0]) * forward]
        for k in range(1, self.n_harmonics + 1):
            size = k**-self.harmonic_exponent * np.exp(1j * phases[:, k - 1])
            multiples += [
                (0, k * n, 0),
                (k * n + 1, -k * n, 0),
                (k * n - 1, -k * n, 0),
                (0, 1, 2 * k),
                (0, -1, 2 * k),
            ]
            forces += [
                size[0] * outer * along,
                size[1] * inner * forward,
                size[2] * inner * backward,
                size[3] * ball * forward,
                size[4] * ball * backward,
            ]
        begin = np.exp(
            1j * np.array(multiples) @ np.array([0.0, cage_angle, ball_angle])
        )
        support = turned.body.support
        stiffness = np.array([support.stiffness_x, support.stiffness_y, 0.0])
        return self.tones(
            [1.0, orders.cage, orders.ball],
            multiples,
            begin[:, None] * forces * stiffness,
            "nothing",
        )
