"""An engine or a motor on its drive line as a machine of which records are made.

Records follow one mesh tooth by tooth. Its ``pair`` is the driving and the driven gear of that
mesh; ``operating`` is the motion of the driving gear's shaft.
``docs/theory/drive_lines.md``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self, final

import numpy as np

from gensig.arrays import Array
from gensig.driveline import loads
from gensig.driveline.channels import channel, channel_rows, line_signals
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.line_gears import (
    gear_channels,
    gear_names,
    line_bodies,
    line_gears,
    line_meshes,
    pinion_turns,
    with_supports,
)
from gensig.driveline.linear.linear_drive_line import linear_line
from gensig.driveline.machine_checks import (
    check_sensing,
    check_solver,
    require_followed,
    require_spur,
    warn_of_supports,
)
from gensig.driveline.mesh_phase import driving_angle
from gensig.driveline.running import (
    Governor,
    RunningLine,
    mesh_forces,
    named_by_side,
    operating_course,
    reference_force,
    running_line,
    steady_course,
)
from gensig.driveline.teeth import (
    MeshHeat,
    ToothLaw,
    felt_there,
    followed_mesh,
    line_teeth,
    modified_there,
    require_drive,
    require_teeth,
    start_of,
    tooth_table,
)
from gensig.driveline.time.newmark import LineSolver
from gensig.driveline.time.newmark_records import (
    SETTLING,
    line_motion,
    newmark_record,
)
from gensig.dynamics.backends.base import MOST_PAIRS
from gensig.dynamics.backends.registry import EXPLICIT_BACKEND
from gensig.dynamics.integrator import check_memory, require_step
from gensig.dynamics.pair import Body
from gensig.dynamics.response import LinearMachine
from gensig.errors import ConfigError, SimulationError
from gensig.faults.base import Fault
from gensig.geometry.contact import SIDES, GearPair
from gensig.geometry.gear import Gear
from gensig.mesh.modification import PLAIN, PairModification, sound_teeth
from gensig.mesh.options import SliceOptions
from gensig.mesh.pair_table import N_PAIRS
from gensig.mesh.tooth_table import ToothTable
from gensig.sensing.encoder import Disc
from gensig.sensing.manufacturing import perfect_specimen
from gensig.sensing.toothed_wheel import draw_wheel
from gensig.systems.base import Machine, MachineMesh, home_meshes, specimen_table
from gensig.systems.run import CleanRecord, Run, Start, angle_from_tooth_0
from gensig.systems.side_by_side import simulate_side_by_side
from gensig.systems.sliced_pair import SlicedPair
from gensig.systems.stiffness_curves import StiffnessCurves, stiffness_curves
from gensig.systems.supports import supports_in_gearbox
from gensig.units import SPEED

MOST_ENERGY_RESIDUAL = 1e-3


@final
@dataclass(frozen=True, kw_only=True)
class LineMachine(Machine):
    """An engine or a motor on its drive line. No slots: mean forces of its meshes are kept.

    Records follow the mesh ``mesh_number``; ``modification`` and ``heat`` as in ``ToothLaw``.
    """

    engine: EngineLine
    mesh_number: int
    slices: SliceOptions
    modification: PairModification = PLAIN
    heat: tuple[MeshHeat | None, ...] = ()

    @property
    def pair(self) -> GearPair:
        """Driving and driven gear of the followed mesh, as pinion and wheel."""
        return named_by_side(self.engine.drive.pairs[self.mesh_number])

    @property
    def flanks(self) -> SlicedPair:
        """As ``Machine.flanks``, under the mean force at the set-point."""
        return self.followed_law.flanks(self.pair, self.mesh_force)

    @property
    def has_whole_teeth(self) -> bool:
        """True where the followed mesh is of spur gears."""
        return self.pair.pinion.helix_angle == 0.0

    @property
    def gears(self) -> dict[str, Gear]:
        """All gears of the line: pinion and wheel of the followed mesh, others as in the tables."""
        return line_gears(self.engine.drive, self.mesh_number)

    @property
    def bodies(self) -> dict[str, Body]:
        """Mass and support of every gear, and the inertia of its node."""
        return line_bodies(self.engine.drive, self.mesh_number)

    @property
    def meshes(self) -> tuple[MachineMesh, ...]:
        """All meshes of the line; records follow one of them."""
        return line_meshes(self.engine.drive, self.mesh_number)

    @property
    def pinion_turns(self) -> dict[str, float]:
        """Turns of the pinion during one turn of every gear, by its name."""
        return pinion_turns(self.engine.drive, self.mesh_number)

    @property
    def ratio(self) -> float:
        """Speed of the driving gear's shaft over the crank's."""
        return self.engine.ratios[self.driving_node]

    @property
    def driving_node(self) -> int:
        """Number of the node that carries the driving gear of the record mesh."""
        drive = self.engine.drive
        gear = drive.line.meshes[self.mesh_number].driving
        return drive.numbers[drive.line.gears[gear].node]

    @property
    def line_solver(self) -> LineSolver:
        """Steps of the integration in time, and the energy residual above which a record fails."""
        return LineSolver(
            sampling_rate=self.sensing.sampling_rate,
            oversampling=self.solver.oversampling,
            max_energy_residual=MOST_ENERGY_RESIDUAL,
        )

    @property
    def channels(self) -> tuple[str, ...]:
        """Rotations of all gears, with lateral motion their bearings, speeds of toothed wheels."""
        speeds = [f"{name}{SPEED}" for name in self.engine.wheels]
        return (*gear_channels(self.engine.drive, self.mesh_number), *speeds)

    @property
    def side_by_side(self) -> bool:
        """True where the two-evaluation core integrates the line, several records at once."""
        return self.solver.backend == EXPLICIT_BACKEND

    @property
    def most_pairs(self) -> int:
        """Pairs of teeth of a mesh that are followed at once."""
        if any(pair.pinion.helix_angle != 0.0 for pair in self.engine.drive.pairs):
            return MOST_PAIRS
        return N_PAIRS

    @property
    def torque_of(self) -> str:
        """The brake or the load, at the shaft that turns the line, whichever mesh is followed."""
        if self.engine.has_cycle:
            return "brake, at the crank"
        return "load, as the motor feels it"

    @property
    def load_exponent(self) -> int:
        """Power of the speed that the torque of the load follows."""
        return self.engine.engine.load_exponent

    @property
    def mesh_force(self) -> float:
        """Mean normal force of the mesh at the set-point, N, or what closes it by 2 um."""
        number = self.mesh_number
        return reference_force(self.engine, number, float(self.mesh_forces[number]))

    @cached_property
    def mesh_forces(self) -> Array:
        """Mean normal forces of all meshes at the set-point, (mesh,) N."""
        return mesh_forces(
            self.engine, self.operating.speed / self.ratio, self.operating.torque
        )

    def modified(self, number: int) -> PairModification:
        """Flank modifications of a mesh."""
        drive = self.engine.drive
        return modified_there(drive, self.mesh_number, number, self.modification)

    @property
    def law(self) -> ToothLaw:
        """Material, conventions and slices of all teeth."""
        return ToothLaw(
            material=self.material,
            options=self.mesh,
            slices=self.slices,
            modification=self.modified(self.mesh_number),
            heat=self.heat,
        )

    @property
    def followed_law(self) -> ToothLaw:
        """The law of the followed mesh, hot where the line is."""
        return self.law.at_mesh(self.mesh_number)

    def mesh_table(self, faults: Sequence[Fault] = ()) -> ToothTable:
        """Tables of the followed mesh with those of the given faults that it feels."""
        drive = self.engine.drive
        require_teeth(drive, self.mesh_number, faults)
        felt = felt_there(drive, self.mesh_number, self.mesh_number, faults)
        return tooth_table(self.followed_law, self.pair, felt, self.mesh_force)

    def faulty_meshes(
        self, faults: Sequence[Fault]
    ) -> list[tuple[GearPair, tuple[Fault, ...]]]:
        """The meshes that feel any of the faults."""
        drive = self.engine.drive
        require_teeth(drive, self.mesh_number, faults)
        meshes = []
        for number, pair in enumerate(drive.pairs):
            if felt := felt_there(drive, self.mesh_number, number, faults):
                meshes.append((named_by_side(pair), felt))
        return meshes

    def stiffness_curves(
        self,
        faults: Sequence[Fault] = (),
        *,
        n_positions: int = 201,
        points_per_tooth: int = 100,
    ) -> StiffnessCurves:
        """Curves of the followed mesh under its mean force.

        ConfigError where its gears are helical.
        """
        name = self.engine.mesh_names[self.mesh_number]
        require_followed(name, faults)
        law, table = self.followed_law, self.mesh_table(faults)
        require_spur(name, table)
        return stiffness_curves(
            replace(self, material=law.material),
            table,
            faults,
            sound_teeth(self.pair, law.modification),
            n_positions=n_positions,
            points_per_tooth=points_per_tooth,
        )

    def check(self) -> None:
        """Raise for what would stop every record."""
        require_drive(self.pair, self.slices)
        check_sensing(self, lateral=self.engine.drive.lateral)
        check_solver(self.mesh, self.solver)
        warn_of_supports(self.engine, self.mesh_forces)
        self.quality.check_covered(*self.gears.values())
        check_memory(
            self.operating.duration,
            self.sensing.sampling_rate,
            len(self.sensing.channels),
            self.solver,
        )
        self.mesh_table()

    def driven_tooth(self, tooth_pinion: int, drawn: int) -> int:
        """Tooth of the driven gear at the start.

        In a drive that turns once a cycle of the engine, the marks of its timing decide. Where the
        gears do not come back to each other after every cycle, it is the drawn one.
        """
        pinion, wheel = self.pair.pinion.n_teeth, self.pair.wheel.n_teeth
        once_a_cycle = self.engine.has_cycle and round(2.0 * self.ratio) == 1
        if once_a_cycle and pinion % wheel == 0:
            return tooth_pinion % wheel
        return drawn

    def draw_discs(self, rng: np.random.Generator) -> tuple[Disc, ...]:
        """The toothed wheels of one gearbox with their errors."""
        return tuple(draw_wheel(rng, wheel) for wheel in self.engine.wheels.values())

    def gear_angle(self, gear: str, start: Start, shaft_angle: Array) -> Array:
        """As ``Machine.gear_angle``."""
        if gear in SIDES:
            return angle_from_tooth_0(self.pair, gear, start, shaft_angle)
        drive = self.engine.drive
        number = gear_names(drive, self.mesh_number).index(gear)
        ratio = self.engine.ratios[drive.numbers[drive.line.gears[number].node]]
        return ratio * (self.crank_angle(start) + shaft_angle / self.ratio)

    def line_angle(self, start: Start) -> float:
        """Angle of the crank or the motor, rad."""
        return self.crank_angle(start)

    def linear_machine(self, run: Run[Self]) -> LinearMachine:
        """The healthy line in the gearbox of a run, at the set-point."""
        speed, torque = self.operating.speed / self.ratio, self.operating.torque
        running = running_line(
            self._in_gearbox(run), steady_course(speed, torque), governor=self._governor
        )
        return linear_line(running, self.mesh_number, speed, self.channels)

    def at_gear(self, gear: str) -> tuple[Machine, str]:
        """As ``Machine.at_gear``."""
        number = home_meshes(self.meshes)[gear]
        side = SIDES[self.meshes[number].gears.index(gear)]
        other = replace(self, mesh_number=number, modification=self.modified(number))
        speed = self.operating.speed * other.ratio / self.ratio
        return replace(other, operating=replace(self.operating, speed=speed)), side

    def mesh_torques(self, speed: float, torque: float) -> Array:
        """As ``Machine.mesh_torques``; ``torque`` is that of the crank or the motor.

        The sound, nominal machine runs ``loads.SECONDS`` s at the set-point. Every pair of teeth
        that meets gives one load, as ISO 6336-6 counts damage. The mean load alone would miss the
        impacts of a mesh that rattles.

        Raises
        ------
        ConfigError        for machines that do not run steadily
        SimulationError    for a motion that cannot be integrated
        """
        return loads.greatest_loads(self.pair, *self._steady_run(speed, torque))

    def mean_torque(self, speed: float, torque: float) -> float:
        """As ``Machine.mean_torque``, with runs and errors of ``mesh_torques``."""
        _, force = self._steady_run(speed, torque)
        return loads.mean_torque(self.pair, force)

    def _steady_run(self, speed: float, torque: float) -> tuple[Array, Array]:
        """Angle of the pinion and force of the followed mesh at a set-point, (sample,) each."""
        if not self.operating.is_steady:
            raise ConfigError(
                "life: on a drive line set-points are steady; take operating=rated"
            )
        machine = replace(
            self, operating=replace(self.operating, speed=speed, torque=torque)
        )
        line = machine.line(Run(system=machine))
        force = "mesh_force", machine.mesh_number
        motion, angle = line_motion(machine, line, loads.SECONDS, [force])
        return angle, motion.signals[force]

    def felt(self, number: int, faults: Sequence[Fault]) -> tuple[Fault, ...]:
        """As ``Machine.felt``."""
        return felt_there(self.engine.drive, self.mesh_number, number, faults)

    def ready(self, run: Run[Self]) -> RunningLine:
        """As ``Machine.ready``; its first angle is that of the followed mesh's driving gear.

        Where the run asks for the loads of the teeth, it has the angles of all driving gears.
        """
        running, line = self.line(run), self.engine.drive.line
        for number, mesh in enumerate(running.dynamics.system.meshes):
            if number not in running.teeth:
                raise SimulationError(
                    "solver.backend = nystroem takes meshes of tabulated teeth, but mesh "
                    f"{mesh.name} has none; take solver.backend=newmark"
                )
        turned = [self.driving_node, *(w.node for w in self.engine.wheels.values())]
        if run.with_mesh_state:
            nodes = [line.gears[mesh.driving].node for mesh in line.meshes]
            turned += [self.engine.drive.numbers[node] for node in nodes]
        running = running.with_angles(turned)
        require_step(running.dynamics, self.solver, self.sensing.sampling_rate)
        return running

    def integrated(self, running: RunningLine) -> tuple[str, ...]:
        """As ``Machine.integrated``.

        A line without an acceleration has one all the same, by which its steps are checked.
        """
        dynamics = running.dynamics
        kinds = self.signals(running)
        dofs = [dof for kind, dof in kinds if kind == "acceleration"]
        return tuple(dynamics.dofs[dof] for dof in dofs or dynamics.system.angles[:1])

    def sensed(
        self, run: Run[Self], running: RunningLine, acceleration: Array, angle: Array
    ) -> Array:
        """As ``Machine.sensed``."""
        dofs, rate = self.integrated(running), self.sensing.sampling_rate
        motion = line_signals(running.dynamics, dofs, acceleration, angle, rate)
        return channel_rows(run, running, motion, self.mesh_number)

    @classmethod
    def simulate_runs(
        cls, runs: Sequence[Run[Self]]
    ) -> list[CleanRecord | SimulationError]:
        """Simulate runs side by side or one after the other, as their solver says."""
        results: dict[int, CleanRecord | SimulationError] = {}
        together = [n for n, run in enumerate(runs) if run.system.side_by_side]
        records = simulate_side_by_side([runs[n] for n in together])
        results.update(zip(together, records, strict=True))
        for number, run in enumerate(runs):
            if number not in results:
                try:
                    results[number] = newmark_record(run)
                except SimulationError as error:
                    results[number] = error
        return [results[number] for number in range(len(runs))]

    def line(self, run: Run[LineMachine]) -> RunningLine:
        """The line of one run, ready to be integrated."""
        specimen = run.specimen or perfect_specimen(self.pair.pinion, self.pair.wheel)
        start = run.start or Start()
        engine = self._in_gearbox(run)
        turned = self.crank_angle(start)
        teeth = start.tooth_pinion, start.tooth_wheel
        others = line_teeth(
            engine,
            self.law,
            self.mesh_forces,
            self.mesh_number,
            start_of(self.pair, teeth, start.phase),
            faults=run.faults,
            specimen=specimen,
            turned=turned,
        )
        table = specimen_table(self, run.faults, specimen)
        recorded = followed_mesh(table, specimen, start)
        return running_line(
            engine,
            operating_course(engine, self.operating, self.ratio, SETTLING),
            governor=self._governor,
            teeth={**others, self.mesh_number: recorded},
            turned=turned,
            local_losses=self.side_by_side and not self.engine.has_cycle,
        )

    @property
    def _governor(self) -> Governor:
        """Speed control, or governor, that holds the mean speed."""
        return Governor(
            frequency=self.operating.drive_frequency,
            damping_ratio=self.operating.drive_damping_ratio,
        )

    def _in_gearbox(self, run: Run[Self]) -> EngineLine:
        """The line with the supports of a run's gearbox under its gears."""
        engine = self.engine
        if run.gearbox is None or not engine.drive.lateral:
            return engine
        supports = supports_in_gearbox(self.bodies, run.gearbox, self.quality)
        held = with_supports(engine.drive, self.mesh_number, supports)
        return replace(engine, drive=held)

    def crank_angle(self, start: Start) -> float:
        """Angle of the crank or the motor at a start, rad; a lead-in gives it, as much earlier."""
        if start.line_angle is not None:
            return start.line_angle
        return driving_angle(
            self.engine.drive,
            self.mesh_number,
            start,
            ratio=self.ratio,
            has_cycle=self.engine.has_cycle,
        )

    def signals(self, line: RunningLine) -> list[tuple[str, int]]:
        """Signals of the integration for the channels, see ``channel``."""
        followed, names = self.mesh_number, self.sensing.channels
        return [channel(line, followed, name) for name in names]
