"""Notes on a plan: units without records, and splits by machine that are not possible."""

from __future__ import annotations

from gensig.dataset.plan import Plan
from gensig.dataset.splitting.protocols import why_left_out
from gensig.life.life_options import runs_to_failure
from gensig.options.configuration import Configuration

BY_MACHINE = {
    "by_unit": "unit",
    "cross_specimen": "set of gears",
    "cross_gearbox": "gearbox",
}


def plan_notes(config: Configuration, plan: Plan) -> list[str]:
    """At most one line: units without records, and splits by machine that are not possible."""
    examples = plan.examples()
    parts = (_units_left_out(config, examples), _splits_left_out(examples, config.seed))
    note = "; ".join(filter(None, parts))
    return [note] * bool(note)


def _units_left_out(config: Configuration, plan: Plan) -> str:
    asked, used = config["plan"]["n_units"], n_different(plan, "unit_id")
    if used >= asked or runs_to_failure(config):
        return ""
    conditions = _count(n_different(plan, "condition_id"), "condition")
    classes = _count(len(config["plan"]["classes"]), "class", "es")
    repeats = _count(config["plan"]["n_repeats"], "repeat")
    records = _count(plan.n_records, "record")
    counts = f"{records} are {conditions} of {classes} and {repeats}"
    return f"{counts}: {used} of {asked} units are used"


def _splits_left_out(plan: Plan, seed: int) -> str:
    """Reasons why splits by machine are not possible; only that of units if there is one."""
    reasons = why_left_out(plan, seed, tuple(BY_MACHINE))
    if "by_unit" in reasons:
        reasons = {"by_unit": reasons["by_unit"]}
    return "; ".join(
        f"no split by {BY_MACHINE[name]} is possible ({reason})"
        for name, reason in reasons.items()
    )


def n_different(plan: Plan, column: str) -> int:
    """Number of different values in a column."""
    return len(set(plan.columns[column].tolist()))


def _count(n: int, noun: str, ending: str = "s") -> str:
    return f"{n:,} {noun}{ending * (n != 1)}"
