"""Printed figures as data: one CSV per source, one row per figure or claim.

The columns: ``id``; ``quantity`` and ``at``, what is computed and where
(``validation.verdicts.KINDS``); ``overrides``, the configuration it belongs to;
``printed``, ``unit`` and ``tolerance``; ``kind``; ``expected``, a verdict other than the good one
that is known and explained; ``source`` (section, equation or table); ``reason``.

A value is reproduced when it deviates from the printed one by at most ``tolerance`` times the
printed one, or by half a unit of the last printed digit where that is more. A claim prints its
criterion, such as ``> 1.5``. A row that prints nothing shows a number beside those that are
printed.
"""

from __future__ import annotations

import csv
import operator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from gensig.errors import ConfigError

FOLDER = Path(__file__).resolve().parent
SOURCES = (
    "spur_reference",
    "spur_paper",
    "helical_reference",
    "helical_error_paper",
    "helical_heat_paper",
    "engine_root_stress",
    "engine_reference",
    "engine_paper",
    "engine_response",
    "engine_dampers",
    "engine_time",
    "wear_reference",
    "wear_paper",
)
ROUGH = (
    "engine_time",
)  # sources of chaotic runs, whose numbers scatter by some per cent from machine to machine
REPRODUCED, DIFFERS = "reproduced", "differs"
HOLDS, FAILS = "claim holds", "claim does not hold"
NOT_PRINTED = "not printed"
VERDICTS = (REPRODUCED, DIFFERS, HOLDS, FAILS, NOT_PRINTED)

# unit as printed: factor to SI
UNITS = {
    "": 1.0,
    "%": 1e-2,
    "mm": 1e-3,
    "um": 1e-6,
    "rad": 1.0,
    "deg": 0.017453292519943295,
    "1e8 N/m": 1e8,
    "1e-12 m/N": 1e-12,
    "N/mm": 1e3,
    "N": 1.0,
    "N m": 1.0,
    "h": 3600.0,
    "K": 1.0,
    "kW": 1e3,
    "dB": 1.0,
    "MPa": 1e6,
    "1e9 N/m": 1e9,
    "N/(mm um)": 1e9,  # per face width
    "mm um/N": 1e-9,
    "kg": 1.0,
    "kg m2": 1.0,
    "Hz": 1.0,
    "r/min": 0.10471975511965977,
    "m/s2": 1.0,
    "mm/s": 1e-3,
    "nm": 1e-9,
    "ms": 1e-3,
    "um/h": 1e-6,
    "1/Pa": 1.0,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One row of a source's CSV, see the module's description; ``origin`` is the CSV's name."""

    origin: str
    id: str
    quantity: str
    at: str
    overrides: tuple[str, ...]
    printed: str
    unit: str
    tolerance: float | None
    kind: str
    expected: str
    source: str
    reason: str

    def __post_init__(self) -> None:
        has_figure = self.kind == "value" and bool(self.printed)
        is_bad_claim = self.kind == "claim" and self.printed[:2] not in ("", "> ", "< ")
        for is_wrong, message in (
            (
                self.kind not in ("value", "claim"),
                f"kind = {self.kind!r}; allowed: value, claim",
            ),
            (
                self.unit not in UNITS,
                f"unit = {self.unit!r}; allowed: {', '.join(UNITS)}",
            ),
            (
                self.expected not in VERDICTS,
                f"expected = {self.expected!r}; allowed: {VERDICTS}",
            ),
            (
                (self.tolerance is not None) != has_figure,
                "a printed value, and nothing else, has a tolerance",
            ),
            (is_bad_claim, "a claim prints '> number' or '< number'"),
        ):
            if is_wrong:
                raise ConfigError(f"{self.origin}.csv, {self.id}: {message}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """Computed value and verdict of one row.

    ``computed`` is in the row's unit, ``deviation`` relative to the printed value.
    """

    row: Row
    computed: float
    deviation: float | None
    verdict: str

    @property
    def as_expected(self) -> bool:
        """True for the verdict that the row declares and explains, by default the good one."""
        return self.verdict == self.row.expected


@lru_cache(maxsize=8)
def read_rows(source: str) -> tuple[Row, ...]:
    """All rows of one source, in the order of its file.

    Raises
    ------
    ConfigError    for a source there is not, or a row that makes no sense
    """
    if source not in SOURCES:
        raise ConfigError(
            f"no validation source '{source}'; allowed: {', '.join(SOURCES)}"
        )
    text = (FOLDER / f"{source}.csv").read_text(encoding="utf-8")
    return tuple(_row(source, values) for values in csv.DictReader(text.splitlines()))


def printed_value(source: str, row_id: str) -> float:
    """The printed number of one row, in SI units."""
    for row in read_rows(source):
        if row.id == row_id:
            return float(row.printed) * UNITS[row.unit]
    raise ConfigError(f"{source}.csv has no row '{row_id}'")


def judge(row: Row, value: float) -> Result:
    """Compare a computed value, in SI units, with what the row prints."""
    computed = value / UNITS[row.unit]
    deviation: float | None = None
    if not row.printed:
        verdict = NOT_PRINTED
    elif row.kind == "claim":
        sign, bound = row.printed.split()
        compare = {">": operator.gt, "<": operator.lt}[sign]
        verdict = (FAILS, HOLDS)[compare(computed, float(bound))]
    else:
        printed = float(row.printed)
        relative = (row.tolerance or 0.0) * abs(printed)
        allowed = max(relative, half_last_digit(row.printed)) * (1.0 + 1e-9)
        if printed:
            deviation = (computed - printed) / abs(printed)
        verdict = (DIFFERS, REPRODUCED)[abs(computed - printed) <= allowed]
    return Result(row=row, computed=computed, deviation=deviation, verdict=verdict)


def half_last_digit(printed: str) -> float:
    """Half a unit of the last digit of a printed number: what rounding alone explains."""
    mantissa, _, exponent = printed.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    return 0.5 * 10.0 ** (int(exponent or 0) - decimals)


def _row(source: str, values: dict[str, str]) -> Row:
    good, tolerance = NOT_PRINTED, None
    if values["printed"]:
        good = {"value": REPRODUCED}.get(values["kind"], HOLDS)
    if values["tolerance"]:
        tolerance = float(values["tolerance"])
    return Row(
        origin=source,
        id=values["id"],
        quantity=values["quantity"],
        at=values["at"],
        overrides=tuple(values["overrides"].split()),
        printed=values["printed"],
        unit=values["unit"],
        tolerance=tolerance,
        kind=values["kind"],
        expected=values["expected"] or good,
        source=values["source"],
        reason=values["reason"],
    )
