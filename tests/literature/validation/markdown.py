"""``docs/validation.md``, a page for each paper, and every row with its verdict as CSV."""

from __future__ import annotations

import io
import textwrap
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from gensig.text.csv_tables import write_rows
from validation.pages import PAGES, Page
from validation.realism_section import realism_lines
from validation.rows import DIFFERS, FAILS, ROUGH, VERDICTS, Result

DOCS = Path(__file__).resolve().parents[3] / "docs"
RESULTS_MARK = "<!-- generated from here on -->"
WIDTH = 100
COLUMNS = (
    "source",
    "id",
    "printed",
    "computed",
    "unit",
    "deviation",
    "verdict",
    "where",
    "reason",
)
SOURCE_TEXTS = {
    "spur_reference": (
        "Computed independently of this project: rack geometry, potential-energy method, 2-D "
        "finite elements, Runge-Kutta records. Bores are 9 and 15 mm unless a line says "
        "otherwise. Lines `ours_` have gensig's defaults, in plane stress or with the Hertz term "
        "where the finite elements have them. All other lines have the paper's conventions; "
        "against finite elements (`fe_`) their tolerance is the band that the reference accepts. "
        "Records of the reference have other damping and a prescribed phase, so 10 % is accepted."
    ),
    "spur_paper": (
        "Yan, Zhang, Feng & Li (2023), gears 23/84 at 1800 r/min. Each claim is a number and a "
        "criterion, under the paper's mesh law (`paper_law`) and by default (`one_sided`). Records "
        "are 15 turns of the pinion, perfect teeth, no noise, 20 N m (assumed), acceleration of "
        "the pinion's bearing along the line of action."
    ),
    "helical_reference": (
        "Computed independently of this project: transverse slices, potential-energy method, "
        "Sainsot's body, linear Hertz, bores of half the pitch radius, plain sum of pairs, "
        "contact on the path only. The involute goes down to the root circle, so these lines have "
        "a rack with a nearly sharp tip (cutter_tip_radius_coefficient=0.02). `rounded` has a "
        "rounded rack, `ours` gensig's defaults."
    ),
    "helical_error_paper": (
        "Liu, Lai, Yue, Xu & Li (2016), gears 61/132, 178 N m. Lines `in_phase` leave out the "
        "helix of the contact lines, `misaligned` have 5.2 um over the face. The addendum is the "
        "one with which the printed contact ratio comes out. For the run-up's noise stands the "
        "vibration of the bearings at mesh orders 1 to 3, with gensig's own mesh."
    ),
    "helical_heat_paper": (
        "Gears 40/162, 24.351 kN m. Not printed and assumed: bores of half the pitch radius, an "
        "even split of the profile shift, the rack's rounding, all inputs of "
        "heat=chongqing_rated. `true`, `contact_ratio`, `apparent` and `softened` are the effects "
        "of heat one by one, `ours` is gensig's own mesh. Lines `paper` have the paper's equations "
        "(10) to (29), compared with the same equations without heat; `paper_components` adds "
        "components up by eq. (14); the others are readings of what is misprinted or open "
        "(docs/theory/heat.md). Two lines meet the printed hot mean by their level alone: their "
        "cold means are 12 % and 5 % above the printed one."
    ),
    "engine_root_stress": (
        "Sun, Shi, Chen, Li & Liu (2024), spur gears 54/54 of module 3, and numbers computed from "
        "it independently of this project (`reference`, `variants`). The paper prints neither a "
        "force nor a form factor, so the force that gives its stress is compared. All load factors "
        "are 1; rack ISO 53-A is assumed."
    ),
    "engine_reference": (
        "Computed independently of this project from the same tables. `true_ratios` is the "
        "printed line with the gears' ratios, `ratios_ignored` takes every mesh for a shaft of "
        "its printed torsional stiffness, `crank_only` leaves the gear train out, `half_ring` "
        "counts half of the damper's outer part, as for a viscous damper."
    ),
    "engine_paper": (
        "The same paper: 67 inertias and 66 stiffnesses of table A1, gears of table B1, variants "
        "as above. Nothing is fitted: many pairs of changed numbers meet all four frequencies "
        "within 0.01 %, so a close fit would be no evidence."
    ),
    "wear_reference": (
        "Computed independently of this project from table 1 of the wear-life paper, whose "
        "equations (1) to (10) are lost: sliding, pressure, and wear of a mesh by the contact "
        "band (Flodin) and by the paper's fixed intervals. A is where the wheel's tip meets "
        "the pinion's root, C the pitch point, E the pinion's tip. `spur`, `full_addendum` and "
        "`helical` are gensig's defaults, the other lines one pair with new flanks."
    ),
    "wear_paper": (
        "Pan, Zhao, Li & Wang (2012), gears 38/55, 200 N m, 4 pi rad/s: one pair, new flanks, "
        "force over the reference radius. The threshold S and the number of intervals N_i are not "
        "printed; hours are taken for the lives, whose unit the paper leaves out."
    ),
    "engine_response": (
        "1688 r/min, 12.68 kN m, linear: meshes never part. All that the paper does not print is "
        "assumed (docs/theory/engine.md). Two firing orders: `least_couples` of the crank, the "
        "default, and `in_sequence`."
    ),
    "engine_dampers": (
        "The same, with ISO's root stress of the pump gear under the greatest tooth force of a "
        "cycle, and dampers of assumed sizes on both gears of the pump drive. Waterfalls are "
        "steady at every speed, by 10 r/min."
    ),
    "engine_time": (
        "The same, integrated for 2 s with backlash, spur meshes by tables of their teeth. Numbers "
        "are medians over 28 cycles of the crank. The drive is chaotic: numbers scatter by some "
        "per cent with the last bit, so they have two digits (`~`), and 15 % is accepted."
    ),
}
INTRO = """\
# Validation

Every printed figure and claim of the sources against what gensig computes. `gensig validate
--markdown docs/validation.md` makes this page, the pages below and the CSV beside each, which has
every row; do not edit. `tests/literature` checks the same rows; the configuration of each is in
`tests/literature/validation/*.csv`.

*Reproduced*: within the row's tolerance, or within half a unit of the last printed digit.
*Differs*: not so, with the reason. A claim *holds* when its number meets the criterion in the
column "printed". *Not printed*: a number shown beside those that are. No input was tuned to reach a
printed number. `gensig figures` draws the papers' figures beside the printed numbers.
"""
PEER = (
    "Another program, ROSS 2.3.0 (`ross-rotordynamics`; `python -m benchmarks.ross --stored`): with"
    " its choices in gensig's functions every ratio of compliances and stiffnesses is 1.0000 (one "
    "is 1.0001). Without them the stiffness of one tooth pair 23/84 at C is 1.0784 of ROSS's by "
    "the paper's terms and 0.9998 by default, the mean mesh stiffness 1.0708 and 0.7792: by "
    "default the pairs share the gear bodies, which costs 29 % in double contact. ROSS has no "
    "clearance in theta_f and measures the load's height to the contact point: over finite "
    "elements at A, C, E the pinion's body compliance is 1.045, 1.172, 1.134 by ROSS and 1.009, "
    "0.987, 0.950 by the paper's terms."
)
PAGE_INTRO = """\
Generated; do not edit. How to read it: [validation](../validation.md). All rows:
[{name}.csv]({name}.csv).
"""
REASONS_ELSEWHERE = (
    "Of the lines above; the column `reason` of the CSV has those of all rows."
)


