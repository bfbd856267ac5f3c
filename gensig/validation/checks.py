"""Every printed figure against our own code: what each row's quantity is, and the verdicts."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from gensig.errors import ConfigError
from gensig.validation.body_checks import BODY
from gensig.validation.case import read_case
from gensig.validation.dynamics_checks import DYNAMICS
from gensig.validation.fault_checks import FAULT
from gensig.validation.geometry_checks import GEOMETRY, Check
from gensig.validation.helical_checks import SLICED, read_sliced_case
from gensig.validation.mesh_checks import MESH
from gensig.validation.rows import SOURCES, Result, Row, judge, read_rows
from gensig.validation.standard_checks import STANDARD
from gensig.validation.wear_checks import WEAR, read_wear_point

QUANTITIES: dict[str, Check] = {**GEOMETRY, **BODY, **MESH, **FAULT, **STANDARD, **DYNAMICS}


def evaluate(row: Row) -> Result:
    """Compute one row's quantity under its own configuration and judge it.

    Raises
    ------
    ConfigError    for a quantity there is not, or overrides that make no machine
    """
    if row.quantity in SLICED:
        return judge(row, SLICED[row.quantity](read_sliced_case(row.overrides), row.at))
    if row.quantity in WEAR:
        return judge(row, WEAR[row.quantity](read_wear_point(row.overrides), row.at))
    if row.quantity not in QUANTITIES:
        raise ConfigError(f"{row.origin}.csv, {row.id}: no quantity '{row.quantity}'; see gensig.validation.checks")
    return judge(row, QUANTITIES[row.quantity](read_case(row.overrides), row.at))


def run_validation(
    sources: Sequence[str] | None = None, *, on_row: Callable[[Result], None] | None = None
) -> list[Result]:
    """Judge all rows of the given sources (all when None), in the order of their files.

    Parameters
    ----------
    on_row : called after each row, for progress
    """
    results = []
    for source in SOURCES if sources is None else sources:
        for row in read_rows(source):
            results.append(evaluate(row))
            if on_row is not None:
                on_row(results[-1])
    return results
