"""The system of a gearbox of several stages, as an option."""

from __future__ import annotations

from pathlib import Path

from gensig.commands.new.experiment import remarked
from gensig.commands.new.line_tables import LineNodes
from gensig.commands.new.stages import Gearbox
from gensig.geometry.bearing_sizes import bearing_for
from gensig.systems.derived_sizes import bearing_values

SUPPORT_SHAFT = (
    1  # the shaft whose bearing and thickness hold all gears: the first idler's
)


def system_text(gearbox: Gearbox, tables: dict[str, Path]) -> str:
    """The option of the system; ``tables`` are files by their key of the group."""
    sheet, nodes = gearbox.sheet, LineNodes(len(gearbox.stages))
    named = ", ".join(
        f"{list(mesh)} stage {number}"
        for number, mesh in enumerate(nodes.meshes, start=1)
    )
    lines = [
        "# @package _global_",
        f"# A gearbox of {len(gearbox.stages)} stages, {gearbox.written_teeth} teeth, "
        "between a motor and a brake.",
        "# Written by gensig new gearbox. The heads of both tables say where sizes are from; put "
        "in what",
        "# you know. docs/howto/your_drive_line.md",
        "defaults: [shaft_line, _self_]",
        "",
        "system:",
        f"  name: {sheet.name}",
        "  # tables: from the folder in which gensig is called, or a full path",
        *[f"  {key}: {file.as_posix()}" for key, file in tables.items()],
        remarked(
            f"  record_mesh: {list(nodes.meshes[0])}", f"{named}: nodes of its gears"
        ),
        remarked("  motor_node: 1", "Motor"),
        remarked(f"  load_node: {nodes.load}", "Brake"),
        *_support_lines(gearbox),
        "  campbell:",
        remarked(
            f"    high_speed_rpm: {1.5 * sheet.speed:g}", "assumed: 1.5 of the rated"
        ),
        "excitation:",
        "  reference:",
        remarked(f"    speed_rpm: {sheet.speed:g}", "given; of the motor"),
        remarked(
            f"    torque_nm: {sheet.torque:g}",
            "given; of the load, as the motor feels it",
        ),
    ]
    return "\n".join(lines) + "\n"


def _support_lines(gearbox: Gearbox) -> list[str]:
    """The supports of all gears: bearing and shaft of the first idler, each with its own force."""
    forces = ", ".join(f"{value:.0f}" for value in gearbox.mesh_forces)
    diameter = gearbox.diameters[SUPPORT_SHAFT]
    width = max(option.gear["pinion"]["face_width_mm"] for option in gearbox.stages[:2])
    lines = [
        "  support:                       # of every gear",
        remarked(
            "    force_n: null",
            f"derived: tooth force of each gear at the rated torque, by stages {forces} N",
        ),
        remarked(
            "    bearing:",
            f"assumed: of the first idler, {bearing_for(diameter).describes}",
        ),
    ]
    values = bearing_values(diameter)
    lines += [f"      {key}: {value:g}" for key, value in values.items()]
    return [
        *lines,
        "    shaft:",
        remarked(f"      diameter_mm: {diameter:g}", "derived: of the first idler"),
        remarked(
            f"      span_mm: {2.0 * width + diameter:.4g}",
            "assumed: two face widths and a shaft diameter, the gear in the middle",
        ),
    ]
