"""A gear pair that runs: from configuration to records, many side by side, whatever its teeth."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics._vector import n_lanes
from gensig.dynamics.decimation import in_band_error
from gensig.dynamics.integrator import (
    BOUNCING,
    FINEST,
    Motions,
    Solver,
    check_channels,
    check_memory,
    check_step,
    integrate,
    settling_oversampling,
)
from gensig.dynamics.mesh_state import MeshState, mesh_state
from gensig.dynamics.pair import Body, PairDynamics, Rotor
from gensig.errors import ConfigError, FaultError, SimulationError
from gensig.faults.base import Fault, faulty_teeth
from gensig.geometry.contact import GearPair
from gensig.material import Material
from gensig.mesh.options import MeshOptions
from gensig.mesh.pair_table import N_PAIRS, PairTable
from gensig.mesh.sliced.sliced_table import SlicedTable
from gensig.operation.setpoint import Operating
from gensig.sensing.agreement import agreement
from gensig.sensing.chain import Sensing
from gensig.sensing.encoder import Disc
from gensig.sensing.manufacturing import Gearbox, Quality, Specimen, nominal_gearbox, perfect_specimen
from gensig.systems.supports import in_gearbox
from gensig.units import from_si

if TYPE_CHECKING:
    from gensig.systems.stiffness_curves import StiffnessCurves

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """Where a record begins: the teeth that enter contact at roll 0, and the roll as a share of a base pitch."""

    tooth_pinion: int
    tooth_wheel: int
    phase: float


# What an integration at half the step says of a record: its error is below the limit; teeth bounce, which makes point
# values mean little, but band levels and indicators agree; neither; nobody looked; a drive line, whose error is the
# residual of its energy balance.
CHECKS = ("error", "levels", "unresolved", "none", "energy")
FINEST_BOUNCING = 20  # steps per sample above which what bounces does not come nearer to anything


@dataclass(frozen=True, slots=True, kw_only=True)
class CleanRecord:
    """Accelerations before noise, (channel, sample) m/s2 (rad/s2 for rotations), and what the run tells of itself.

    ``shaft_angle`` (sample,) rad of the pinion, from its nominal place at the first sample on, ``mean_speed`` rad/s,
    ``integration_check`` one of ``CHECKS``, ``mesh`` the loads of the teeth where they were asked for.
    """

    acceleration: Array
    shaft_angle: Array
    mean_speed: float
    contact_loss_fraction: float
    integration_error: float
    integration_check: str
    mesh: MeshState | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PairMachine(ABC):
    """One gear pair with its supports, drive, sensors and quality; how its teeth mesh is the subclass's."""

    pair: GearPair
    material: Material
    mesh: MeshOptions
    pinion: Body
    wheel: Body
    operating: Operating
    sensing: Sensing
    quality: Quality
    solver: Solver
    motor: Rotor | None = None
    load: Rotor | None = None

    @abstractmethod
    def mesh_table(self, faults: Sequence[Fault] = ()) -> PairTable | SlicedTable:
        """Compliance and gap tables with the given faults."""

    def stiffness_curves(
        self, faults: Sequence[Fault] = (), *, n_positions: int = 201, points_per_tooth: int = 100
    ) -> StiffnessCurves:
        """Single-pair and mesh stiffness with their parts, of spur teeth; ConfigError for teeth in slices."""
        raise ConfigError(
            "stiffness_curves are those of system=spur_pair; a helical pair has its stiffness slice by slice: "
            "flanks.transmission_error(), or gensig stiffness system=helical_pair"
        )

    def simulate_alone(self, run: Run) -> CleanRecord | SimulationError | None:
        """The record of a machine that is not simulated side by side with others; None for one that is."""
        return None

    def draw_discs(self, rng: np.random.Generator) -> tuple[Disc, ...]:
        """The toothed wheels of one gearbox with their errors; a pair has none."""
        return ()

    def driven_tooth(self, tooth_pinion: int, drawn: int) -> int:
        """Tooth of the driven gear that meets one of the driving gear at the start: the drawn one, put on anew."""
        return drawn

    @property
    def ratio(self) -> float:
        """Speed of the pinion's shaft over the one that ``operating`` is told for."""
        return 1.0

    @property
    def torque_of(self) -> str:
        """What the set torque is that of, where it is not the driving shaft's own."""
        return ""

    def mesh_torques(self, speed: float, torque: float) -> Array:
        """Loads that a tooth meets at a set-point, one a mesh, all equally likely, as torques of the pinion in N m.

        ``speed`` rad/s of the pinion, ``torque`` N m of the set-point; (mesh,).
        """
        return np.array([torque])

    @property
    def load_exponent(self) -> int:
        """Power of the speed that the set torque follows along a course, beyond its own profile."""
        return 0

    @property
    def most_pairs(self) -> int:
        """Pairs of teeth that may be followed at once."""
        return N_PAIRS

    def require_drive(self) -> None:
        """Raise GeometryError unless at least one pair is always in contact."""
        self.pair.require_continuous_drive()

    def _specimen_table(self, faults: Sequence[Fault], specimen: Specimen) -> PairTable | SlicedTable:
        """The faults on the flanks of a set of gears, at its backlash; which asks for no tables of its own."""
        table = self.mesh_table((*specimen.forms, *faults))
        return replace(table, pair=replace(self.pair, backlash=self.pair.backlash * specimen.backlash_factor))

    @property
    def mesh_force(self) -> float:
        """Normal force of the set torque, N."""
        return self.operating.torque / self.pair.pinion.base_radius

    def check(self) -> None:
        """Raise for what would stop every record: interrupted drive, fits out of range, channels, step length."""
        self.require_drive()
        self.mesh_table()
        self.quality.check_covered(self.pair.pinion, self.pair.wheel)
        sensing, operating = self.sensing, self.operating
        check_memory(operating.duration, sensing.sampling_rate, len(sensing.channels), self.solver.precision)
        nominal = Run(system=self, faults=()).dynamics()
        check_channels(sensing.channels, nominal.dofs)
        sensing.check(operating.duration)
        check_step(nominal, sensing.sampling_rate, self.solver.oversampling, self.solver.max_error)

    def simulate(
        self,
        faults: Sequence[Fault] = (),
        *,
        start: Start | None = None,
        specimen: Specimen | None = None,
        gearbox: Gearbox | None = None,
    ) -> CleanRecord:
        """Simulate one record; what is not given is perfect, nominal, and starts with teeth 0 at A."""
        run = Run(system=self, faults=tuple(faults), start=start, specimen=specimen, gearbox=gearbox)
        (record,) = simulate_together([run])
        if isinstance(record, SimulationError):
            raise record
        return record

    def _dynamics(self, faults: Sequence[Fault], start: Start, specimen: Specimen, gearbox: Gearbox) -> PairDynamics:
        return PairDynamics(
            table=self._specimen_table(faults, specimen),
            pinion=in_gearbox(self.pinion, gearbox, slice(0, 2), self.quality),
            wheel=in_gearbox(self.wheel, gearbox, slice(2, 4), self.quality),
            operating=self.operating,
            pinion_error=specimen.pinion_error,
            wheel_error=specimen.wheel_error,
            pinion_tilt=specimen.pinion_tilt + np.zeros(self.pair.pinion.n_teeth),
            wheel_tilt=specimen.wheel_tilt + np.zeros(self.pair.wheel.n_teeth),
            start_tooth_pinion=start.tooth_pinion,
            start_tooth_wheel=start.tooth_wheel,
            start_phase=start.phase,
            motor=self.motor,
            load=self.load,
        )


