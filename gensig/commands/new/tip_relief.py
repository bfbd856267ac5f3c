"""Tip reliefs of a new gearbox, which its maker grinds and its name plate does not tell."""

from __future__ import annotations

from gensig.commands.new.data_sheet import GearOption
from gensig.errors import GeometryError
from gensig.geometry.contact import SIDES
from gensig.systems.pair_machine import GearPairMachine
from gensig.text.option_writing import option_lines

RELIEF_ORIGIN = (
    "derived for the rated torque by Welbourn's rule, docs/theory/spur_mesh.md"
)


def tip_reliefs(option: GearOption) -> dict[str, dict[str, float]]:
    """Tip relief of each gear for the rated torque: key of a modification -> value, by gear.

    Empty for helical gears, and for contact ratios outside 1 to 2.
    """
    machine = option.machine
    if not isinstance(machine, GearPairMachine) or not machine.has_whole_teeth:
        return {}
    try:
        relief = machine.long_relief()
    except GeometryError:
        return {}
    return {
        side: {
            "tip_relief_um": round(1e6 * relief.sides[side].tip_relief, 2),
            "tip_relief_height_mm": round(
                1e3 * relief.sides[side].tip_relief_height, 3
            ),
        }
        for side in SIDES
    }


def modification_text(option: GearOption) -> str:
    """The option of the group ``modification``; empty where gears have no relief."""
    reliefs = tip_reliefs(option)
    if not reliefs:
        return ""
    lines = [
        "# Written by gensig new gearbox.",
        f"# Tip reliefs: {RELIEF_ORIGIN}.",
        "defaults:",
        "  - none",
        "  - _self_",
    ]
    return "\n".join([*lines, *option_lines(reliefs, {})]) + "\n"
