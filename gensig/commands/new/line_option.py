"""The system and the experiment of a gearbox of several stages, as options."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from gensig.commands.new.data_sheet import GearOption
from gensig.commands.new.experiment import (
    CLASSES,
    N_UNITS,
    Wishes,
    check_rate,
    operating_lines,
    plan_lines,
    quality_lines,
    remarked,
)
from gensig.commands.new.line_tables import LineNodes
from gensig.commands.new.stages import (
    StagedSheet,
    mesh_forces,
    shaft_diameters,
)
from gensig.geometry.bearing_sizes import bearing_for
from gensig.systems.derived_sizes import bearing_values

LINE_RATE = 51200.0  # Hz, of sensing=geared_line_bearings
SPUR_STEPS, HELICAL_STEPS = 5, 8  # of a sample at that rate: errors of 1e-4 and 4e-4
SUPPORT_SHAFT = (
    1  # the shaft whose bearing and thickness hold all gears: the first idler's
)


def system_text(
    sheet: StagedSheet, stages: Sequence[GearOption], tables: dict[str, Path]
) -> str:
    """The option of the system; ``tables`` are files by their key of the group."""
    nodes = LineNodes(n_stages=sheet.n_stages)
    named = ", ".join(
        f"{list(mesh)} stage {number}"
        for number, mesh in enumerate(nodes.meshes, start=1)
    )
    lines = [
        "# @package _global_",
        f"# A gearbox of {sheet.n_stages} stages, {sheet.written_teeth} teeth, between a motor "
        "and a brake.",
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
        *_support_lines(sheet, stages),
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


def _support_lines(sheet: StagedSheet, stages: Sequence[GearOption]) -> list[str]:
    """The supports of all gears: bearing and shaft of the first idler, each with its own force."""
    forces = ", ".join(f"{value:.0f}" for value in mesh_forces(stages))
    diameter = shaft_diameters(sheet)[SUPPORT_SHAFT]
    width = max(option.gear["pinion"]["face_width_mm"] for option in stages[:2])
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


def staged_experiment_text(
    sheet: StagedSheet, stages: Sequence[GearOption], wishes: Wishes
) -> str:
    """The experiment, with the origin of each value."""
    for option in stages:
        check_rate(option, wishes)
    classes = list(wishes.classes or CLASSES)
    n_records = N_UNITS * len(classes)
    lines = [
        "# @package _global_",
        f"# Written by gensig new gearbox: {n_records} records of {sheet.name}, "
        f"{len(classes)} classes from {N_UNITS} machines. Faults are",
        "# drawn in shares of a tooth, on any gear. On one gear: "
        "plan.fault_gear=as_given fault.gear=wheel",
        "defaults:",
        f"  - override /system: {sheet.name}",
        "  - override /sensing: geared_line_bearings  # along y at the bearings of all gears",
        "  - _self_",
        "",
        *operating_lines(stages[0], wishes),
    ]
    if wishes.grade is not None:
        lines += quality_lines(wishes, wishes.grade)
    lines += _integration_lines(stages, wishes)
    lines += [
        *plan_lines(stages[0], wishes, classes, n_records),
        remarked("  fault_gear: drawn", "any gear, by equal chance"),
    ]
    return "\n".join(lines) + "\n"


def _integration_lines(stages: Sequence[GearOption], wishes: Wishes) -> list[str]:
    """The groups ``solver`` and ``sensing``: method, steps and sampling rate."""
    least = SPUR_STEPS
    if any(option.is_helical for option in stages):
        least = HELICAL_STEPS
    rate = wishes.rate or LINE_RATE
    steps = max(least, math.ceil(least * LINE_RATE / rate))
    lines = [
        "solver:",
        remarked(
            "  backend: nystroem", "two evaluations a step, friction in every mesh"
        ),
        remarked(
            f"  oversampling: {steps}",
            f"derived: steps of 1/{steps * rate:.0f} s, errors below 1e-3",
        ),
    ]
    if wishes.rate is not None:
        rate_line = remarked(f"  sampling_rate_hz: {wishes.rate:g}", "given")
        lines += ["sensing:", rate_line]
    return lines
