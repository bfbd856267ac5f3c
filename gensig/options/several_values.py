"""Advice for several values of a key that takes one."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from gensig.options.configuration import FIXED_KEYS
from gensig.units import split_unit

FAULT, TRAIN = "fault", "train"
FAULT_KEY = f"{FAULT}."
MOST_ADVISED = 40  # values that fit into a line
MULTIRUN = {
    "generate": "gensig generate -m makes one data set for each",
    TRAIN: "diagnose train -m makes one run for each",
}


def several_values_text(
    key: str, line: str, values: Sequence[Any], default: Any, primary: str
) -> str:
    """Advice for a key that was given several values without ``-m``.

    Parameters
    ----------
    key, line : the key, and the override as it was typed
    values : the several values
    default : value of the key in the chosen options; None where it is null or unknown, an empty
        mapping for a group
    primary : primary file of the key, ``generate`` or ``train``
    """
    parts = [
        f"{line}: several values, where one is needed",
        *_instead(key, line, values, default, primary),
        MULTIRUN[primary],
    ]
    return "; ".join(parts)


def _instead(
    key: str, line: str, values: Sequence[Any], default: Any, primary: str
) -> list[str]:
    """Words to type in place of several values."""
    if len(values) > MOST_ADVISED:
        return []
    typed = line.partition("=")[2]
    is_decimal = re.fullmatch(r"[-+]?\d+,\d+", typed) is not None
    listed = ",".join(map(str, values))
    if isinstance(default, list | tuple):
        return [f"a list is written '{key}=[{listed}]'"]
    if key == FAULT:
        return [f"for a class of each type 'plan.classes=[{listed}]'"]
    advice = []
    if is_decimal:
        point = typed.replace(",", ".")
        advice.append(f"a decimal comma? Then type {key}={point}")
    if _are_numbers(values) and not isinstance(default, str | bool):
        if primary != TRAIN:
            advice += varied_instead(key, values)
    elif default is None:
        advice.append(f"a list is written '{key}=[{listed}]'")
    return advice


def varied_instead(key: str, values: Sequence[Any]) -> list[str]:
    """The override that draws from numbers within one data set; none for a fixed key."""
    numbers = ", ".join(map(str, values))
    return _varied(key, f"distribution: choice, values: [{numbers}]")


def interval_text(key: str, line: str, low: float, high: float, primary: str) -> str:
    """Advice for ``interval(low,high)``, which has no end of values."""
    limits = f"low: {low:g}, high: {high:g}"
    parts = [
        f"{line}: an interval has no end of values; -m takes {key}=A,B or "
        f"{key}=range({low:g},{high:g},STEP)",
    ]
    if primary != TRAIN:
        parts += _varied(key, f"distribution: uniform, {limits}")
    return "; ".join(parts)


def _varied(key: str, distribution: str) -> list[str]:
    if "." not in key or key.startswith(FIXED_KEYS):
        return []
    name, leaf = "plan.vary", key
    if key.startswith(FAULT_KEY):
        name, leaf = "fault.vary", key.removeprefix(FAULT_KEY)
    return [
        f"to draw it within one data set type '{name}={{{leaf}: {{{distribution}}}}}'"
    ]


def list_text(key: str, line: str, values: Sequence[Any], default: Any) -> str | None:
    """Advice for a list where one value is needed; None where a list may be right.

    A number with a unit is one number; ``fault.tooth`` may be several teeth.
    """
    if key == FAULT:
        names = ", ".join(f"{{kind: {value}}}" for value in values)
        return (
            f"{line}: {FAULT} takes one option; for a class of each type "
            f"'plan.classes=[{','.join(map(str, values))}]', for all on one machine "
            f"{FAULT}=compound '{FAULT}.parts=[{names}]'"
        )
    is_number = isinstance(default, int | float) and split_unit(key)[1] is not None
    if not is_number or not values or not _are_numbers(values):
        return None
    parts = [
        f"{line}: a list, where one number is needed",
        *varied_instead(key, values),
    ]
    typed = ",".join(map(str, values))
    return "; ".join([*parts, f"{MULTIRUN['generate']}, {key}={typed}"])


def _are_numbers(values: Sequence[Any]) -> bool:
    return all(type(value) in (int, float) for value in values)
