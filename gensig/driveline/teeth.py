"""The teeth of the meshes of a line: tables of spur and helical pairs, and what a gear takes
along from mesh to mesh.

``docs/theory/drive_lines.md``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from gensig.arrays import Array
from gensig.driveline.drive_line import DriveLine
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.line_gears import gear_names, line_gears, line_meshes
from gensig.driveline.mesh_phase import (
    first_slice_lead,
    mesh_start,
    start_phases,
    start_rolls,
    tooth_angle,
    tooth_angles,
)
from gensig.driveline.running import named_by_side, reference_force
from gensig.dynamics.mesh_teeth import MeshTeeth
from gensig.errors import ConfigError, FaultError, GeometryError
from gensig.faults.base import Fault, faulty_teeth, require_gears
from gensig.geometry.contact import SIDES, GearPair
from gensig.material import Material
from gensig.mesh.load_distribution import loaded_pair_table
from gensig.mesh.modification import (
    PLAIN,
    PairModification,
    sound_teeth,
)
from gensig.mesh.options import MeshOptions, SliceOptions
from gensig.mesh.pair_table import node_positions
from gensig.mesh.sliced.sliced_table import sliced_table
from gensig.mesh.sliced.slices import slice_middles
from gensig.mesh.thermal.thermal_growth import PairGrowth
from gensig.mesh.tooth_table import ToothTable
from gensig.sensing.manufacturing import GearErrors, Specimen
from gensig.systems.base import home_meshes
from gensig.systems.run import Start
from gensig.systems.sliced_pair import SlicedPair

# most of a pitch of sound helical teeth: short tables are read faster, and these ripple slowly
SOUND_NODES = 128
# at which sound helical teeth are tabulated: chords reach over all depths of bite
FORCES_PER_OCTAVE = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class MeshHeat:
    """Effects of heat on the teeth of a mesh.

    ``material`` at their temperature, ``growth`` of its gears or None.
    """

    material: Material
    growth: PairGrowth | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ToothLaw:
    """Material, conventions and slices of all teeth of a line.

    ``modification`` is that of the followed mesh, see ``modified_there``. ``heat`` (mesh,) has
    None for meshes without effects; it is empty for a cold line.
    """

    material: Material
    options: MeshOptions
    slices: SliceOptions
    modification: PairModification = PLAIN
    heat: tuple[MeshHeat | None, ...] = ()

    def at_mesh(self, number: int) -> ToothLaw:
        """The law of one mesh, with the effects of heat there."""
        law = replace(self, heat=())
        effects = self.heat[number] if self.heat else None
        if effects is None:
            return law
        hot = replace(self.modification, growth=effects.growth)
        return replace(law, material=effects.material, modification=hot)

    def flanks(self, pair: GearPair, force: float) -> SlicedPair:
        """A pair at rest under a mean force in N, in slices."""
        return SlicedPair(
            pair=pair,
            material=self.material,
            mesh=self.options,
            slices=self.slices,
            modification=self.modification,
            torque=force * pair.pinion.base_radius,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ToothStart:
    """The teeth of a mesh that are in place at time 0, and how far the middle of their faces is
    past A, pitches.
    """

    teeth: tuple[int, int]
    phase: float


@lru_cache(maxsize=48)
def tooth_table(
    law: ToothLaw, pair: GearPair, faults: tuple[Fault, ...], force: float
) -> ToothTable:
    """Table of a pair under a mean force in N.

    Of spur teeth as they are, of helical ones in slices.
    """
    cut = law.modification
    if pair.pinion.helix_angle == 0.0:
        teeth = faulty_teeth(pair, faults, sound_teeth(pair, cut))
        return loaded_pair_table(
            pair, law.material, law.options, teeth, force=force, modification=cut
        )
    deviation = None
    if cut.is_any:
        position = node_positions(pair, law.options)
        deviation = cut.deviation(pair, position, slice_middles(pair, law.slices))
    teeth = faulty_teeth(pair, faults)
    return sliced_table(
        pair,
        law.material,
        law.options,
        law.slices,
        teeth,
        force=force,
        deviation=deviation,
    )


def require_drive(pair: GearPair, slices: SliceOptions) -> None:
    """Raise unless at least one pair of teeth is always in contact, by the overlap of the face
    too.
    """
    if pair.pinion.helix_angle == 0.0:
        pair.require_continuous_drive()
    elif slices.slices_in_phase:
        raise ConfigError(
            "mesh.slices_in_phase = true is for comparing statics; a line has the "
            "helix in: take false"
        )
    elif pair.total_contact_ratio < 1.0:
        raise GeometryError(
            f"the total contact ratio {pair.total_contact_ratio:.4f} is below 1, so "
            "the drive is interrupted at every "
            f"tooth; use more teeth, a wider face or a larger helix angle"
        )


def sound_meshes(
    machine: EngineLine, law: ToothLaw, forces: Array
) -> dict[int, MeshTeeth]:
    """Healthy teeth of the meshes by index, each under its mean force of ``forces`` (mesh,) N.

    The first node has not turned.

    Helical meshes only with ``system.helical_meshes=sliced``.
    """
    n_nodes = min(law.options.points_per_pitch, SOUND_NODES)
    thin = replace(law, options=replace(law.options, points_per_pitch=n_nodes))
    meshes, phases = {}, start_phases(machine.drive)
    for number, pair in enumerate(machine.drive.pairs):
        is_helical = pair.pinion.helix_angle != 0.0
        if is_helical and not machine.drive.slices_helical:
            continue
        law_of_pair = (law, thin)[is_helical]
        table = _table_in_line(machine, law_of_pair, number, (), float(forces[number]))
        meshes[number] = MeshTeeth.perfect(table, start_phase=phases[number])
    return meshes


def _table_in_line(
    machine: EngineLine,
    law: ToothLaw,
    number: int,
    faults: tuple[Fault, ...],
    force: float,
) -> ToothTable:
    pair, force = machine.drive.pairs[number], reference_force(machine, number, force)
    law = law.at_mesh(number)
    require_drive(pair, law.slices)
    if pair.pinion.helix_angle:
        force = 2.0 ** (
            math.ceil(FORCES_PER_OCTAVE * math.log2(force)) / FORCES_PER_OCTAVE
        )
    return tooth_table(law, named_by_side(pair), faults, force)


def neighbours(drive: DriveLine, number: int) -> dict[int, tuple[int, int]]:
    """Other meshes of the two gears of a mesh.

    By index, the side of the gear in this mesh and in the other one.
    """
    meshes_of = {}
    followed = drive.line.meshes[number]
    gears = followed.driving, followed.driven
    for other, mesh in enumerate(drive.line.meshes):
        for there, gear in enumerate((mesh.driving, mesh.driven)):
            if other != number and gear in gears:
                meshes_of[other] = gears.index(gear), there
    return meshes_of


def line_teeth(
    machine: EngineLine,
    law: ToothLaw,
    forces: Array,
    followed: int,
    start: ToothStart,
    *,
    faults: Sequence[Fault],
    specimen: Specimen,
    turned: float,
) -> dict[int, MeshTeeth]:
    """The teeth of all meshes but the followed one, by their index.

    Each mesh has what its two gears have there (``felt_there``), and its own mounting. Helical
    meshes that ``is_tabulated`` leaves out keep the stiffness of the table.

    Raises
    ------
    FaultError    for a fault that no teeth feel
    """
    drive = machine.drive
    require_teeth(drive, followed, faults)
    names, homes = gear_names(drive, followed), _homes(drive, followed)
    features = (*specimen.gear_forms, *faults)
    further = [number for number in range(len(drive.pairs)) if number != followed]
    meshes, phases = {}, start_phases(drive, turned)
    for place, number in enumerate(further):
        if not is_tabulated(drive, followed, number):
            continue
        mounting = specimen.mounting(place)
        felt = felt_there(drive, followed, number, features)
        cut = modified_there(drive, followed, number, law.modification)
        table = _table_in_line(
            machine,
            replace(law, modification=cut),
            number,
            (*felt, *mounting.forms(SIDES[0])),
            float(forces[number]),
        )
        backlash = table.pair.backlash * mounting.backlash_factor
        ends = _ends(drive, number)
        errors = []
        for there, gear in enumerate(ends):
            n_teeth = _gears(drive.pairs[number])[there].n_teeth
            teeth = GearErrors(error=np.zeros(n_teeth), tilt=np.zeros(n_teeth))
            if ends[there] == _ends(drive, homes[gear])[there]:
                teeth = specimen.errors_of(names[gear], n_teeth)
            errors.append(teeth)
        meshes[number] = MeshTeeth(
            table=replace(table, pair=replace(table.pair, backlash=backlash)),
            errors=(errors[0].error, errors[1].error),
            tilts=(errors[0].tilt, errors[1].tilt),
            start_teeth=start_teeth(drive, followed, number, start, turned),
            start_phase=phases[number],
        )
    return meshes


def followed_mesh(table: ToothTable, specimen: Specimen, start: Start) -> MeshTeeth:
    """The teeth of the followed mesh, of a table that has the forms of its specimen."""
    pinion, wheel = (
        specimen.errors_of(side, gear.n_teeth)
        for side, gear in zip(SIDES, _gears(table.pair), strict=True)
    )
    return MeshTeeth(
        table=table,
        errors=(pinion.error, wheel.error),
        tilts=(pinion.tilt, wheel.tilt),
        start_teeth=(start.tooth_pinion, start.tooth_wheel),
        start_phase=start.phase,
    )


def felt_there(
    drive: DriveLine, followed: int, number: int, features: Iterable[Fault]
) -> tuple[Fault, ...]:
    """Faults and forms of gears as a mesh feels them, named by its sides.

    A gear that drives there and in its home mesh (``home_meshes``), or is driven in both, is met
    on the same flanks: all of it is felt, but for misalignment, which is of the mounting of the
    home mesh. Else its other flanks are met, and ``Fault.on_other_flank`` says what they feel.
    """
    names, homes = gear_names(drive, followed), _homes(drive, followed)
    sides = {names[gear]: side for side, gear in enumerate(_ends(drive, number))}
    felt: list[Fault] = []
    for feature in features:
        side = sides.get(feature.gear)
        if side is None:
            continue
        gear = _ends(drive, number)[side]
        there: Fault | None = feature
        if homes[gear] != number and feature.of_mounting:
            there = None
        elif _ends(drive, homes[gear])[side] != gear:
            there = feature.on_other_flank()
        if there is not None:
            felt.append(replace(there, gear=SIDES[side]))
    return tuple(felt)


def modified_there(
    drive: DriveLine, followed: int, number: int, modification: PairModification
) -> PairModification:
    """The modification of a mesh: the given one of the followed mesh as this mesh meets it.

    Pinion and wheel have it on the flanks that work in the followed mesh, so also where the pinion
    drives and where the wheel is driven. The misalignment is of the mounting of the two. Elsewhere,
    and where none is given, gears have the tip relief of the table.
    """
    by_table = drive.relief(number)
    if not modification.is_any:
        return by_table
    if number == followed:
        return modification
    here = zip(_ends(drive, followed), _ends(drive, number), SIDES, strict=True)
    flanks = by_table.sides
    for gear, there, side in here:
        if gear == there:
            flanks[side] = modification.sides[side]
    return PairModification(pinion=flanks[SIDES[0]], wheel=flanks[SIDES[1]])


def is_tabulated(drive: DriveLine, followed: int, number: int) -> bool:
    """Return whether a mesh of records is made of teeth, whatever its gears have.

    Helical meshes are with ``system.helical_meshes=sliced``; the followed mesh and those that
    share a gear with it always are.
    """
    is_helical = drive.pairs[number].pinion.helix_angle != 0.0
    shares = set(_ends(drive, number)) & set(_ends(drive, followed))
    return drive.slices_helical or not is_helical or bool(shares)


def require_teeth(drive: DriveLine, followed: int, faults: Iterable[Fault]) -> None:
    """Raise a FaultError for a fault on a gear that is not in the line, or without teeth."""
    faults, names = tuple(faults), gear_names(drive, followed)
    require_gears(faults, tuple(line_gears(drive, followed)))
    for fault in faults:
        home = _homes(drive, followed)[names.index(fault.gear)]
        if not is_tabulated(drive, followed, home):
            raise FaultError(
                f"fault.gear = {fault.gear!r}: with system.helical_meshes=constant its mesh has "
                "no teeth; take system.helical_meshes=sliced"
            )


def _homes(drive: DriveLine, followed: int) -> dict[int, int]:
    """Home mesh of each gear, by their indices."""
    names = gear_names(drive, followed)
    of_name = home_meshes(line_meshes(drive, followed))
    return {names.index(name): number for name, number in of_name.items()}


def _ends(drive: DriveLine, number: int) -> tuple[int, int]:
    """Indices of the driving and the driven gear of a mesh."""
    mesh = drive.line.meshes[number]
    return mesh.driving, mesh.driven


def start_teeth(
    drive: DriveLine, followed: int, number: int, start: ToothStart, turned: float
) -> tuple[int, int]:
    """Teeth of a mesh that are in place when the crank has turned by ``turned`` rad.

    The gears of the followed mesh have there the teeth of its ``start``. Tooth 0 of any other
    gear is the one that ``tooth_angles`` says where it is when the crank has not turned.
    """
    here = _ends(drive, followed)
    angles = tooth_angles(drive, turned)
    teeth = []
    for side, gear in enumerate(_ends(drive, number)):
        if gear in here:
            place = (followed, here.index(gear))
            tooth = tooth_there(drive, place, (number, side), start, turned)
        else:
            ratio = drive.line.speed_ratio[drive.line.gears[gear].node]
            angle = math.copysign(1.0, ratio) * float(angles[gear])
            tooth = _tooth_in_place(drive, (number, side), angle, turned)
        teeth.append(tooth)
    return teeth[0], teeth[1]


def tooth_there(
    drive: DriveLine,
    here: tuple[int, int],
    there: tuple[int, int],
    start: ToothStart,
    turned: float,
) -> int:
    """The tooth of a gear that is in place in another of its meshes when ``turned`` rad of the
    first node.

    ``here``, ``there`` are the index of a mesh and the gear's side in it, 0 driving and 1 driven.
    """
    angle = tooth_angle(
        _gears(drive.pairs[here[0]])[here[1]].n_teeth,
        mate_angle=_mate_angle(drive, *here),
        drives=here[1] == 0,
        start=(start.teeth[here[1]], start.phase),
        pitch_point=_pitch_point(drive, here[0]),
    )
    return _tooth_in_place(drive, there, angle, turned)


def _tooth_in_place(
    drive: DriveLine, there: tuple[int, int], angle: float, turned: float
) -> int:
    """The tooth of a gear that is in place in a mesh when the first node has turned by ``turned``
    rad and the gear's tooth 0 is at ``angle`` rad, counted as the gear turns.
    """
    number, side = there
    pair = drive.pairs[number]
    n_teeth = _gears(pair)[side].n_teeth
    tooth, phase = mesh_start(
        n_teeth,
        mate_angle=_mate_angle(drive, *there),
        drives=side == 0,
        tooth_angle=angle,
        pitch_point=_pitch_point(drive, number),
    )
    # where the line says that a tooth is; play and profile shift move it by some hundredths of a
    # pitch
    rolled = float(start_rolls(drive, turned)[number]) / pair.base_pitch
    return round(tooth + phase - rolled) % n_teeth


def _gears(pair: GearPair) -> tuple:
    return pair.pinion, pair.wheel


def _pitch_point(drive: DriveLine, number: int) -> float:
    return drive.pairs[number].pitch_point / drive.pairs[number].base_pitch


def _mate_angle(drive: DriveLine, number: int, side: int) -> float:
    """From a gear's centre to its mate's, counted as the gear turns, rad."""
    mesh, gears = drive.line.meshes[number], drive.line.gears
    gear = (mesh.driving, mesh.driven)[side]
    sense = math.copysign(1.0, drive.line.speed_ratio[gears[gear].node])
    return sense * (mesh.center_line + side * math.pi)


def start_of(pair: GearPair, teeth: tuple[int, int], phase: float) -> ToothStart:
    """From the phase at which the first slices of teeth begin, pitches."""
    return ToothStart(
        teeth=teeth, phase=phase - first_slice_lead(pair) / pair.base_pitch
    )