def markdown(results: Sequence[Result]) -> dict[str, str]:
    """The text of every page and every CSV, by its path in ``docs``."""
    texts = {"validation.md": _index(results), "howto/realism.md": _realism()}
    for name, page in PAGES.items():
        mine = [result for result in results if result.row.origin in page.sources]
        texts[f"validation/{name}.md"] = _page(name, page, mine)
        texts[f"validation/{name}.csv"] = _rows(mine)
    return texts


def _realism() -> str:
    """The page on realism: what is written by hand, and the results behind its mark."""
    written = (DOCS / "howto" / "realism.md").read_text(encoding="utf-8")
    by_hand, mark, _ = written.partition(RESULTS_MARK)
    return "\n".join([by_hand + mark, *realism_lines()]) + "\n"


def _index(results: Sequence[Result]) -> str:
    papers = [
        f"- [{page.title}](validation/{name}.md): {page.answer}"
        for name, page in PAGES.items()
    ]
    parts = [
        INTRO,
        "## The papers\n",
        _wrapped(papers),
        "\nMeasured gearboxes: [realism](howto/realism.md#results).\n",
        _wrapped([PEER]) + "\n",
        "## Verdicts\n",
        summary(results),
    ]
    return "\n".join(parts) + "\n"


def _page(name: str, page: Page, results: Sequence[Result]) -> str:
    parts = [f"# {page.title}\n", PAGE_INTRO.format(name=name), _wrapped([page.claims])]
    if page.picture:
        parts.append(f"\n![{page.caption}](../figures/papers/{page.picture})\n")
    parts += ["\n## Headline numbers\n", _table(_headlines(page, results))]
    reasons = _reasons(page, results)
    parts += [
        "\n## What differs, and why\n",
        _wrapped([REASONS_ELSEWHERE, "", *reasons]),
    ]
    parts += ["\n## How it was computed\n"]
    parts += [
        _wrapped([f"- **{name}**: {SOURCE_TEXTS[name]}" for name in page.sources])
    ]
    return "\n".join(parts) + "\n"


