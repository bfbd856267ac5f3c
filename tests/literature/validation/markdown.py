"""``docs/validation.md``: every row with its verdict, the points of one line together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from validation.realism_section import realism_lines
from validation.rows import DIFFERS, FAILS, ROUGH, VERDICTS, Result

SOURCE_TITLES = {
    "spur_reference": "Reference numbers for the spur pair",
    "spur_paper": "What the spur paper prints and claims",
    "helical_reference": "Reference numbers for both helical pairs",
    "helical_error_paper": "What the paper on transmission error and flank modification prints",
    "helical_heat_paper": "What the paper on helical stiffness with temperature prints",
    "engine_root_stress": "Root stress and safety factor of the diesel's injection pump drive",
    "engine_reference": "Reference numbers for the diesel's shaft line",
    "engine_paper": "What the paper on the diesel's timing gears prints",
    "wear_reference": "Reference numbers for the wear life",
    "wear_paper": "What the wear-life paper prints and claims",
    "engine_response": "What the same paper prints of the running engine",
    "engine_dampers": "Tooth load, dampers, spectra and waterfalls of the same engine",
    "engine_time": "The same engine in time, teeth free to part",
}
SOURCE_TEXTS = {
    "spur_reference": (
        "Computed independently of this project (rack geometry, potential-energy method, 2-D "
        "finite elements, Runge-Kutta records); the sections and tables are those of that "
        "reference. Bores 9 and 15 mm unless a line says otherwise. Under *gensig's default* "
        "(`ours_` in the CSV) stands what gensig takes unless told otherwise (short teeth, "
        "elastic ring, Weber's contact, shared bodies, calibrated crack, plane strain) "
        "against finite elements; where those are in plane stress, or have the Hertz term, so "
        "has ours. All other lines have the conventions of the paper: against finite elements "
        "(`fe_`), which they cannot meet exactly, their tolerance is the band that the "
        "reference accepts. Records were simulated there with other damping and a prescribed "
        "phase, so 10 % is accepted."
    ),
    "spur_paper": (
        "Yan, Zhang, Feng & Li (2023), gears 23/84 at 1800 r/min. The paper prints few "
        "numbers: its claims are put as a number and a criterion each, under the paper's own "
        "mesh law (`paper_law`) and under the one-sided law with all that gensig takes by "
        "default (`one_sided`). Records are 15 turns of the pinion, perfect teeth, no noise, "
        "20 N m (assumed), acceleration of the pinion's bearing along the line of action. "
        "Lines without a criterion show numbers that belong to the claims."
    ),
    "helical_reference": (
        "Computed independently of this project by transverse slices with the "
        "potential-energy method, Sainsot's body, linear Hertz, bores of half the pitch "
        "radius, plain sum of pairs, contact on the path only. That model takes the involute "
        "down to the root circle, and so do these lines, by a rack with a nearly sharp tip "
        "(cutter_tip_radius_coefficient=0.02); beside them stand a rounded rack and what "
        "gensig takes by default (`rounded`, `ours`): a root that a rounded rack cuts makes "
        "teeth stiffer, and contact at the tips' corners carries load beyond the path."
    ),
    "helical_error_paper": (
        "Liu, Lai, Yue, Xu & Li (2016), gears 61/132, 178 N m. Lines `in_phase` leave out the "
        "helix of the contact lines, `misaligned` have 5.2 um over the face. No line was "
        "tuned; the addendum is the one with which the printed contact ratio comes out. For "
        "the run-up's noise stands the vibration of the bearings at mesh orders 1 to 3, with "
        "gensig's own mesh."
    ),
    "helical_heat_paper": (
        "Gears 40/162, 24.351 kN m; bores of half the pitch radius, an even split of the "
        "profile shift and the rack's rounding are assumed, the paper prints none of them. "
        "Hot gears are those of heat=chongqing_rated, whose inputs are assumed as well; "
        "`true`, `contact_ratio`, `apparent` and `softened` are the effects of heat one by "
        "one (docs/theory/heat.md), `ours` gensig's own mesh."
    ),
    "engine_root_stress": (
        "Sun, Shi, Chen, Li & Liu, spur gears 54/54 of module 3, and numbers computed from it "
        "independently of this project (`reference`, `variants`). The paper prints root "
        "stresses and safety factors, but neither a force nor any form factor: the force that "
        "gives its stress is what can be compared. All load factors are 1; rack ISO 53-A is "
        "assumed."
    ),
    "engine_reference": (
        "Computed independently of this project from the same tables. `true_ratios` is the "
        "line as printed with the gears' ratios, `ratios_ignored` takes every mesh for a "
        "shaft of its printed torsional stiffness, `crank_only` leaves the gear train out, "
        "`half_ring` counts half of the damper's outer part, as for a viscous damper."
    ),
    "engine_paper": (
        "Sun, Shi, Chen, Li & Liu (2024), 67 inertias and 66 stiffnesses as printed in table "
        "A1, gears as in table B1. Variants as above. No inertia or stiffness is fitted: many "
        "pairs of changed numbers meet all four frequencies within 0.01 %, so that a close "
        "fit would be no evidence."
    ),
    "wear_reference": (
        "Computed independently of this project from table 1 of the wear-life paper, whose "
        "equations (1) to (10) are lost: sliding, pressure, and wear of a mesh by the contact "
        "band (Flodin) and by the paper's fixed intervals. A is where the wheel's tip meets "
        "the pinion's root, C the pitch point, E the pinion's tip. One pair, new flanks; "
        "`spur`, `full_addendum` and `helical` are what gensig takes by default, with flanks "
        "that wear and share the load by the loaded mesh."
    ),
    "wear_paper": (
        "Pan, Zhao, Li & Wang (2012), gears 38/55, 200 N m, 4 pi rad/s, in the paper's "
        "setting: one pair, new flanks, force over the reference radius. The threshold S and "
        "the number of intervals N_i are not printed; hours are taken for the lives, whose "
        "unit the paper leaves out."
    ),
    "engine_response": (
        "1688 r/min, 12.68 kN m, linear: meshes never part. The paper prints no size, "
        "pressure, cam, pump or firing order; all are assumed (`excitation=engine_v20`, "
        "docs/theory/engine_excitation.md), none is tuned. Two firing orders: `least_couples` "
        "of the crank, the default, and `in_sequence`."
    ),
    "engine_dampers": (
        "The same, with ISO's root stress of the pump gear under the greatest tooth force of "
        "a cycle, and dampers on both gears of the pump drive, whose sizes the paper does not "
        "print (docs/theory/dampers.md). Waterfalls are steady at every speed, by 10 r/min."
    ),
    "engine_time": (
        "1688 r/min and 12.68 kN m again, integrated for 2 s with backlash, spur meshes by "
        "tables of their teeth (docs/theory/shaft_line_in_time.md). Numbers are medians over "
        "28 cycles of the crank. The drive rattles and is chaotic: they scatter by some per "
        "cent with the last bit, so they are given to two digits (`~`), and 15 % is accepted."
    ),
}
TITLES = {
    "geometry": "Teeth and root transition curve",
    "action": "Line of action",
    "contact": "Contact",
    "table_2_1": "Gear body: coefficients of Sainsot's fit",
    "table_2_2": "Compliances of sound teeth, line by line",
    "other_root_angle": "Body under other readings of theta_f",
    "table_2_3": "Stiffness over a mesh cycle, sound and faulty",
    "faults_of_the_paper": "The paper's crack and pit in numbers",
    "body_sharing": "Bodies counted twice, once, or shared",
    "pem_structure": "Tooth and body together",
    "fe_structure": "Tooth and body against finite elements",
    "ours_structure_strain": (
        "Tooth and body against finite elements, gensig's default, plane strain"
    ),
    "ours_structure_stress": (
        "Tooth and body against finite elements, gensig's default, plane stress"
    ),
    "fe_tooth": "Tooth alone against finite elements",
    "fe_body": "Body alone against finite elements",
    "ours_tooth": "Tooth alone against finite elements, gensig's default, plane stress",
    "ours_body": "Body alone against finite elements, gensig's default, plane stress",
    "fe_pair_strain": "Whole pair against finite elements, plane strain",
    "fe_pair_stress": "Whole pair against finite elements, plane stress",
    "ours_local": "Local compliance against finite elements, gensig's default",
    "ours_pair_strain": "Whole pair against finite elements, gensig's default",
    "fe_cross_compliance": "Body compliance that two pairs share",
    "pem_sum": "Double zone, plain sum",
    "fe_coupled": "Double zone with the shared body",
    "ours_cross": "Body compliance that two pairs share, gensig's default",
    "ours_pair_structure": (
        "Double zone, teeth and bodies against finite elements, gensig's default, plane "
        "stress"
    ),
    "ours_double_zone": "Double zone against finite elements, gensig's default",
    "ours_load_share": "Load share of the entering pair, gensig's default",
    "ours_best_estimate": "The reference's best estimate of the mesh, gensig's default",
    "bores": "Dependence on the bores",
    "ours_bores": (
        "Dependence on the bores against finite elements, gensig's default, plane stress with "
        "the Hertz term"
    ),
    "ours_body_bores": (
        "Body over the bores against finite elements, gensig's default, plane stress"
    ),
    "sainsot_bores": "Body over the bores, Sainsot's over that of finite elements",
    "crack_increment": "Crack: what eqs. (11) and (12) add to its tooth",
    "ours_crack": "Crack against finite elements, gensig's default",
    "ours_crack_over_papers": "Crack over eqs. (11) and (12), gensig's default",
    "ours_crack_loss": "Loss of pair stiffness by a crack, gensig's default",
    "ours_pit": "Pit on slices of the flank, gensig's default",
    "iso6336": "ISO 6336-1, Method B",
    "iso6336_beside": "Our stiffness beside ISO 6336-1 and the literature",
    "modes": "Natural frequencies",
    "corner_gap": "Contact beyond the ends of the path",
    "record_healthy_lin": "Record, healthy, paper's law",
    "record_crackPEM_lin": "Record, 1 mm crack, paper's law",
    "record_pit_lin": "Record, pit, paper's law",
    "record_missing_lin": "Record, missing tooth, paper's law",
    "record_healthy_gap": "Record, healthy, one-sided law",
    "record_pit_gap": "Record, pit, one-sided law",
    "record_missing_gap": "Record, missing tooth, one-sided law",
    "rig": "Rig",
    "crack": "Crack",
    "pit": "Pit",
    "missing": "Missing tooth",
    "severity": "Severity series",
    "root_curve": "What the root transition curve buys",
    "roll_torque": "Torque that keeps the energy balance",
    "helical_geometry": "Geometry",
    "slices": "Loaded slices",
    "schemes_aligned": "The three modifications, aligned",
    "schemes_misaligned": "The three modifications, 5.2 um misaligned",
    "printed_geometry": "Geometry and load",
    "printed_error": "Transmission error and line load",
    "printed_schemes": "Tables 3 to 5",
    "run_up_lower": "Run-up to 5000 r/min: modified flanks are quieter on average",
    "run_up_at_most_4": "... by at most 4 dB",
    "run_up_good": "... everywhere between 2700 and 3200 r/min",
    "run_up_best": "... and the combined scheme most between 1500 and 3500 r/min",
    "cold": "Cold stiffness",
    "pump_drive": "What the paper prints",
    "reference": "Form and stress correction factors, forces",
    "variants": "The same stress under other racks",
    "mesh": "Through the mesh",
    "bulk_field": "Bulk temperature above the oil",
    "hot": "Hot stiffness",
    "hot_change": "Hot over cold, effect by effect",
    "finite_elements": "Beside the paper's finite elements",
    "sweeps": "Sweeps of friction, torque and speed",
    "sweeps_rise": "Does stiffness rise with friction, torque and speed?",
    "torque_matters_most": "Does torque matter most?",
    "heat_flow": "Friction heat, and how warm the cooled surfaces get",
    "flash": "Flash temperature",
    "hotter_than_housing": "Gears hotter than their housing",
    "line_modes": "Natural frequencies of the whole line",
    "computed_modes": "Natural frequencies, as the paper computed them",
    "measured_modes": "Natural frequencies, as the paper measured them",
    "wear_geometry": "Geometry",
    "wear_sliding": "Sliding",
    "wear_pressure": "Contact pressure",
    "wear_per_mesh": "Wear of a mesh",
    "wear_rate": "Wear of an hour",
    "wear_exponent": "Exponents of the torque",
    "wear_step": "Convergence",
    "wear_life": "Lives that the paper's fits allow",
    "wear_fits": "Local exponents of the printed fits",
    "wear_drive": "Contact ratio",
    "wear_sliding_paper": "Sliding",
    "wear_pressure_paper": "Contact pressure",
    "wear_depth_paper": "Wear depth",
    "wear_step_paper": "The step of the paper's rule",
    "wear_radius_paper": "Curvature radius after wear",
    "wear_life_paper": "Lives as printed",
    "wear_fits_paper": "The printed fits as fits of our law",
    "fluctuation_computed": "Speed fluctuation, as the paper computed it",
    "fluctuation_measured": "Speed fluctuation, as the paper measured it",
    "engine_alone": "Speed fluctuation by the cylinders alone",
    "ratios": "Pump end against flywheel",
    "spectrum": "Orders of the largest lines",
    "root_stress": "Root stress under the dynamic tooth load, ISO's load point",
    "root_stress_over_mesh": "The same over the mesh, largest of all teeth",
    "stress_drop": "Root stress less by dampers",
    "safety_paper": "Safety under the dynamic tooth load, the paper's convention",
    "safety_iso": "Safety under the dynamic tooth load, ISO 6336-3",
    "half_orders": "Largest half order over the largest whole order",
    "disturbance_5_hz": "Disturbance of the dynamometer over order 1",
    "waterfall": (
        "Frequency at which an order is largest over the run: 1, 5 and 10 for modes 1, 2 and "
        "3"
    ),
    "tooth_force": "Forces of the pump drive's teeth",
    "cycle": "The assumed cycle",
    "fluctuation_in_time": "Speed fluctuation in a cycle",
    "ratios_in_time": "Pump end against flywheel in time",
    "half_orders_in_time": "Largest half order over the largest whole order, in time",
    "spectrum_in_time": "Orders of the largest lines, in time",
    "tooth_force_in_time": "Forces of the pump drive's teeth in a cycle",
    "root_stress_in_time": (
        "Root stress under the greatest tooth force of a cycle, ISO's load point"
    ),
    "root_stress_in_time_over_mesh": "The same over the mesh, largest of a cycle",
    "stress_ratio_in_time": "Root stress with dampers over that without, in time",
    "safety_in_time": "Safety under the greatest tooth force of a cycle",
}
INTRO = (
    "# Validation\n"
    "\n"
    "Every printed figure and claim of the sources against what gensig computes, by "
    "the same rows that `tests/literature`\n"
    "checks. Generated by `gensig validate --markdown docs/validation.md`; do not "
    "edit. The rows, with the configuration\n"
    "each belongs to, are `tests/literature/validation/*.csv`.\n"
    "\n"
    "*Reproduced*: within the row's tolerance, or within half a unit of the last "
    "printed digit. *Differs*: not so, with the\n"
    "reason. A claim *holds* when its number meets the criterion in the column "
    '"printed". *Not printed*: a number shown\n'
    'beside those that are. No input was tuned to reach a printed number. "Deviation" '
    "is the largest of a line's points.\n"
)


def markdown(results: Sequence[Result]) -> str:
    """The whole page."""
    short = [result for result in results if result.verdict in (DIFFERS, FAILS)]
    parts = [
        INTRO,
        "## Verdicts\n",
        summary(results),
        "\n## What differs, and what does not hold\n",
        _table(short),
    ]
    for source in _sources(results):
        mine = [result for result in results if result.row.origin == source]
        parts += [
            f"\n## {SOURCE_TITLES.get(source, source)}\n",
            SOURCE_TEXTS.get(source, ""),
        ]
        for head in dict.fromkeys(_head(result) for result in mine):
            parts.append(f"\n### {TITLES.get(head, head)}\n")
            parts.append(
                _table([result for result in mine if _head(result) == head], head=head)
            )
    return "\n".join([*parts, *realism_lines()]) + "\n"


def summary(results: Sequence[Result]) -> str:
    """Counts by verdict and source, a Markdown table."""
    lines = [
        "| source | rows | " + " | ".join(VERDICTS) + " |",
        "|---" * (len(VERDICTS) + 2) + "|",
    ]
    for source in _sources(results):
        found = Counter(
            result.verdict for result in results if result.row.origin == source
        )
        lines.append(
            f"| {source} | {found.total()} | "
            + " | ".join(str(found[name]) for name in VERDICTS)
            + " |"
        )
    return "\n".join(lines)


def shortfalls(results: Sequence[Result]) -> list[str]:
    """One line for each value that differs and each claim that does not hold, the unexpected ones
    marked.
    """
    lines = []
    for result in results:
        if result.as_expected and result.verdict not in (DIFFERS, FAILS):
            continue
        row = result.row
        mark = "UNEXPECTED " * (not result.as_expected)
        computed = f"{_computed(result)} {row.unit}".rstrip()
        lines.append(
            f"{mark}{row.id}: printed {row.printed}, computed {computed} ({result.verdict})"
        )
    return lines


def number(value: float) -> str:
    """Five significant digits, rounding noise as 0."""
    if abs(value) < 1e-9:
        return "0"
    return f"{value:.5g}"


def _computed(result: Result) -> str:
    """The number as the page has it; of a chaotic run two digits with a ~ before them."""
    if result.row.origin in ROUGH:
        return f"~{float(f'{result.computed:.2g}'):g}"
    return number(result.computed)


def _sources(results: Sequence[Result]) -> list[str]:
    return list(dict.fromkeys(result.row.origin for result in results))


def _head(result: Result) -> str:
    return result.row.id.partition(".")[0]


def _table(results: Sequence[Result], *, head: str = "") -> str:
    """One line for each group of rows whose id differs in its last part only and that have the
    same verdict.
    """
    groups: dict[tuple[str, ...], list[Result]] = {}
    for result in results:
        row = result.row
        groups.setdefault(
            (row.id.rpartition(".")[0], row.unit, result.verdict, row.reason), []
        ).append(result)
    lines = [
        "| id | at | printed | computed | unit | deviation | verdict | source | reason |",
        "|---" * 9 + "|",
    ]
    for (line, unit, verdict, reason), members in groups.items():
        rows = [result.row for result in members]
        printed = [row.printed for row in rows]
        if rows[0].kind == "claim":
            printed = list(dict.fromkeys(printed))
        cells = [
            line.removeprefix(f"{head}."),
            " ".join(row.id.rpartition(".")[2] for row in rows),
            " ".join(printed),
            " ".join(_computed(result) for result in members),
            unit,
            _largest(
                [
                    result.deviation
                    for result in members
                    if result.deviation is not None
                ],
                rough=rows[0].origin in ROUGH,
            ),
            verdict,
            "; ".join(dict.fromkeys(row.source for row in rows)),
            reason,
        ]
        lines.append("| " + " | ".join(cell.strip() for cell in cells) + " |")
    return "\n".join(lines)


def _largest(deviations: Sequence[float], *, rough: bool) -> str:
    """The largest deviation in per cent, 0.00 without a sign."""
    if not deviations:
        return ""
    if rough:
        return f"~{100.0 * max(deviations, key=abs):+.0f} %"
    text = f"{100.0 * max(deviations, key=abs):+.2f}"
    if float(text) == 0.0:
        text = text[1:]
    return f"{text} %"
