"""Every printed figure against our own code: what each row's quantity is, and the verdicts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from gensig.errors import ConfigError
from validation.case import read_case
from validation.checks.body_checks import BODY
from validation.checks.dynamics_checks import DYNAMICS
from validation.checks.engine_damper_checks import DAMPERS, read_damper_case
from validation.checks.engine_response_checks import FORCED, read_forced_case
from validation.checks.engine_time_checks import TIMES, read_time_case
from validation.checks.fault_checks import FAULT
from validation.checks.geometry_checks import GEOMETRY
from validation.checks.heat_checks import HOT, read_hot_case
from validation.checks.helical_checks import SLICED, read_sliced_case
from validation.checks.line_checks import LINES, read_line_case
from validation.checks.mesh_checks import MESH
from validation.checks.run_up_checks import RUN_UP, read_run_up_case
from validation.checks.standard_checks import STANDARD
from validation.checks.strength_checks import STRENGTH, read_strength_case
from validation.checks.wear_checks import WEAR, read_wear_point
from validation.rows import SOURCES, Result, Row, judge, read_rows

# quantities by the kind of case that they are of, and what reads it
KINDS: tuple[tuple[dict[str, Any], Callable[[tuple[str, ...]], Any]], ...] = (
    ({**GEOMETRY, **BODY, **MESH, **FAULT, **STANDARD, **DYNAMICS}, read_case),
    (SLICED, read_sliced_case),
    (STRENGTH, read_strength_case),
    (RUN_UP, read_run_up_case),
    (HOT, read_hot_case),
    (LINES, read_line_case),
    (FORCED, read_forced_case),
    (DAMPERS, read_damper_case),
    (TIMES, read_time_case),
    (WEAR, read_wear_point),
)


def evaluate(row: Row) -> Result:
    """Compute one row's quantity under its own configuration and judge it.

    Raises
    ------
    ConfigError    for a quantity there is not, or overrides that make no machine
    """
    for quantities, read in KINDS:
        if row.quantity in quantities:
            return judge(row, quantities[row.quantity](read(row.overrides), row.at))
    raise ConfigError(
        f"{row.origin}.csv, {row.id}: no quantity '{row.quantity}'; see validation.verdicts"
    )


def run_validation(
    sources: Sequence[str] | None = None,
    *,
    on_row: Callable[[Result], None] | None = None,
) -> list[Result]:
    """Judge all rows of the given sources (all when None), in the order of their files.

    Parameters
    ----------
    on_row : called after each row, for progress
    """
    results = []
    if sources is None:
        sources = SOURCES
    for source in sources:
        for row in read_rows(source):
            results.append(evaluate(row))
            if on_row is not None:
                on_row(results[-1])
    return results
