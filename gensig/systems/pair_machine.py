"""Machines with one gear pair: lateral and torsional motion, many records side by side."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.integrator import (
    check_channels,
    check_machine,
    check_memory,
    integrate,
)
from gensig.dynamics.mesh_state import mesh_state
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.dynamics.pair import Body, PairDynamics, Rotor
from gensig.dynamics.response import LinearPair
from gensig.errors import FaultError, SimulationError
from gensig.faults.base import Fault, faulty_teeth, require_gears
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.sensing.encoder import Disc
from gensig.sensing.manufacturing import nominal_gearbox, perfect_specimen
from gensig.systems.base import Machine, MachineMesh, simulate_together, specimen_table
from gensig.systems.integration_checks import (
    check_steps,
    checks,
    not_finite,
    records_by_kind,
)
from gensig.systems.run import CleanRecord, Run, Start, angle_from_tooth_0
from gensig.systems.supports import in_gearbox

Array = NDArray[np.float64]

PairMachine = Machine  # the name of version 0.9

__all__ = [
    "CleanRecord",
    "GearPairMachine",
    "Machine",
    "PairMachine",
    "Run",
    "Start",
    "pair_dynamics",
    "severity",
    "simulate_together",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class GearPairMachine(Machine):
    """One gear pair with its supports, drive, motor and load; subclasses define the mesh."""

    pair: GearPair = field()
    pinion: Body
    wheel: Body
    motor: Rotor | None = None
    load: Rotor | None = None

    @property
    @abstractmethod
    def gear_channels(self) -> tuple[str, ...]:
        """Channels of the two gears: all of their motions."""

    @abstractmethod
    def require_drive(self) -> None:
        """Raise GeometryError unless at least one pair of teeth is always in contact."""

    @property
    def gears(self) -> dict[str, Gear]:
        """Pinion and wheel."""
        return self.pair.gears

    @property
    def bodies(self) -> dict[str, Body]:
        """Mass, inertia and support of pinion and wheel."""
        return dict(zip(self.gears, (self.pinion, self.wheel), strict=True))

    @property
    def meshes(self) -> tuple[MachineMesh, ...]:
        """The one mesh."""
        driving, driven = self.gears
        return (
            MachineMesh(driving=driving, driven=driven, pair=self.pair, followed=True),
        )

    @property
    def pinion_turns(self) -> dict[str, float]:
        """Turns of the pinion during one turn of pinion and wheel."""
        n_teeth = self.pair.pinion.n_teeth
        return {name: gear.n_teeth / n_teeth for name, gear in self.gears.items()}

    def faulty_meshes(
        self, faults: Sequence[Fault]
    ) -> list[tuple[GearPair, tuple[Fault, ...]]]:
        """The pair and its faults."""
        require_gears(faults, self.gears)
        return [(self.pair, tuple(faults))]

    @property
    def channels(self) -> tuple[str, ...]:
        """Motions of the gears, and the rotations of motor and load if there are any."""
        rotors = {"motor_rotation": self.motor, "load_rotation": self.load}
        return (
            *self.gear_channels,
            *[name for name, rotor in rotors.items() if rotor is not None],
        )

    @property
    def ratio(self) -> float:
        """1: the configuration gives the speed of the pinion."""
        return 1.0

    @property
    def torque_of(self) -> str:
        """Empty: the set torque is that of the pinion's shaft."""
        return ""

    @property
    def load_exponent(self) -> int:
        """0: the set torque follows its own profile alone."""
        return 0

    @property
    def mesh_force(self) -> float:
        """Normal force of the set torque, N."""
        return self.operating.torque / self.pair.pinion.base_radius

    def at_gear(self, gear: str) -> tuple[Machine, str]:
        """The machine itself: it has one mesh."""
        return self, gear

    def mesh_torques(self, speed: float, torque: float) -> Array:
        """The set torque: every mesh of a tooth has the same load, (1,) N m."""
        return np.array([torque])

    def mean_torque(self, speed: float, torque: float) -> float:
        """The set torque."""
        return torque

    def driven_tooth(self, tooth_pinion: int, drawn: int) -> int:
        """The drawn tooth: the gears are mounted anew for every record."""
        return drawn

    def draw_discs(self, rng: np.random.Generator) -> tuple[Disc, ...]:
        """None: a pair has no toothed wheels."""
        return ()

    def gear_angle(self, gear: str, start: Start, shaft_angle: Array) -> Array:
        """As ``Machine.gear_angle``."""
        return angle_from_tooth_0(self.pair, gear, start, shaft_angle)

    def line_angle(self, start: Start) -> None:
        """None: the teeth say how the one mesh stands."""
        return

    def linear_machine(self, run: Run[Self]) -> LinearPair:
        """The healthy pair in the gearbox of a run."""
        return LinearPair(
            dynamics=pair_dynamics(replace(run, faults=(), specimen=None))
        )

    def check(self) -> None:
        """Raise for errors of every record: drive, fits out of range, channels, step length."""
        self.require_drive()
        self.mesh_table()
        self.quality.check_covered(self.pair.pinion, self.pair.wheel)
        sensing, operating = self.sensing, self.operating
        n_channels, rate = len(sensing.channels), sensing.sampling_rate
        check_memory(operating.duration, rate, n_channels, self.solver)
        nominal = pair_dynamics(Run(system=self, faults=()))
        check_channels(sensing.channels, self.channels)
        sensing.check_gears(self.gears)
        sensing.check(operating.duration)
        check_steps(nominal, self.solver, rate)

    @classmethod
    def simulate_runs(
        cls, runs: Sequence[Run[Self]]
    ) -> list[CleanRecord | SimulationError]:
        """Records of runs; those that share rate, duration and law are simulated side by side."""
        return simulate_pairs(runs)


