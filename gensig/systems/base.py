"""The machine: gears by name, bodies, meshes, set-point and sensors.

The interface of all machines for records, plans, lives and commands.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, Self

import numpy as np

from gensig.arrays import Array
from gensig.dynamics.integrator import Solver
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.dynamics.pair import Body
from gensig.dynamics.response import LinearMachine
from gensig.errors import SimulationError
from gensig.faults.base import Fault
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.material import Material
from gensig.mesh.options import MeshOptions
from gensig.mesh.tooth_table import ToothTable
from gensig.operation.setpoint import Operating
from gensig.sensing.chain import Sensing
from gensig.sensing.encoder import Disc
from gensig.sensing.manufacturing import FurtherGear, Gearbox, Quality, Specimen
from gensig.systems.run import CleanRecord, Run, Start
from gensig.systems.sliced_pair import SlicedPair
from gensig.systems.stiffness_curves import StiffnessCurves


@dataclass(frozen=True, slots=True, kw_only=True)
class MachineMesh:
    """A mesh of a machine: the names of its driving and its driven gear, and their geometry.

    ``followed`` is True for the mesh whose phase and teeth at the start records state.
    """

    driving: str
    driven: str
    pair: GearPair
    followed: bool

    @property
    def gears(self) -> tuple[str, str]:
        """Names of the driving and the driven gear."""
        return self.driving, self.driven

    @property
    def name(self) -> str:
        """Names of both gears in one word, the driving one first."""
        return f"{self.driving}_{self.driven}"


def home_meshes(meshes: Sequence[MachineMesh]) -> dict[str, int]:
    """Number of the home mesh of each gear, by its name.

    Faults and errors of a gear are on the flanks that touch there. It is the followed mesh if
    the gear is in it, else its first mesh in the order of ``meshes``.
    """
    numbers = sorted(range(len(meshes)), key=lambda k: not meshes[k].followed)
    homes: dict[str, int] = {}
    for number in numbers:
        for gear in meshes[number].gears:
            homes.setdefault(gear, number)
    return homes


def further_gears(
    gears: Mapping[str, Gear], meshes: Sequence[MachineMesh]
) -> tuple[FurtherGear, ...]:
    """The gears outside the followed mesh, in the order of ``gears``."""
    homes = home_meshes(meshes)
    return tuple(
        FurtherGear(gear=gear, drives=meshes[homes[name]].driving == name)
        for name, gear in gears.items()
        if not meshes[homes[name]].followed
    )


class Running(Protocol):
    """The machine of a run, ready to be integrated."""

    @property
    def dynamics(self) -> Dynamics:
        """The machine in motion; its first angle is that of the pinion."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine(ABC):
    """A machine with gears: material, set-point, sensors, quality and solver.

    Each kind defines its motion. Kinds are final: none overrides a method that another defines.
    """

    material: Material
    mesh: MeshOptions
    operating: Operating
    sensing: Sensing
    quality: Quality
    solver: Solver

    @property
    def n_samples(self) -> int:
        """Samples of one channel of a record."""
        return round(self.operating.duration * self.sensing.sampling_rate)

    @property
    @abstractmethod
    def pair(self) -> GearPair:
        """Geometry of the mesh that records follow."""

    @property
    @abstractmethod
    def flanks(self) -> SlicedPair:
        """The followed mesh at rest, sound, under its mean torque; its flanks cut into slices."""

    @property
    @abstractmethod
    def has_whole_teeth(self) -> bool:
        """True where records have spur teeth whole, False where they have them in slices."""

    @property
    @abstractmethod
    def gears(self) -> Mapping[str, Gear]:
        """All gears by name, those of the followed mesh first."""

    @property
    @abstractmethod
    def bodies(self) -> Mapping[str, Body]:
        """Mass, inertia and support of every gear, by its name."""

    @property
    @abstractmethod
    def meshes(self) -> tuple[MachineMesh, ...]:
        """All meshes."""

    @property
    @abstractmethod
    def pinion_turns(self) -> Mapping[str, float]:
        """Turns of the pinion during one turn of every gear, by its name."""

    @abstractmethod
    def faulty_meshes(
        self, faults: Sequence[Fault]
    ) -> list[tuple[GearPair, tuple[Fault, ...]]]:
        """Meshes that feel faults: the pair, and the faults named by its sides.

        Raises
        ------
        FaultError    for a gear that the machine does not have
        """

    @property
    @abstractmethod
    def channels(self) -> tuple[str, ...]:
        """Names of all channels that can be recorded."""

    @property
    @abstractmethod
    def most_pairs(self) -> int:
        """Most tooth pairs whose loads can be recorded at once."""

    @property
    @abstractmethod
    def ratio(self) -> float:
        """Speed of the pinion's shaft over the speed that the configuration gives."""

    @property
    @abstractmethod
    def torque_of(self) -> str:
        """Name of the torque that ``operating`` sets; empty if it is the driving shaft's."""

    @property
    @abstractmethod
    def load_exponent(self) -> int:
        """Exponent of the speed in the set torque along a course, besides the torque profile."""

    @property
    @abstractmethod
    def mesh_force(self) -> float:
        """Normal force of the followed mesh at the set-point, N."""

    @abstractmethod
    def at_gear(self, gear: str) -> tuple[Machine, str]:
        """The machine as records that follow the home mesh of a gear have it, and the gear's side.

        KeyError for a gear that the machine does not have.
        """

    @abstractmethod
    def mesh_torques(self, speed: float, torque: float) -> Array:
        """Loads of a tooth at a set-point, one for each mesh of the tooth, all equally likely.

        Parameters
        ----------
        speed : rad/s    of the pinion
        torque : N m     of the set-point

        Returns
        -------
        (mesh,) N m      torques of the pinion
        """

    @abstractmethod
    def mean_torque(self, speed: float, torque: float) -> float:
        """Mean torque of the pinion on the working flanks of the followed mesh, N m.

        Wear goes with it. Parameters as in ``mesh_torques``.
        """

    @abstractmethod
    def mesh_table(self, faults: Sequence[Fault] = ()) -> ToothTable:
        """Tables of the followed mesh with the given faults."""

    @abstractmethod
    def stiffness_curves(
        self,
        faults: Sequence[Fault] = (),
        *,
        n_positions: int = 201,
        points_per_tooth: int = 100,
    ) -> StiffnessCurves:
        """Single-pair and mesh stiffness of spur teeth; ConfigError for teeth in slices."""

    @abstractmethod
    def driven_tooth(self, tooth_pinion: int, drawn: int) -> int:
        """Tooth of the driven gear that meets one of the pinion at the start.

        ``drawn`` if the machine allows any.
        """

    @abstractmethod
    def draw_discs(self, rng: np.random.Generator) -> tuple[Disc, ...]:
        """Toothed wheels of one gearbox with their errors, drawn at random."""

    @abstractmethod
    def gear_angle(self, gear: str, start: Start, shaft_angle: Array) -> Array:
        """Angle of a gear in its sense of rotation, (sample,) rad.

        Of the gears of the followed mesh it is 0 where tooth 0 enters contact, of another gear
        where it stands when the angle of the line is 0. It follows the pinion by the ratio of
        their speeds: lag under load and vibration of its own are left out.

        Parameters
        ----------
        shaft_angle : (sample,) rad    of the pinion since the record's start, as ``CleanRecord``
            has it
        """

    @abstractmethod
    def line_angle(self, start: Start) -> float | None:
        """Angle of the shaft whose speed the configuration gives, rad.

        It decides how all meshes stand. None where the teeth of the one mesh say that.
        """

    @abstractmethod
    def linear_machine(self, run: Run[Self]) -> LinearMachine:
        """The healthy machine of a run, in its gearbox, as nuisances meet it."""

    @abstractmethod
    def felt(self, number: int, faults: Sequence[Fault]) -> tuple[Fault, ...]:
        """Faults of gears as a mesh feels them, named by its sides."""

    @abstractmethod
    def ready(self, run: Run[Self]) -> Running:
        """The machine of a run, ready to be integrated.

        Raises
        ------
        SimulationError    for one that the method of the solver cannot integrate
        """

    @abstractmethod
    def integrated(self, running: Any) -> tuple[str, ...]:
        """Degrees of freedom of ``ready`` whose accelerations the channels need."""

    @abstractmethod
    def sensed(
        self, run: Run[Self], running: Any, acceleration: Array, angle: Array
    ) -> Array:
        """Signals of the channels with the gains of a run's gearbox, (channel, sample).

        ``acceleration`` (dof, sample) is that of ``integrated`` and may be overwritten, ``angle``
        (angle, sample) rad.
        """

    @abstractmethod
    def check(self) -> None:
        """Raise for errors of every record: drive, channels, options and steps."""

    @classmethod
    @abstractmethod
    def simulate_runs(
        cls, runs: Sequence[Run[Self]]
    ) -> list[CleanRecord | SimulationError]:
        """Simulate runs of machines of this kind; ``simulate_together`` takes any kinds.

        The results are in the order of the runs.
        """

    def simulate(
        self,
        faults: Sequence[Fault] = (),
        *,
        start: Start | None = None,
        specimen: Specimen | None = None,
        gearbox: Gearbox | None = None,
    ) -> CleanRecord:
        """Clean record of one run.

        Without further arguments the machine is perfect, nominal, and starts with teeth 0 at A.
        """
        run = Run(
            system=self,
            faults=tuple(faults),
            start=start,
            specimen=specimen,
            gearbox=gearbox,
        )
        (record,) = self.simulate_runs([run])
        if isinstance(record, SimulationError):
            raise record
        return record


def specimen_table(
    machine: Machine,
    faults: Sequence[Fault],
    specimen: Specimen,
) -> ToothTable:
    """Mesh table of a specimen's gears with faults, at the specimen's backlash.

    Sound tables are shared: the backlash is set afterwards.
    """
    table = machine.mesh_table((*specimen.forms, *faults))
    backlash = machine.pair.backlash * specimen.backlash_factor
    return replace(table, pair=replace(machine.pair, backlash=backlash))


def simulate_together(runs: Sequence[Run[Any]]) -> list[CleanRecord | SimulationError]:
    """Records of runs of any machines, in the order of the runs.

    Machines of one kind are simulated together. A record's bits do not depend on the other runs.
    A motion that does not stay finite gives its error instead of a record.
    """
    by_kind: dict[type[Machine], list[int]] = {}
    for number, run in enumerate(runs):
        by_kind.setdefault(type(run.system), []).append(number)
    results: dict[int, CleanRecord | SimulationError] = {}
    for kind, numbers in by_kind.items():
        records = kind.simulate_runs([runs[number] for number in numbers])
        results.update(zip(numbers, records, strict=True))
    return [results[number] for number in range(len(runs))]