def _headlines(page: Page, results: Sequence[Result]) -> list[Result]:
    """Rows of the lines that a page shows, in its order."""
    found = [
        [result for result in results if _line(result) == line]
        for line in page.headlines
    ]
    empty = [line for line, rows in zip(page.headlines, found, strict=True) if not rows]
    if empty:
        raise ValueError(f"no rows of {', '.join(empty)}")
    return [result for rows in found for result in rows]


def _reasons(page: Page, results: Sequence[Result]) -> list[str]:
    """Reasons of the headlines, each once with the lines that it explains."""
    by_reason: dict[str, list[Result]] = {}
    for result in _headlines(page, results):
        if result.verdict in (DIFFERS, FAILS):
            by_reason.setdefault(result.row.reason, []).append(result)
    lines = []
    for reason, rows in by_reason.items():
        named = ", ".join(f"*{line}*" for line in dict.fromkeys(map(_line, rows)))
        lines.append(f"- {named}: {reason}")
    return lines


def _line(result: Result) -> str:
    return result.row.id.rpartition(".")[0]


def _wrapped(paragraphs: Sequence[str]) -> str:
    return "\n".join(
        textwrap.fill(
            text,
            WIDTH,
            subsequent_indent="  " if text.startswith("- ") else "",
            break_long_words=False,
            break_on_hyphens=False,
        )
        for text in paragraphs
    )


def _rows(results: Sequence[Result]) -> str:
    """All rows as CSV."""
    file = io.StringIO()
    write_rows(file, [COLUMNS])
    for result in results:
        row, deviations = result.row, []
        if result.deviation is not None:
            deviations.append(result.deviation)
        deviation = _largest(deviations, rough=row.origin in ROUGH)
        place = row.origin, row.id, row.printed, _computed(result), row.unit
        cells = [*place, deviation, result.verdict, row.source, row.reason]
        write_rows(file, [cells])
    return file.getvalue()


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


def _table(results: Sequence[Result]) -> str:
    """One line for each group of rows whose id differs in its last part only and that have the
    same verdict.
    """
    groups: dict[tuple[str, ...], list[Result]] = {}
    for result in results:
        key = _line(result), result.row.unit, result.verdict
        groups.setdefault(key, []).append(result)
    lines = [
        "| line | at | printed | computed | verdict |",
        "|---" * 5 + "|",
    ]
    for (line, unit, verdict), members in groups.items():
        rows = [result.row for result in members]
        printed = [row.printed for row in rows]
        if rows[0].kind == "claim":
            printed = list(dict.fromkeys(printed))
        deviations = [
            result.deviation for result in members if result.deviation is not None
        ]
        computed = " ".join(_computed(result) for result in members)
        deviation = _largest(deviations, rough=rows[0].origin in ROUGH)
        cells = [
            line,
            " ".join(row.id.rpartition(".")[2] for row in rows),
            " ".join(printed),
            f"{computed} {unit}",
            f"{verdict}, {deviation}" if deviation else verdict,
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
