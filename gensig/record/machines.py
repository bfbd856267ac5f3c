"""The machine of a configuration, whatever it is: a gear pair, or an engine on its drive line."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gensig.systems.pair_machine import PairMachine
from gensig.systems.registry import LINE, read_system, section


def read_machine(config: Mapping[str, Any]) -> PairMachine:
    """Build what ``system.kind`` names.

    Raises
    ------
    ConfigError, GeometryError    for keys or values that make no machine
    """
    if section(config, "system").get("kind") != LINE:
        return read_system(config)
    from gensig.driveline.machine import (
        read_line_machine,
    )

    return read_line_machine(config)
