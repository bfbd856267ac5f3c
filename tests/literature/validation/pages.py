"""The pages of ``docs/validation``: one a paper, what each claims, and the lines it shows."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """One paper.

    Parameters
    ----------
    title : of the page
    answer : what came of it, for the index
    claims : what the paper claims
    sources : CSV files of its rows
    headlines : ids of lines without their last part, in the order of the table
    picture, caption : in ``docs/figures/papers``, by ``gensig figures``; empty for none
    """

    title: str
    answer: str
    claims: str
    sources: tuple[str, ...]
    headlines: tuple[str, ...]
    picture: str = ""
    caption: str = ""


PAGES = {
    "spur": Page(
        title="Spur gears with several faults",
        answer="stiffness and records of the paper's equations come out; by them a pit weighs "
        "more than the crack, and no impact of the crack is seen in the signal.",
        claims="The paper computes mesh stiffness by potential energy with the root transition "
        "curve, and from it the response of a gear pair to a crack, a pit and a missing tooth. "
        "It claims impacts in every turn, sidebands, and that a pit shows less than a crack. It "
        "prints few numbers. An independent solution of its equations stands beside ours.",
        sources=("spur_reference", "spur_paper"),
        headlines=(
            "record_healthy_lin",
            "record_missing_lin",
            "crack.impact_in_the_signal",
            "pit.weaker_than_crack",
            "missing.drowns_mesh_lines",
            "root_curve.more_accurate_pair",
        ),
        picture="spur_14.png",
        caption="Response to a missing tooth by the paper's equations and by default",
    ),
    "helical_error": Page(
        title="Transmission error and flank modification of helical gears",
        answer="loads and geometry come out; the printed ripple is ten to twenty times what such "
        "a mesh has; modified flanks are quieter, as the paper measured.",
        claims="The paper computes transmission error and line load of the pair 61/132 by slices, "
        "chooses flanks for the least ripple, an even load, or both, and measures less noise "
        "with them: 0 to 4 dB, best with both from 1500 to 3500 r/min.",
        sources=("helical_reference", "helical_error_paper"),
        headlines=(
            "printed_geometry.stiffness",
            "printed_error.peak_to_peak",
            "printed_error.line_load",
            "printed_schemes.peak_to_peak",
            "run_up_lower.misaligned",
            "run_up_best.misaligned",
        ),
        picture="helical_error_10.png",
        caption="Vibration before and after modification over the speed",
    ),
    "helical_heat": Page(
        title="Stiffness of helical gears with temperature",
        answer="cold stiffness comes out; the rise of 11 % with heat does not, by gensig's law or "
        "by the paper's own equations, in any reading.",
        claims="The paper adds thermal growth to the profile of the pair 40/162 and finds mesh "
        "stiffness 11 % higher hot than cold, and rising with friction, torque and speed.",
        sources=("helical_heat_paper",),
        headlines=(
            "cold.mesh_mean",
            "hot.mesh_mean",
            "hot_change.mesh_mean",
            "hot_change.ours",
            "sweeps.torque",
        ),
        picture="helical_heat_8.png",
        caption="Mean hot stiffness over the torque",
    ),
    "engine": Page(
        title="The timing gears of a marine diesel",
        answer="natural frequencies, the pump gear's fluctuation and waterfalls come out; the root "
        "stress in time is up to twice the printed one.",
        claims="The paper models 67 inertias of a 20-cylinder diesel and its timing gears in "
        "bending and torsion, measures torsion at the flywheel and at the pump, finds the root "
        "stress of the pump gear that broke, and lowers it by dampers. It prints no sizes, "
        "pressures, firing order, backlash or supports.",
        sources=(
            "engine_root_stress",
            "engine_reference",
            "engine_paper",
            "engine_response",
            "engine_dampers",
            "engine_time",
        ),
        headlines=(
            "computed_modes.half_ring",
            "waterfall.flywheel",
            "fluctuation_in_time.computed_flywheel",
            "fluctuation_in_time.computed_pump_gear",
            "pump_drive.safety_paper",
            "root_stress_in_time.before",
        ),
        picture="engine_11.png",
        caption="Speed of the pump gear over two cycles, for two firing orders",
    ),
    "wear": Page(
        title="Wear life",
        answer="sliding, pressure and the form of the laws come out; the two printed fits of the "
        "life disagree with each other.",
        claims="The paper follows Archard's wear along the flanks of 38/55 and fits the life to a "
        "threshold of wear over torque, eq. (25), and over speed, eq. (26).",
        sources=("wear_reference", "wear_paper"),
        headlines=(
            "wear_pressure.papers_radius",
            "wear_depth_paper.even_split",
            "wear_life_paper.eq_25",
            "wear_life_paper.eq_26",
            "wear_life_paper.fits_agree",
            "wear_fits_paper.level_over_slope",
        ),
        picture="wear_8.png",
        caption="Wear life over the torque",
    ),
}
