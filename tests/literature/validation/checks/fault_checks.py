"""Effects of faults on teeth, flanks and stiffness, by the names that the rows use."""

from __future__ import annotations

import numpy as np

from gensig.faults.base import faulty_teeth
from gensig.faults.flank_loss import pitch_abscissa, root_chord_abscissa
from gensig.faults.pitting import Pitting
from gensig.geometry.tooth import Tooth
from gensig.mesh.pair_table import structural_compliance
from validation.case import Case, read_case, with_fault, with_words
from validation.checks.body_checks import structure
from validation.checks.geometry_checks import Check
from validation.checks.mesh_checks import mesh_stiffness, single_pair_stiffness
from validation.pair_compliances import pair_compliance


def _faulty_tooth(case: Case) -> Tooth:
    fault = case.faults[0]
    return faulty_teeth(case.pair, case.faults)[
        fault.gear, fault.teeth(case.gear(fault.gear))[0]
    ]


def _fault_increment(case: Case, at: str) -> float:
    """Compliance that the fault adds to its tooth and body."""
    side = case.faults[0].gear
    curvature = case.curvature(side, at)
    faulty = structural_compliance(
        _faulty_tooth(case), curvature, case.structure_material, case.system.mesh
    )
    return float(faulty[0]) - float(structure(case, side, curvature)[0])


def _increment_over_papers(case: Case, at: str) -> float:
    """The crack's increment over that of eqs. (11) and (12)."""
    return _fault_increment(case, at) / _fault_increment(
        with_words(case, "mesh.crack=paper"), at
    )


def stiffness_loss(case: Case, at: str) -> float:
    """Share of the sound pair's stiffness that the fault takes at a named point."""
    return 1.0 - single_pair_stiffness(case, at) / single_pair_stiffness(
        with_fault(case), at
    )


def _contact_loss(case: Case, at: str) -> float:
    """The part of that loss which the contact alone would cost."""
    sound = 1.0 / single_pair_stiffness(with_fault(case), at)
    contact = 1.0 / single_pair_stiffness(case, at) - sound - _fault_increment(case, at)
    return contact / (sound + contact)


def _pit_over_crack(case: Case, at: str) -> float:
    """The pit's loss over that of the 1 mm crack; ``at`` says where the crack starts."""
    crack = with_fault(case, "fault=crack", f"fault.crack_start={at}")
    return stiffness_loss(case, "C") / stiffness_loss(crack, "C")


def _smallest_step(case: Case, at: str) -> float:
    """Smallest growth of the loss at C along a series of severities ``fault key.

    Value value ...``.
    """
    key, _, values = at.partition(":")
    series = [
        0.0,
        *(
            stiffness_loss(read_case((*case.overrides, f"{key}={value}")), "C")
            for value in values.split()
        ),
    ]
    return float(np.diff(series).min())


def _crack_tip_half_thickness(case: Case, at: str) -> float:
    """h_q of eqs. (11) and (12): how far the crack's tip is from the tooth centreline."""
    crack = _faulty_tooth(case).cracks[0]
    return crack.mouth_half_thickness - float(crack.depth.max()) * float(
        np.sin(crack.angle)
    )


def _pit_end(case: Case, at: str) -> float:
    """Curvature radius of the flank at the ``lower`` or ``upper`` end of a pit on the pitch
    circle.
    """
    tooth = _faulty_tooth(case)
    flank = tooth.profile.abscissa[tooth.profile.n_root_cells :]
    (pit,) = (fault for fault in case.faults if isinstance(fault, Pitting))
    share = {"lower": -0.5, "upper": 0.5}[at]
    end = pitch_abscissa(tooth.gear) + share * pit.pit_length
    return float(np.interp(end, flank, tooth.profile.curvature_radius))


def _pit_abscissa(case: Case, at: str) -> float:
    """Abscissa of the middle of the paper's pit, from the centre of the gear or from the root
    chord.
    """
    gear = case.gear(case.faults[0].gear)
    middle = pitch_abscissa(gear)
    if at == "root_chord":
        middle -= root_chord_abscissa(gear)
    return middle


def _gap_opening(case: Case, at: str) -> float:
    """Largest gap that the fault opens between its flank and the mate on the path of contact."""
    table, fault = case.table, case.faults[0]
    side = ("pinion", "wheel").index(fault.gear)
    gap = np.squeeze(table.parts[side].gap, axis=(1 - side, 2))
    opening = gap[case.faulty_kinds[f"{fault.gear}_kind"]] - gap[0]
    on_path = (table.position >= 0.0) & (table.position <= case.pair.path_of_contact)
    return float(opening[on_path].max())


def _share_without_stiffness(case: Case, at: str) -> float:
    """Part of a mesh cycle, in one turn of the pinion, in which no pair carries."""
    n_points = 1000
    turn = np.arange(case.pair.pinion.n_teeth * n_points) + 0.5
    stiffness = mesh_stiffness(case, case.pair.base_pitch * turn / n_points)
    return float(np.count_nonzero(stiffness == 0.0)) / n_points


def _remaining_pair_deviation(case: Case, at: str) -> float:
    """Largest departure from the remaining pair's own stiffness where the missing tooth was one
    of two.
    """
    pitch, zone = case.pair.base_pitch, case.pair.path_of_contact - case.pair.base_pitch
    inside = np.linspace(0.001, 0.999, 500) * zone
    # tooth 0 enters at roll 0 while its forerunner leaves, and leaves while its follower enters
    result = mesh_stiffness(case, np.concatenate([inside, pitch + inside]))
    alone = 1.0 / pair_compliance(case.table, np.concatenate([pitch + inside, inside]))
    return float(np.abs(result / alone - 1.0).max())


FAULT: dict[str, Check] = {
    "fault_increment": _fault_increment,
    "increment_over_papers": _increment_over_papers,
    "stiffness_loss": stiffness_loss,
    "contact_loss": _contact_loss,
    "pit_over_crack_loss": _pit_over_crack,
    "smallest_loss_step": _smallest_step,
    "crack_tip_half_thickness": _crack_tip_half_thickness,
    "pit_end_curvature": _pit_end,
    "pit_path": lambda case, at: _pit_end(case, "upper") - _pit_end(case, "lower"),
    "pit_abscissa": _pit_abscissa,
    "gap_opening": _gap_opening,
    "share_without_stiffness": _share_without_stiffness,
    "remaining_pair_deviation": _remaining_pair_deviation,
}