PairRun = Run[GearPairMachine]


def severity(faults: Sequence[Fault], gears: Mapping[str, Gear]) -> float:
    """Largest severity of the faults, 0 when there is none; ``gears`` of the machine by name."""
    require_gears(faults, gears)
    value = max((fault.severity(gears[fault.gear]) for fault in faults), default=0.0)
    if value > 1.0:
        raise FaultError(
            f"the fault's severity is {value:.3g}, above 1: it is larger than its tooth"
        )
    return value


def pair_dynamics(run: PairRun) -> PairDynamics:
    """Equations of motion of a run with its specimen and gearbox; GeometryError without a drive."""
    machine, pair = run.system, run.system.pair
    machine.require_drive()
    start = run.start or Start()
    specimen = run.specimen or perfect_specimen(pair.pinion, pair.wheel)
    gearbox = run.gearbox or nominal_gearbox(len(machine.sensing.channels))
    return PairDynamics(
        teeth=MeshTeeth(
            table=specimen_table(machine, run.faults, specimen),
            errors=(specimen.pinion_error, specimen.wheel_error),
            tilts=(
                specimen.pinion_tilt + np.zeros(pair.pinion.n_teeth),
                specimen.wheel_tilt + np.zeros(pair.wheel.n_teeth),
            ),
            start_teeth=(start.tooth_pinion, start.tooth_wheel),
            start_phase=start.phase,
        ),
        pinion=in_gearbox(machine.pinion, gearbox, slice(0, 2), machine.quality),
        wheel=in_gearbox(machine.wheel, gearbox, slice(2, 4), machine.quality),
        operating=machine.operating,
        motor=machine.motor,
        load=machine.load,
    )


def _kind(run: PairRun, _: PairDynamics) -> tuple[object, ...]:
    """All values that runs must share to be integrated in one call."""
    system = run.system
    return (
        system.sensing.sampling_rate,
        system.sensing.channels,
        system.operating.duration,
        type(system),
        system.motor is None,
        system.load is None,
        system.operating.is_steady,
        run.with_mesh_state,
        system.solver,
        system.mesh.law,
        system.mesh.roll_torque,
        system.mesh.phase,
    )


def simulate_pairs(runs: Sequence[PairRun]) -> list[CleanRecord | SimulationError]:
    """Records of runs, in the order of the runs.

    Runs that share rate, duration and law are integrated in one call. The bits of a record do not
    depend on the other runs. A motion that does not stay finite gives its error in place of its
    record.
    """
    return records_by_kind(
        runs, dynamics_of=_checked_dynamics, kind_of=_kind, integrate=_side_by_side
    )


def _checked_dynamics(run: PairRun) -> PairDynamics:
    dynamics, system = pair_dynamics(run), run.system
    check_machine(dynamics, system.solver, system.sensing.sampling_rate)
    return dynamics


def _side_by_side(
    runs: Sequence[PairRun], machines: Sequence[PairDynamics]
) -> list[CleanRecord | SimulationError]:
    system = runs[0].system
    rate = system.sensing.sampling_rate
    motions = integrate(
        machines,
        system.solver,
        sampling_rate=rate,
        duration=system.operating.duration,
        channels=system.sensing.channels,
        with_mesh_state=runs[0].with_mesh_state,
    )
    errors, verdicts = checks(motions, system.solver, rate)
    records: list[CleanRecord | SimulationError] = []
    for index, run in enumerate(runs):
        if not motions.finite[index]:
            records.append(not_finite(run, [machines[index].teeth]))
            continue
        acceleration, angle = motions.acceleration[index], motions.angle[index][0]
        if run.gearbox is not None:
            acceleration *= run.gearbox.gain[:, None]
        mesh = None
        if run.with_mesh_state:
            faulty = faulty_teeth(run.system.pair, run.faults)
            mesh = mesh_state(machines[index].teeth, motions.seen[index], angle, faulty)
        records.append(
            CleanRecord(
                acceleration=acceleration,
                shaft_angle=angle,
                mean_speed=float(motions.mean_speed[index]),
                contact_loss_fraction=float(motions.contact_loss[index, 0]),
                integration_error=float(errors[index]),
                integration_check=verdicts[index],
                mesh=mesh,
            )
        )
    return records
