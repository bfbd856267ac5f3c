"""The machine of a configuration: a gear pair, or an engine on its drive line."""

from __future__ import annotations

from gensig.options.configuration import Configuration
from gensig.systems.base import Machine
from gensig.systems.registry import LINE, read_system


def read_machine(config: Configuration) -> Machine:
    """Machine that ``system.kind`` names.

    Raises
    ------
    ConfigError, GeometryError    for keys or values that make no machine
    """
    if config.section("system").get("kind") != LINE:
        return read_system(config)
    from gensig.driveline.reading import read_line_machine

    return read_line_machine(config)
