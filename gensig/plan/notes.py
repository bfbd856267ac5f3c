"""Notes on a plan: machines without records, many records of few, splits that are not possible."""

from __future__ import annotations

from gensig.dataset.plan import Plan
from gensig.dataset.splitting.protocols import why_left_out
from gensig.record.inputs import InputReader

BY_MACHINE = {
    "by_unit": "machine",
    "cross_specimen": "set of gears",
    "cross_gearbox": "gearbox",
}
# Records of a machine above which more machines are worth more than more records: twice those of
# the experiments with most. `experiment=quickstart` has 4 (docs/howto/unknown_machine.md).
MOST_OF_A_MACHINE, ADVISED_OF_A_MACHINE = 40, 4


def plan_notes(reader: InputReader, plan: Plan) -> list[str]:
    """At most one line: machines without records or with many, and splits that are not possible."""
    examples = plan.examples()
    parts = (
        _units_left_out(reader, examples),
        _few_machines(reader, examples),
        _splits_left_out(examples, reader.seed),
    )
    note = "; ".join(filter(None, parts))
    return [note] * bool(note)


def _units_left_out(reader: InputReader, plan: Plan) -> str:
    options = reader.plan
    asked, used = options.n_units, n_different(plan, "unit_id")
    if used >= asked or reader.runs_to_failure:
        return ""
    conditions = _count(n_different(plan, "condition_id"), "condition")
    classes = _count(len(options.classes), "class", "es")
    repeats = _count(options.n_repeats, "repeat")
    records = _count(plan.n_records, "record")
    counts = f"{records} are {conditions} of {classes} and {repeats}"
    return f"{counts}: {used} of {asked} machines are used"


def _few_machines(reader: InputReader, plan: Plan) -> str:
    """Note on many records of few machines, where the number of machines is free."""
    options, machines = reader.plan, n_different(plan, "unit_id")
    given = options.conditions_per_unit is not None or options.is_grid
    each = plan.n_records / machines
    if given or each <= MOST_OF_A_MACHINE or reader.runs_to_failure:
        return ""
    counts = f"{_count(plan.n_records, 'record')} of {_count(machines, 'machine')}"
    more = plan.n_records // ADVISED_OF_A_MACHINE
    return (
        f"{counts}: {each:.0f} each; a model for machines never seen gains more from more "
        f"machines: plan.n_units={more} has {ADVISED_OF_A_MACHINE} each"
    )


def _splits_left_out(plan: Plan, seed: int) -> str:
    """Reasons why splits by machine are not possible; only that of machines if there is one."""
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
