"""Vibration of a healthy machine besides its mesh: forces at orders of its shafts.

Every class draws them alike.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gensig.dynamics.response import LinearMachine
from gensig.errors import ConfigError
from gensig.sensing.bearing_waviness import Bearing
from gensig.sensing.tones import (
    MOST_HARMONICS,
    TURN,
    Draws,
    Limits,
    Nuisance,
    Tones,
    fixed,
    turning,
)
from gensig.units import read_kind, to_si, unit


@dataclass(frozen=True, slots=True, kw_only=True)
class Unbalance(Nuisance):
    """Residual unbalance that turns with the shaft, at a fixed angle from tooth 0 of its gear.

    The residual is a share, uniform in ``used_share``, of what the grade permits at
    ``rated_speed`` of the shaft whose speed the configuration gives: the pinion's, a drive
    line's motor or crank. ``rotor_mass`` is the mass of all that turns with the gear;
    None takes the gear's mass.

    Source: ISO 21940-11, 4.4: e w = G mm/s at the highest speed of service; the force is m e w^2.
    """

    level = "specimen"
    iso21940_grade: float
    used_share: tuple[float, ...]
    rated_speed: float = unit("rpm")
    rotor_mass: float | None = unit("kg")

    limits: ClassVar[Limits] = {
        "iso21940_grade": (0.1, 4000.0),
        "rated_speed": (to_si("speed_rpm", 1.0), to_si("speed_rpm", 1e6)),
        "rotor_mass": (1e-3, 1e5),
    }
    ranges: ClassVar[Limits] = {"used_share": (0.0, 1.0)}

    def draw(self, of_unit: Draws, of_record: Draws, machine: LinearMachine) -> Tones:
        """As ``Nuisance.draw``."""
        share, angle = of_unit.uniform(self.used_share), of_unit.angle()
        turned = machine.shaft(self.gear)
        eccentricity = (
            share * 1e-3 * self.iso21940_grade / (self.rated_speed * turned.set_ratio)
        )
        mass = self.rotor_mass
        if mass is None:
            mass = turned.body.mass
        force = mass * eccentricity * turned.speed**2
        rotating = np.exp(1j * angle) * force * turning(turned.sense)
        return self.tones([1.0], [[1]], [rotating], "speed_squared")


@dataclass(frozen=True, slots=True, kw_only=True)
class CouplingMisalignment(Nuisance):
    """Reactions of a misaligned coupling: radial at 1, 2, ... times the shaft in a fixed
    direction, torque at twice.

    ``force_share`` of the mean mesh force is drawn uniformly in its logarithm; order k has
    ``order_shares[k - 1]`` of it. ``torque_share`` of the shaft's torque is drawn uniformly.

    Source: orders and direction as in Gibbons (1976) and Xu & Marangoni (1994); a universal joint
    at an angle b turns its shaft unevenly by b^2 / 2 at twice the speed.
    """

    force_share: tuple[float, ...]
    order_shares: tuple[float, ...]
    torque_share: tuple[float, ...]

    ranges: ClassVar[Limits] = {"force_share": (1e-6, 1.0), "torque_share": (0.0, 1.0)}

    def __post_init__(self) -> None:
        Nuisance.__post_init__(self)
        if not 1 <= len(self.order_shares) <= MOST_HARMONICS:
            raise ConfigError(
                f"number of order_shares = {len(self.order_shares)} must lie in 1..{MOST_HARMONICS}"
            )
        for share in self.order_shares:
            if not 0.0 <= share <= 100.0:
                raise ConfigError(f"order_shares = {share:g} must lie in 0..100")

    def draw(self, of_unit: Draws, of_record: Draws, machine: LinearMachine) -> Tones:
        """As ``Nuisance.draw``."""
        turned = machine.shaft(self.gear)
        radial = of_unit.logarithmic(self.force_share) * turned.mesh_force
        torque = of_unit.uniform(self.torque_share)
        torque *= turned.torque
        along = fixed(of_unit.angle())
        twist = np.array([0.0, 0.0, 1.0])
        twisting = torque * np.exp(1j * of_unit.angle()) * twist
        phases = np.exp(1j * of_unit.angles(len(self.order_shares)))
        forces = [
            radial * share * phase * along
            for share, phase in zip(self.order_shares, phases, strict=True)
        ]
        orders = [[k + 1] for k in range(len(forces))]
        return self.tones([1.0], [[2], *orders], [twisting, *forces], "torque")


@dataclass(frozen=True, slots=True, kw_only=True)
class Looseness(Nuisance):
    """A loose seat or foot: harmonics of the shaft up to ``n_orders`` and the half orders
    between, in one direction.

    ``force_share`` of the mean mesh force, uniform in its logarithm, is the amplitude of order 1;
    order k has k^-p of it with p the ``harmonic_exponent``, half orders ``half_share`` (uniform)
    of that; order 1/2 counts as 1. Which of two turns a record begins in is drawn for the record.

    Source: orders as in Goldman & Muszynska (1999).
    """

    force_share: tuple[float, ...]
    half_share: tuple[float, ...]
    n_orders: int
    harmonic_exponent: float

    limits: ClassVar[Limits] = {
        "n_orders": (1, MOST_HARMONICS),
        "harmonic_exponent": (0.0, 10.0),
    }
    ranges: ClassVar[Limits] = {"force_share": (1e-6, 1.0), "half_share": (0.0, 1.0)}

    def draw(self, of_unit: Draws, of_record: Draws, machine: LinearMachine) -> Tones:
        """As ``Nuisance.draw``."""
        mesh_force = machine.shaft(self.gear).mesh_force
        level = of_unit.logarithmic(self.force_share) * mesh_force
        half_share = of_unit.uniform(self.half_share)
        along = fixed(of_unit.angle())
        halves = np.arange(1, 2 * self.n_orders + 1)
        size = np.maximum(0.5 * halves, 1.0) ** -self.harmonic_exponent
        size *= np.where(halves % 2 == 1, half_share, 1.0)
        second_turn = math.pi * halves * int(of_record.rng.integers(2))
        phase = np.exp(1j * (of_unit.angles(len(halves)) + second_turn))
        force = level * (size * phase)[:, None] * along
        return self.tones([0.5], halves[:, None], force, "torque")


@dataclass(frozen=True, slots=True, kw_only=True)
class NeighbourMesh(Nuisance):
    """The mesh of another stage whose one gear sits on this gear's shaft.

    It carries the shaft's torque on ``base_radius``, along a line of action at ``line_of_action``
    from this gear's x. ``dynamic_share`` of that mean force, uniform in its logarithm, is the
    amplitude of the first harmonic; harmonic k has k^-p of it, p the ``harmonic_exponent``, and
    each one sideband of ``sideband_share`` (uniform) of that on either side at one order of
    either shaft. Where the mate's teeth stand is drawn for the record.
    """

    n_teeth: int
    n_teeth_mate: int
    base_radius: float = unit("mm")
    line_of_action: float = unit("deg")
    dynamic_share: tuple[float, ...]
    n_harmonics: int
    harmonic_exponent: float
    sideband_share: tuple[float, ...]

    limits: ClassVar[Limits] = {
        "n_teeth": (5, 1000),
        "n_teeth_mate": (5, 1000),
        "base_radius": (1e-3, 10.0),
        "line_of_action": (-TURN, TURN),
        "n_harmonics": (1, MOST_HARMONICS),
        "harmonic_exponent": (0.0, 10.0),
    }
    ranges: ClassVar[Limits] = {
        "dynamic_share": (1e-6, 1.0),
        "sideband_share": (0.0, 1.0),
    }

    def draw(self, of_unit: Draws, of_record: Draws, machine: LinearMachine) -> Tones:
        """As ``Nuisance.draw``."""
        turned = machine.shaft(self.gear)
        level = of_unit.logarithmic(self.dynamic_share)
        level *= turned.torque
        level /= self.base_radius
        sideband = of_unit.uniform(self.sideband_share)
        phases = of_unit.angles(5, MOST_HARMONICS)
        mate_angle = of_record.angle()
        along = fixed(self.line_of_action)
        # the next stage's force holds the shaft of a driven gear back, that of the stage before
        # drives the shaft of a driving one
        along[2] = -self.base_radius
        if turned.drives:
            along[2] = self.base_radius
        offsets = np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)])
        weight = np.array([1.0, sideband, sideband, sideband, sideband])
        harmonic = np.arange(1, self.n_harmonics + 1)
        # (offset, harmonic, base)
        multiples = offsets[:, None] + harmonic[:, None] * np.array([self.n_teeth, 0])
        size = weight[:, None] * harmonic**-self.harmonic_exponent
        phase = phases[:, : self.n_harmonics] + offsets[:, 1, None] * mate_angle
        force = level * (size * np.exp(1j * phase))[:, :, None] * along
        orders = [1.0, self.n_teeth / self.n_teeth_mate]
        return self.tones(
            orders, multiples.reshape(-1, 2), force.reshape(-1, 3), "torque"
        )


KINDS: dict[str, type[Nuisance]] = {
    "unbalance": Unbalance,
    "coupling_misalignment": CouplingMisalignment,
    "looseness": Looseness,
    "bearing": Bearing,
    "neighbour_mesh": NeighbourMesh,
}


def read_nuisances(values: Any) -> tuple[Nuisance, ...]:
    """Nuisances of a configuration; ConfigError for what makes none, naming the part."""
    where = "sensing.nuisances"
    if not isinstance(values, list | tuple):
        raise ConfigError(
            f"{where} = {values!r} must be a list of parts, [] for none; see sensing=machine"
        )
    return tuple(
        read_kind(KINDS, part, f"{where}[{index}]") for index, part in enumerate(values)
    )


def draw_tones(
    nuisances: tuple[Nuisance, ...],
    machine: LinearMachine,
    units: Mapping[str, np.random.Generator],
    record_rng: np.random.Generator,
) -> list[Tones]:
    """Forces of every part.

    Each part has its separate random numbers, so that one more part at the end changes none.
    ``units`` has one generator a level, ``record_rng`` is that of the record.
    """
    count = len(nuisances)
    of_units = {level: rng.spawn(count) for level, rng in units.items()}
    of_record = record_rng.spawn(count)
    return [
        part.draw(Draws(of_units[part.level][index]), Draws(of_record[index]), machine)
        for index, part in enumerate(nuisances)
    ]
