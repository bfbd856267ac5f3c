"""The teeth of the meshes of a line: tables of spur and helical pairs, and what a gear takes
along from mesh to mesh.

``docs/theory/shaft_line_records.md``.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.drive_line import DriveLine
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.mesh_phase import first_slice_lead, start_rolls
from gensig.driveline.running import TabulatedMesh, named_by_side, reference_force
from gensig.driveline.time.line_mesh import mesh_start, tooth_angle
from gensig.errors import ConfigError, GeometryError
from gensig.faults.base import Fault, faulty_teeth
from gensig.geometry.contact import SIDES, GearPair
from gensig.material import Material
from gensig.mesh.load_distribution import loaded_pair_table
from gensig.mesh.options import MeshOptions, SliceOptions
from gensig.mesh.pair_table import PairTable
from gensig.mesh.sliced.sliced_table import SlicedTable, sliced_table
from gensig.sensing.manufacturing import Specimen

Array = NDArray[np.float64]

# most of a pitch of sound helical teeth: short tables are read faster, and these ripple slowly
SOUND_NODES = 128
# at which sound helical teeth are tabulated: chords reach over all depths of bite
FORCES_PER_OCTAVE = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class ToothLaw:
    """Material, conventions and slices of all teeth of a line."""

    material: Material
    options: MeshOptions
    slices: SliceOptions


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
) -> PairTable | SlicedTable:
    """Table of a pair under a mean force in N.

    Of spur teeth as they are, of helical ones in slices.
    """
    teeth = faulty_teeth(pair, faults)
    if pair.pinion.helix_angle == 0.0:
        return loaded_pair_table(pair, law.material, law.options, teeth, force=force)
    return sliced_table(pair, law.material, law.options, law.slices, teeth, force=force)


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
    machine: EngineLine, law: ToothLaw, forces: Array, *, left_out: Collection[int] = ()
) -> dict[int, TabulatedMesh]:
    """Sound teeth of the meshes by their index, each under its mean force of ``forces`` (mesh,) N.

    Helical meshes only with ``system.helical_meshes=sliced``; those of ``left_out`` are left out.
    """
    n_nodes = min(law.options.points_per_pitch, SOUND_NODES)
    thin = replace(law, options=replace(law.options, points_per_pitch=n_nodes))
    meshes = {}
    for number, pair in enumerate(machine.drive.pairs):
        is_helical = pair.pinion.helix_angle != 0.0
        if number in left_out or (is_helical and not machine.drive.slices_helical):
            continue
        law_of_pair = (law, thin)[is_helical]
        table = _table_in_line(machine, law_of_pair, number, (), float(forces[number]))
        meshes[number] = TabulatedMesh(table=table)
    return meshes


def _table_in_line(
    machine: EngineLine,
    law: ToothLaw,
    number: int,
    faults: tuple[Fault, ...],
    force: float,
) -> PairTable | SlicedTable:
    pair, force = machine.drive.pairs[number], reference_force(machine, number, force)
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


def neighbour_meshes(
    machine: EngineLine,
    law: ToothLaw,
    forces: Array,
    number: int,
    start: ToothStart,
    *,
    faults: Sequence[Fault],
    specimen: Specimen,
    turned: float,
) -> dict[int, TabulatedMesh]:
    """The other meshes of the two gears of a mesh with what these gears have, sound or not, by
    their index.

    A gear that drives in both meshes, or is driven in both, is met on the same flanks: its faults
    and errors come along, but for misalignment, which is a pair's. Else its other flanks are met,
    which are without errors, and feel of the faults what ``Fault.on_other_flank`` says. Mates are
    perfect.
    """
    meshes_of = {}
    for other, (here, there) in neighbours(machine.drive, number).items():
        features = [
            feature
            for feature in (*specimen.forms, *faults)
            if feature.gear == SIDES[here] and not feature.of_mounting
        ]
        errors = [np.zeros(gear.n_teeth) for gear in _gears(machine.drive.pairs[other])]
        if here == there:
            errors[there] = (specimen.pinion_error, specimen.wheel_error)[here]
        else:
            other_flanks = [feature.on_other_flank() for feature in features]
            features = [flank for flank in other_flanks if flank is not None]
        carried = tuple(replace(feature, gear=SIDES[there]) for feature in features)
        teeth = [0, 0]
        teeth[there] = tooth_there(
            machine.drive, (number, here), (other, there), start, turned
        )
        meshes_of[other] = TabulatedMesh(
            table=_table_in_line(machine, law, other, carried, float(forces[other])),
            errors=(errors[0], errors[1]),
            start_teeth=(teeth[0], teeth[1]),
        )
    return meshes_of


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
    n_teeth = _gears(drive.pairs[here[0]])[here[1]].n_teeth
    angle = tooth_angle(
        n_teeth,
        mate_angle=_mate_angle(drive, *here),
        drives=here[1] == 0,
        start=(start.teeth[here[1]], start.phase),
        pitch_point=_pitch_point(drive, here[0]),
    )
    tooth, phase = mesh_start(
        n_teeth,
        mate_angle=_mate_angle(drive, *there),
        drives=there[1] == 0,
        tooth_angle=angle,
        pitch_point=_pitch_point(drive, there[0]),
    )
    number, pair = there[0], drive.pairs[there[0]]
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