def severity(faults: Sequence[Fault], pair: GearPair) -> float:
    """Largest severity of the faults, 0 when there is none."""
    gears = {"pinion": pair.pinion, "wheel": pair.wheel}
    value = max((fault.severity(gears[fault.gear]) for fault in faults), default=0.0)
    if value > 1.0:
        raise FaultError(f"the fault's severity is {value:.3g}, above 1: it is larger than its tooth")
    return value


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One record to be simulated; what is None is perfect, nominal, and starts with teeth 0 at A.

    ``tell_mesh`` asks for the loads of the teeth at every sample. ``discs`` are the toothed wheels of a drive line.
    """

    system: PairMachine
    faults: tuple[Fault, ...]
    start: Start | None = None
    specimen: Specimen | None = None
    gearbox: Gearbox | None = None
    tell_mesh: bool = False
    discs: tuple[Disc, ...] = ()

    @property
    def kind(self) -> tuple[object, ...]:
        """What runs that are simulated side by side share."""
        system = self.system
        operating = system.operating
        sensing = (system.sensing.sampling_rate, system.sensing.channels, operating.duration)
        machine = (type(system), system.motor is None, system.load is None, operating.is_steady, self.tell_mesh)
        return (*sensing, *machine, system.solver, system.mesh.law, system.mesh.roll_torque)

    def finer(self) -> Run:
        """The same at half the step."""
        solver = self.system.solver
        return replace(self, system=replace(self.system, solver=replace(solver, oversampling=2 * solver.oversampling)))

    def dynamics(self) -> PairDynamics:
        """The equations of motion."""
        system, pair = self.system, self.system.pair
        system.require_drive()
        return system._dynamics(
            self.faults,
            self.start or Start(tooth_pinion=0, tooth_wheel=0, phase=0.0),
            self.specimen or perfect_specimen(pair.pinion, pair.wheel),
            self.gearbox or nominal_gearbox(len(system.sensing.channels)),
        )


def simulate_together(runs: Sequence[Run]) -> list[CleanRecord | SimulationError]:
    """Simulate records in groups of those that share rate, duration and law, side by side; in the order given.

    A record's bits do not depend on what it is simulated beside. A motion that does not stay finite gives its error in
    place of its record.
    """
    found: dict[int, CleanRecord | SimulationError] = {}
    machines: dict[int, PairDynamics] = {}
    kinds: dict[tuple[object, ...], list[int]] = {}
    for place, run in enumerate(runs):
        system = run.system
        alone = system.simulate_alone(run)
        if alone is not None:
            found[place] = alone
            continue
        try:
            machines[place] = run.dynamics()
            settling = settling_oversampling(machines[place], system.solver, system.sensing.sampling_rate)
        except SimulationError as error:
            found[place] = error
        else:
            kinds.setdefault((*run.kind, settling), []).append(place)
    for places in kinds.values():
        together = n_lanes(runs[places[0]].system.solver.precision)
        for first in range(0, len(places), together):
            group = places[first : first + together]
            records = _side_by_side([runs[place] for place in group], [machines[place] for place in group])
            found.update(zip(group, records, strict=True))
    coarse = [place for place, record in found.items() if _is_too_coarse(runs[place], record)]
    if coarse:
        found.update(zip(coarse, simulate_together([runs[place].finer() for place in coarse]), strict=True))
    return [found[place] for place in range(len(runs))]


def _is_too_coarse(run: Run, record: CleanRecord | SimulationError) -> bool:
    if isinstance(record, SimulationError) or record.integration_check != "unresolved":
        return False
    finest = FINEST_BOUNCING if record.contact_loss_fraction > BOUNCING else FINEST
    return 2 * run.system.solver.oversampling <= finest


def _checks(motions: Motions, solver: Solver, sampling_rate: float) -> tuple[Array, list[str]]:
    """Relative error in the band and what it means, of every lane."""
    exact, kept = motions.check, motions.finite
    errors = np.full(len(exact), np.nan)
    if solver.max_error is None:
        return errors, ["none"] * len(exact)
    found = motions.acceleration[:, :, : exact.shape[2]]
    errors[kept] = in_band_error(found[kept], exact[kept], sampling_rate)
    checks = ["error" if error <= solver.max_error else "unresolved" for error in errors]
    for lane, check in enumerate(checks):
        if check == "unresolved" and kept[lane] and motions.contact_loss_fraction[lane] > BOUNCING:
            one = slice(lane, lane + 1)
            if agreement(found[one], exact[one], sampling_rate).agrees[0]:
                checks[lane] = "levels"
    return errors, checks


def _side_by_side(runs: Sequence[Run], machines: Sequence[PairDynamics]) -> list[CleanRecord | SimulationError]:
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
    for lane, run in enumerate(runs):
        gain = 1.0 if run.gearbox is None else run.gearbox.gain[:, None]
        operating = run.system.operating
        if motions.finite[lane]:
            records.append(
                CleanRecord(
                    acceleration=motions.acceleration[lane] * gain,
                    shaft_angle=motions.shaft_angle[lane],
                    mean_speed=float(motions.mean_speed[lane]),
                    contact_loss_fraction=float(motions.contact_loss_fraction[lane]),
                    integration_error=float(errors[lane]),
                    integration_check=checks[lane],
                    mesh=_mesh_state(run, machines[lane], motions, lane) if run.tell_mesh else None,
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


def _mesh_state(run: Run, dynamics: PairDynamics, motions: Motions, lane: int) -> MeshState:
    faulty = faulty_teeth(run.system.pair, run.faults)
    return mesh_state(dynamics, motions.seen[lane], motions.shaft_angle[lane], faulty)
