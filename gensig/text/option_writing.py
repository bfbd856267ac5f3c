"""Options as files: their names, and their values as YAML with a remark on each."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

OPTION_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,63}")
# names that YAML or Hydra takes for something else
NO_NAMES = ("null", "none", "true", "false", "nan", "inf")


def is_option_name(name: str) -> bool:
    """True for a name that an option of a group and its file can have."""
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
        name = f"{above}{key}"
        if isinstance(value, Mapping):
            lines.append(f"{indent}{key}:")
            lines += option_lines(value, remarks, f"{name}.", f"{indent}  ")
            continue
        line = f"{indent}{key}: {json.dumps(value)}"
        if remarks.get(name):
            line += f"   # {remarks[name]}"
        lines.append(line)
    return lines
