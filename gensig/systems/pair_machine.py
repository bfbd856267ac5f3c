"""One gear pair that runs: its lateral and torsional motion, many records side by side."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.decimation import in_band_error
from gensig.dynamics.integrator import (
    BOUNCING,
    FINEST,
    Motions,
    Solver,
    check_channels,
    check_machine,
    check_memory,
    integrate,
)
from gensig.dynamics.mesh_state import MeshState, mesh_state
from gensig.dynamics.pair import Body, PairDynamics, Rotor
from gensig.errors import FaultError, SimulationError
from gensig.faults.base import Fault, faulty_teeth
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.sensing.agreement import agreement
from gensig.sensing.encoder import Disc
from gensig.sensing.manufacturing import nominal_gearbox, perfect_specimen
from gensig.systems.base import Machine, MachineMesh, simulate_together, specimen_table
from gensig.systems.run import CleanRecord, Run, Start
from gensig.systems.supports import in_gearbox
from gensig.units import from_si

Array = NDArray[np.float64]

FINEST_BOUNCING = (
    20  # steps per sample above which what bounces does not come nearer to anything
)
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
    """One gear pair with its supports, drive, motor and load; subclasses say how its teeth mesh."""

    pair: GearPair = field()
    pinion: Body
    wheel: Body
    motor: Rotor | None = None
    load: Rotor | None = None

    @property
    @abstractmethod
    def gear_channels(self) -> tuple[str, ...]:
        """Channels of the two gears: every motion that they have."""

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

    def mesh_torques(self, speed: float, torque: float) -> Array:
        """The set torque: every mesh of a tooth has the same load, (1,) N m."""
        return np.array([torque])

    def driven_tooth(self, tooth_pinion: int, drawn: int) -> int:
        """The drawn tooth: the gears are put on anew for every record."""
        return drawn

    def draw_discs(self, rng: np.random.Generator) -> tuple[Disc, ...]:
        """None: a pair has no toothed wheels."""
        return ()

    def check(self) -> None:
        """Raise for what would stop every record.

        Drive, fits out of range, channels, step length.
        """
        self.require_drive()
        self.mesh_table()
        self.quality.check_covered(self.pair.pinion, self.pair.wheel)
        sensing, operating = self.sensing, self.operating
        check_memory(
            operating.duration,
            sensing.sampling_rate,
            len(sensing.channels),
            self.solver,
        )
        nominal = pair_dynamics(Run(system=self, faults=()))
        check_channels(sensing.channels, self.channels)
        sensing.check(operating.duration)
        check_machine(nominal, self.solver, sensing.sampling_rate)

    @classmethod
    def simulate_runs(
        cls, runs: Sequence[Run[Self]]
    ) -> list[CleanRecord | SimulationError]:
        """Simulate runs, those that share rate, duration and law side by side."""
        return simulate_pairs(runs)


PairRun = Run[GearPairMachine]


def severity(faults: Sequence[Fault], pair: GearPair) -> float:
    """Largest severity of the faults, 0 when there is none."""
    gears = pair.gears
    value = max((fault.severity(gears[fault.gear]) for fault in faults), default=0.0)
    if value > 1.0:
        raise FaultError(
            f"the fault's severity is {value:.3g}, above 1: it is larger than its tooth"
        )
    return value


def pair_dynamics(run: PairRun) -> PairDynamics:
    """Equations of motion of a run with its specimen and gearbox; GeometryError for no drive."""
    machine, pair = run.system, run.system.pair
    machine.require_drive()
    start = run.start or Start()
    specimen = run.specimen or perfect_specimen(pair.pinion, pair.wheel)
    gearbox = run.gearbox or nominal_gearbox(len(machine.sensing.channels))
    return PairDynamics(
        table=specimen_table(machine, run.faults, specimen),
        pinion=in_gearbox(machine.pinion, gearbox, slice(0, 2), machine.quality),
        wheel=in_gearbox(machine.wheel, gearbox, slice(2, 4), machine.quality),
        operating=machine.operating,
        pinion_error=specimen.pinion_error,
        wheel_error=specimen.wheel_error,
        pinion_tilt=specimen.pinion_tilt + np.zeros(pair.pinion.n_teeth),
        wheel_tilt=specimen.wheel_tilt + np.zeros(pair.wheel.n_teeth),
        start_tooth_pinion=start.tooth_pinion,
        start_tooth_wheel=start.tooth_wheel,
        start_phase=start.phase,
        motor=machine.motor,
        load=machine.load,
    )


def _kind(run: PairRun) -> tuple[object, ...]:
    """Everything that runs must share to be integrated in one call."""
    system = run.system
    operating = system.operating
    sensing = (
        system.sensing.sampling_rate,
        system.sensing.channels,
        operating.duration,
    )
    machine = (
        type(system),
        system.motor is None,
        system.load is None,
        operating.is_steady,
        run.tell_mesh,
    )
    return (*sensing, *machine, system.solver, system.mesh.law, system.mesh.roll_torque)


def _finer(run: PairRun) -> PairRun:
    """The same run at half the step."""
    solver = run.system.solver
    finer = replace(solver, oversampling=2 * solver.oversampling)
    return replace(run, system=replace(run.system, solver=finer))


def simulate_pairs(runs: Sequence[PairRun]) -> list[CleanRecord | SimulationError]:
    """Records of runs, in the order given; runs that share rate, duration and law are integrated
    in one call.

    The bits of a record do not depend on the other runs. A motion that does not stay finite gives
    its error in place of its record.
    """
    found: dict[int, CleanRecord | SimulationError] = {}
    machines: dict[int, PairDynamics] = {}
    kinds: dict[tuple[object, ...], list[int]] = {}
    for place, run in enumerate(runs):
        system = run.system
        try:
            machines[place] = pair_dynamics(run)
            check_machine(machines[place], system.solver, system.sensing.sampling_rate)
        except SimulationError as error:
            found[place] = error
        else:
            kinds.setdefault(_kind(run), []).append(place)
    for places in kinds.values():
        records = _side_by_side(
            [runs[place] for place in places], [machines[place] for place in places]
        )
        found.update(zip(places, records, strict=True))
    coarse = [
        place for place, record in found.items() if _is_too_coarse(runs[place], record)
    ]
    if coarse:
        found.update(
            zip(
                coarse,
                simulate_pairs([_finer(runs[place]) for place in coarse]),
                strict=True,
            )
        )
    return [found[place] for place in range(len(runs))]


def _is_too_coarse(run: PairRun, record: CleanRecord | SimulationError) -> bool:
    if isinstance(record, SimulationError) or record.integration_check != "unresolved":
        return False
    finest = FINEST_BOUNCING if record.contact_loss_fraction > BOUNCING else FINEST
    return 2 * run.system.solver.oversampling <= finest


def _checks(
    motions: Motions, solver: Solver, sampling_rate: float
) -> tuple[Array, list[str]]:
    """Relative error in the band of every motion, and its meaning."""
    exact, kept = motions.check, motions.finite
    errors = np.full(len(exact), np.nan)
    if solver.max_error is None:
        return errors, ["none"] * len(exact)
    found = motions.acceleration[:, :, : exact.shape[2]]
    errors[kept] = in_band_error(found[kept], exact[kept], sampling_rate)
    checks = [
        "error" if error <= solver.max_error else "unresolved" for error in errors
    ]
    for index, check in enumerate(checks):
        if (
            check == "unresolved"
            and kept[index]
            and motions.contact_loss_fraction[index] > BOUNCING
        ):
            one = slice(index, index + 1)
            if agreement(found[one], exact[one], sampling_rate).agrees[0]:
                checks[index] = "levels"
    return errors, checks


def _side_by_side(
    runs: Sequence[PairRun], machines: Sequence[PairDynamics]
) -> list[CleanRecord | SimulationError]:
    system = runs[0].system
    motions = integrate(
        machines,
        system.solver,
        sampling_rate=system.sensing.sampling_rate,
        duration=system.operating.duration,
        channels=system.sensing.channels,
        tell_mesh=runs[0].tell_mesh,
    )
    errors, checks = _checks(motions, system.solver, system.sensing.sampling_rate)
    records: list[CleanRecord | SimulationError] = []
    for index, run in enumerate(runs):
        gain = 1.0 if run.gearbox is None else run.gearbox.gain[:, None]
        operating = run.system.operating
        if motions.finite[index]:
            records.append(
                CleanRecord(
                    acceleration=motions.acceleration[index] * gain,
                    shaft_angle=motions.shaft_angle[index],
                    mean_speed=float(motions.mean_speed[index]),
                    contact_loss_fraction=float(motions.contact_loss_fraction[index]),
                    integration_error=float(errors[index]),
                    integration_check=checks[index],
                    mesh=_mesh_state(run, machines[index], motions, index)
                    if run.tell_mesh
                    else None,
                )
            )
        else:
            records.append(
                SimulationError(
                    f"the motion stopped being finite (speed {from_si('speed_rpm', operating.speed):g} r/min, torque "
                    f"{operating.torque:g} N m); raise solver.oversampling above {system.solver.oversampling}"
                )
            )
    return records


def _mesh_state(
    run: PairRun, dynamics: PairDynamics, motions: Motions, index: int
) -> MeshState:
    faulty = faulty_teeth(run.system.pair, run.faults)
    return mesh_state(dynamics, motions.seen[index], motions.shaft_angle[index], faulty)
