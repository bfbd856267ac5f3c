"""The machine of a row, composed from its overrides and kept for the rows that follow."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from gensig.dynamics.pair import RunningPair
from gensig.errors import ConfigError
from gensig.faults.base import Fault, faulty_teeth
from gensig.faults.registry import read_faults
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.material import Material
from gensig.mesh.pair_table import pair_table
from gensig.mesh.tooth_table import ToothTable
from gensig.options.compose import compose
from gensig.options.configuration import Configuration
from gensig.systems.pair_machine import GearPairMachine, running_pair
from gensig.systems.registry import read_system
from gensig.systems.run import Run

Array = NDArray[np.float64]

POINTS = ("A", "AB", "B", "BD", "C", "D", "DE", "E")
RECORD_TURNS = 15  # 0.5 s at 1800 r/min


@dataclass(frozen=True, eq=False)
class Case:
    """One machine with its faults; the same overrides always give the same object."""

    overrides: tuple[str, ...]
    system: GearPairMachine
    faults: tuple[Fault, ...]

    @property
    def pair(self) -> GearPair:
        """The gears in mesh."""
        return self.system.pair

    @property
    def table(self) -> ToothTable:
        """Compliance and gap tables, with the faults."""
        return self.system.mesh_table(self.faults)

    @property
    def whole_load_table(self) -> ToothTable:
        """The same where one pair carries the whole load."""
        return _whole_load_table(self)

    @property
    def structure_material(self) -> Material:
        """The material as bending, axial and body terms take it."""
        return self.system.material.in_plane(self.system.mesh.elasticity)

    @property
    def faulty_kinds(self) -> dict[str, int]:
        """Table rows of the first faulty tooth, as ``pair_compliance`` takes them.

        Empty when sound.
        """
        if not self.faults:
            return {}
        fault = self.faults[0]
        tooth = fault.teeth(self.gear(fault.gear))[0]
        side = getattr(self.table, fault.gear)
        return {f"{fault.gear}_kind": int(side.kind[tooth])}

    def gear(self, name: str) -> Gear:
        """The pinion or the wheel."""
        gear: Gear = getattr(self.pair, name)
        return gear

    def position(self, point: str) -> float:
        """Distance of a named point from A along the line of action, m; C is the pitch point."""
        pitch, path = self.pair.base_pitch, self.pair.path_of_contact
        named = {
            "A": 0.0,
            "B": path - pitch,
            "C": self.pair.pitch_point,
            "D": pitch,
            "E": path,
        }
        if point in named:
            return named[point]
        return 0.5 * (named[point[0]] + named[point[1]])

    def curvature(self, gear: str, point: str) -> Array:
        """Curvature radius of a gear's flank at a named point, (1,) m."""
        return self.curvature_at(gear, np.array([self.position(point)]))

    def curvature_at(self, gear: str, position: Array) -> Array:
        """Curvature radius of a gear's flank, (phase,) m, at positions on the line of action."""
        curvature: Array = getattr(self.pair, f"{gear}_curvature")(position)
        return curvature


@lru_cache(maxsize=512)
def read_case(overrides: tuple[str, ...]) -> Case:
    """Compose the machine and the selected fault.

    Overrides that begin with ``fault`` are the fault's.
    """
    machine = tuple(word for word in overrides if not word.startswith("fault"))
    fault = _read_faults(tuple(word for word in overrides if word.startswith("fault")))
    return Case(overrides=overrides, system=_read_machine(machine), faults=fault)


# composing takes longer than all that a row computes: values are typed into one composed machine
@lru_cache(maxsize=128)
def _read_machine(overrides: tuple[str, ...]) -> GearPairMachine:
    keys = [word.partition("=")[0] for word in overrides]
    if not all("." in key and not key.startswith("gear.rated_") for key in keys):
        return read_system(
            compose("generate", overrides)
        )  # groups, and values that others are made of
    values = _default_machine().plain()
    for key, word in zip(keys, overrides, strict=True):
        *groups, last = key.split(".")
        place: dict[str, Any] = values
        for group in groups:
            place = place.get(group, {})
        if last not in place:
            raise ConfigError(f"'{word}': the machine has no key '{key}'")
        place[last] = yaml.safe_load(word.partition("=")[2])
    return read_system(Configuration(values))


@lru_cache(maxsize=1)
def _default_machine() -> Configuration:
    return compose("generate")


@lru_cache(maxsize=64)
def _whole_load_table(case: Case) -> ToothTable:
    system = case.system
    if system.mesh.contact == "linear":
        return case.table
    teeth = faulty_teeth(case.pair, case.faults)
    return pair_table(
        case.pair, system.material, system.mesh, teeth, load=system.mesh_force
    )


@lru_cache(maxsize=8)
def _fault_option(name: str) -> dict[str, Any]:
    option: dict[str, Any] = compose("generate", [f"fault={name}"])["fault"].plain()
    return {key: value for key, value in option.items() if key != "vary"}


@lru_cache(maxsize=64)
def _read_faults(overrides: tuple[str, ...]) -> tuple[Fault, ...]:
    words = dict(word.split("=", 1) for word in overrides)
    option = _fault_option(words.pop("fault", "healthy"))
    typed = {
        key.removeprefix("fault."): yaml.safe_load(value)
        for key, value in words.items()
    }
    return read_faults({**option, **typed})


def with_fault(case: Case, *words: str) -> Case:
    """The same machine with another fault, sound when no words are given."""
    kept = tuple(word for word in case.overrides if not word.startswith("fault"))
    return read_case((*kept, *words))


def with_words(case: Case, *words: str) -> Case:
    """The same machine and fault with further overrides."""
    return read_case((*case.overrides, *words))


def running(case: Case) -> RunningPair:
    """The pair in motion with perfect teeth."""
    return running_pair(Run(system=case.system, faults=case.faults))


@lru_cache(maxsize=64)
def record(case: Case) -> Array:
    """Acceleration of the pinion's bearing along the line of action over 15 turns of the pinion,
    (sample,) m/s2.

    Perfect teeth, no noise, steady state; the first sample is tooth 0 at A. Raises ConfigError
    where 15 turns are no whole number of samples.
    """
    system = case.system
    turn = 2.0 * np.pi / system.operating.speed
    n_samples = RECORD_TURNS * turn * system.sensing.sampling_rate
    if abs(n_samples - round(n_samples)) > 1e-6:
        raise ConfigError(
            f"{RECORD_TURNS} turns are {n_samples:.6g} samples, not a whole number: "
            "choose another speed"
        )
    machine = replace(
        system,
        operating=replace(system.operating, duration=RECORD_TURNS * turn),
        sensing=replace(system.sensing, channels=("pinion_y",)),
    )
    return machine.simulate(case.faults).acceleration[0]
