"""Options as files: what may be their name, and values as YAML with a remark beside each."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

OPTION_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,63}")
NO_NAMES = (
    "null",
    "none",
    "true",
    "false",
    "nan",
    "inf",
)  # what YAML or Hydra takes for something else


def is_option_name(name: str) -> bool:
    """Whether a group can have an option of that name, and a folder a file."""
    return OPTION_NAME.fullmatch(name) is not None and name.lower() not in NO_NAMES


def option_lines(
    values: Mapping[str, Any],
    remarks: Mapping[str, str],
    above: str = "",
    indent: str = "",
) -> list[str]:
    """Nested values as lines of YAML; ``remarks`` are by dotted name and stand behind the value."""
    lines = []
    for key, value in values.items():
        place = f"{above}{key}"
        if isinstance(value, Mapping):
            lines += [
                f"{indent}{key}:",
                *option_lines(value, remarks, f"{place}.", indent + "  "),
            ]
        else:
            remark = remarks.get(place)
            lines.append(
                f"{indent}{key}: {json.dumps(value)}"
                + (f"   # {remark}" if remark else "")
            )
    return lines
