"""A machine of one gear pair: lateral and torsional motion, many records side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Self, final

import numpy as np

from gensig.arrays import Array
from gensig.dynamics.backends.base import MOST_PAIRS
from gensig.dynamics.helical import AXIAL_DOFS
from gensig.dynamics.integrator import (
    check_channels,
    check_machine,
    check_memory,
)
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.dynamics.pair import PAIR_DOFS, Body, Rotor, RunningPair
from gensig.dynamics.response import LinearMachine, linear_pair
from gensig.errors import ConfigError, FaultError, GeometryError, SimulationError
from gensig.faults.base import Fault, faulty_teeth, require_gears
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.material import Material
from gensig.mesh.load_distribution import loaded_pair_table
from gensig.mesh.modification import (
    PLAIN,
    FlankModification,
    PairModification,
    sound_teeth,
)
from gensig.mesh.options import MeshOptions, SliceOptions
from gensig.mesh.pair_table import N_PAIRS
from gensig.mesh.thermal.paper_growth import PaperGrowth
from gensig.mesh.tooth_table import ToothTable
from gensig.sensing.encoder import Disc
from gensig.sensing.manufacturing import nominal_gearbox, perfect_specimen
from gensig.systems.base import Machine, MachineMesh, specimen_table
from gensig.systems.integration_checks import (
    check_steps,
)
from gensig.systems.run import CleanRecord, Run, Start, angle_from_tooth_0
from gensig.systems.side_by_side import simulate_side_by_side
from gensig.systems.sliced_pair import SlicedPair
from gensig.systems.stiffness_curves import (
    StiffnessCurves,
    single_pair,
    stiffness_curves,
)
from gensig.systems.supports import in_gearbox


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class GearPairMachine(Machine):
    """One gear pair with its supports, drive, motor and load.

    Parameters
    ----------
    slices : of the flanks at rest, and of the teeth of records unless they are whole
    has_whole_teeth : False for teeth in slices, whose gears also move along their axes and tilt
    modification : of all teeth, before errors and faults
    hot_teeth : growth of teeth by ``mesh.heat_law=paper``
    """

    pair: GearPair = field()
    pinion: Body
    wheel: Body
    slices: SliceOptions
    has_whole_teeth: bool = field()
    modification: PairModification = PLAIN
    hot_teeth: PaperGrowth | None = None
    motor: Rotor | None = None
    load: Rotor | None = None

    @property
    def flanks(self) -> SlicedPair:
        """As ``Machine.flanks``: transmission error, load over the flanks and stiffness."""
        return SlicedPair(
            pair=self.pair,
            material=self.material,
            mesh=self.mesh,
            slices=self.slices,
            modification=replace(self.modification, growth=None),
            torque=self.operating.torque,
            growth=self.modification.growth,
            hot_teeth=self.hot_teeth,
        )

    @property
    def gear_channels(self) -> tuple[str, ...]:
        """Motions of both gears across and along the line of action, and rotations.

        Gears whose teeth are in slices also have those along their axes, and tilts.
        """
        if self.has_whole_teeth:
            return PAIR_DOFS
        return (*PAIR_DOFS, *AXIAL_DOFS)

    @property
    def most_pairs(self) -> int:
        """Pairs of teeth that are followed at once."""
        if self.has_whole_teeth:
            return N_PAIRS
        return MOST_PAIRS

    def require_drive(self) -> None:
        """Raise unless at least one pair of teeth is always in contact.

        The overlap of the face counts for teeth in slices.
        """
        if self.has_whole_teeth:
            self.pair.require_continuous_drive()
            return
        if self.slices.slices_in_phase:
            raise ConfigError(
                "mesh.slices_in_phase = true is for comparing statics; records have the helix in: "
                "take false"
            )
        if self.pair.total_contact_ratio < 1.0:
            raise GeometryError(
                f"the total contact ratio {self.pair.total_contact_ratio:.4f} is below 1, so the "
                "drive is interrupted at every tooth; use more teeth, a wider face, a larger helix "
                "angle or a larger addendum_coefficient"
            )

    def mesh_table(self, faults: Sequence[Fault] = ()) -> ToothTable:
        """As ``Machine.mesh_table``."""
        if not self.has_whole_teeth:
            return self.flanks.mesh_table(faults)
        machine = self.pair, self.material, self.mesh
        return _mesh_table(*machine, tuple(faults), self.mesh_force, self.modification)

    def stiffness_curves(
        self,
        faults: Sequence[Fault] = (),
        *,
        n_positions: int = 201,
        points_per_tooth: int = 100,
    ) -> StiffnessCurves:
        """As ``Machine.stiffness_curves``, with their parts.

        Contact ratios below 1 are allowed.
        """
        if not self.has_whole_teeth:
            raise ConfigError(
                "stiffness_curves are those of system=spur_pair; a helical pair has its stiffness "
                "slice by slice: flanks.transmission_error(), or gensig stiffness "
                "system=helical_pair"
            )
        return stiffness_curves(
            self,
            self.mesh_table(faults),
            faults,
            sound_teeth(self.pair, self.modification),
            n_positions=n_positions,
            points_per_tooth=points_per_tooth,
        )

    def long_relief(self) -> PairModification:
        """Linear tip reliefs that compensate the deflection of unmodified teeth at the set torque.

        From the tips down to the begin of single-pair contact (point B of the wheel, D of the
        pinion), as deep as the deflection of the pair there less the body's part, which the next
        pair shares.

        Raises
        ------
        ConfigError      for teeth in slices
        GeometryError    for a contact ratio outside 1..2: without single-pair contact

        Source: Welbourn's rule as in Lin, Oswald & Townsend (1989), see
        ``docs/theory/spur_mesh.md``; the shared part is ours.
        """
        if not self.has_whole_teeth:
            raise ConfigError(
                "long_relief is for whole spur teeth: take system=spur_pair; a helical pair has "
                "gensig modify-flank"
            )
        pair = self.pair
        if not 1.0 <= pair.transverse_contact_ratio < 2.0:
            raise GeometryError(
                f"the transverse contact ratio {pair.transverse_contact_ratio:.4f} lies outside "
                "1..2, where a pair carries alone for a while: that is where these reliefs begin"
            )
        alone = np.array([pair.base_pitch, pair.path_of_contact - pair.base_pitch])
        plain = replace(self, modification=PLAIN)
        shared = plain.mesh_table().shared_compliance
        sound = single_pair(plain, alone, (), sound_teeth(pair, PLAIN))
        depth = self.mesh_force * (1.0 / sound.stiffness - shared)
        pinion_start = pair.pinion_curvature(alone[0])
        wheel_start = pair.wheel_curvature(alone[1])
        return PairModification(
            pinion=_tip_relief(pair.pinion, depth[0], pinion_start),
            wheel=_tip_relief(pair.wheel, depth[1], wheel_start),
        )

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

    def linear_machine(self, run: Run[Self]) -> LinearMachine:
        """The healthy pair in the gearbox of a run."""
        return linear_pair(running_pair(replace(run, faults=(), specimen=None)))

    def felt(self, number: int, faults: Sequence[Fault]) -> tuple[Fault, ...]:
        """All faults: both gears are in the one mesh."""
        return tuple(faults)

    def ready(self, run: Run[Self]) -> RunningPair:
        """As ``Machine.ready``; warns of a coarse step whose error is not looked at."""
        running = running_pair(run)
        check_machine(running.dynamics, self.solver, self.sensing.sampling_rate)
        return running

    def integrated(self, running: RunningPair) -> tuple[str, ...]:
        """The channels: all are motions of the pair."""
        return self.sensing.channels

    def sensed(
        self, run: Run[Self], running: RunningPair, acceleration: Array, angle: Array
    ) -> Array:
        """As ``Machine.sensed``."""
        if run.gearbox is not None:
            acceleration *= run.gearbox.gain[:, None]
        return acceleration

    def check(self) -> None:
        """Raise for errors of every record: drive, fits, channels, step length, rest."""
        self.require_drive()
        self.mesh_table()
        self.quality.check_covered(self.pair.pinion, self.pair.wheel)
        sensing, operating = self.sensing, self.operating
        n_channels, rate = len(sensing.channels), sensing.sampling_rate
        check_memory(operating.duration, rate, n_channels, self.solver)
        nominal = running_pair(Run(system=self, faults=()))
        check_channels(sensing.channels, self.channels)
        sensing.check_gears(self.gears)
        sensing.check(operating.duration)
        check_steps(nominal.dynamics, self.solver, rate)
        nominal.dynamics.check_rest()

    @classmethod
    def simulate_runs(
        cls, runs: Sequence[Run[Self]]
    ) -> list[CleanRecord | SimulationError]:
        """Records of runs; those that share rate, duration and law are simulated side by side."""
        return simulate_side_by_side(runs)


def _tip_relief(
    gear: Gear, depth: float, curvature: Array | float
) -> FlankModification:
    """Tip relief from a curvature radius in m up."""
    start_radius = float(np.hypot(gear.base_radius, curvature))
    height = gear.tip_radius - start_radius
    return FlankModification(tip_relief=float(depth), tip_relief_height=height)


@lru_cache(maxsize=32)
def _mesh_table(
    pair: GearPair,
    material: Material,
    mesh: MeshOptions,
    faults: tuple[Fault, ...],
    force: float,
    modification: PairModification,
) -> ToothTable:
    teeth = faulty_teeth(pair, faults, sound_teeth(pair, modification))
    return loaded_pair_table(
        pair, material, mesh, teeth, force=force, modification=modification
    )


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


def running_pair(run: PairRun) -> RunningPair:
    """The pair of a run with its specimen and gearbox; GeometryError without a drive."""
    machine, pair = run.system, run.system.pair
    machine.require_drive()
    start = run.start or Start()
    specimen = run.specimen or perfect_specimen(pair.pinion, pair.wheel)
    gearbox = run.gearbox or nominal_gearbox(len(machine.sensing.channels))
    return RunningPair(
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
