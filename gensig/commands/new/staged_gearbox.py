"""``gensig new gearbox`` of several stages: two tables, a system and an experiment."""

from __future__ import annotations

import json
import math
import warnings
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gensig.commands.new.data_sheet import GearOption
from gensig.commands.new.doubts import all_doubts
from gensig.commands.new.experiment import read_wishes
from gensig.commands.new.healthy_level import read_level
from gensig.commands.new.line_option import staged_experiment_text, system_text
from gensig.commands.new.line_tables import gears_table, shafting_table
from gensig.commands.new.option_files import (
    check_free,
    check_name,
    check_texts,
    next_commands,
    write_options,
)
from gensig.commands.new.stages import (
    StagedSheet,
    mesh_forces,
    shaft_diameters,
    stage_options,
)
from gensig.errors import ConfigError
from gensig.geometry.bearing_sizes import bearing_for
from gensig.terminal.printing import show, show_text

GROUPS = ("system", "experiment")  # written in this order
TABLES = ("shafting", "gears")
# flags of one pair that several stages do not take, and what to do in their place
ONE_STAGE_FLAGS = {
    "bores": "edit bore_radius_mm in the table of gears",
    "supports": "edit system.support in the option of the system",
    "sensors": "records of a drive line have no housing",
}
# of ``GearOption.derived``, those that are told of each stage
OF_STAGES = (
    "pitch_line_speed_m_per_s",
    "tooth_force_per_width_n_per_mm",
    "nominal_root_stress_mpa",
    "center_distance_mm",
    "transverse_contact_ratio",
    "overlap_ratio",
    "mesh_frequency_hz",
    "pinion_mass_kg",
    "wheel_mass_kg",
    "pinion_inertia_kg_m2",
    "wheel_inertia_kg_m2",
    "backlash_um",
)


def read_staged_sheet(arguments: Namespace) -> StagedSheet:
    """The data sheet of the flags of several stages.

    Raises
    ------
    ConfigError    for flags of a single pair, and numbers that are not one a stage or a gear
    """
    for flag, instead in ONE_STAGE_FLAGS.items():
        if getattr(arguments, flag) is not None:
            raise ConfigError(f"--{flag} is for one pair of gears; {instead}")
    if arguments.experiment != "plain":
        raise ConfigError(
            f"--experiment {arguments.experiment} is for one pair of gears: records of a drive "
            "line have no housing; leave it out"
        )
    teeth = _pairs(arguments.teeth)
    n_stages = len(teeth)
    shifts = arguments.profile_shifts
    if shifts is not None:
        if len(shifts) == 1:
            shifts = shifts * 2 * n_stages
        if len(shifts) != 2 * n_stages:
            raise ConfigError(
                f"--profile-shifts takes one number for all gears, or {2 * n_stages}: one a gear"
            )
        shifts = _pairs(shifts)
    widths = arguments.widths
    if widths is not None:
        widths = _of_stages("--widths", widths, n_stages)
    return StagedSheet(
        name=arguments.name,
        teeth=teeth,
        modules=_of_stages("--module", arguments.module, n_stages),
        speed=arguments.speed,
        torque=arguments.torque,
        widths=widths,
        profile_shifts=shifts,
        helix_angle=arguments.helix or 0.0,
        pressure_angle=arguments.pressure_angle,
        addendum=arguments.addendum,
    )


def _pairs(values: Sequence[Any]) -> tuple[tuple[Any, Any], ...]:
    """Values of driving and driven gear of each stage, from all in turn."""
    return tuple(zip(values[::2], values[1::2], strict=True))


def _of_stages(flag: str, values: Sequence[float], n_stages: int) -> tuple[float, ...]:
    """One value a stage, from one for all or one each."""
    if len(values) not in (1, n_stages):
        raise ConfigError(
            f"{flag} takes one number for all stages, or {n_stages}: one a stage"
        )
    if len(values) == 1:
        return (values[0],) * n_stages
    return tuple(values)


def new_staged(sheet: StagedSheet, arguments: Namespace) -> int:
    """Write tables and options, and print derived values and the next commands."""
    folder, name = Path(arguments.dir), sheet.name
    options = {group: folder / group / f"{name}.yaml" for group in GROUPS}
    tables = {
        f"{table}_csv": folder / "tables" / f"{name}_{table}.csv" for table in TABLES
    }
    check_name(name, ("system",), ())
    wishes = read_wishes(arguments)
    stages = stage_options(sheet)
    table_texts = {
        "shafting_csv": shafting_table(sheet, stages),
        "gears_csv": gears_table(sheet, stages),
    }
    texts = {
        "system": system_text(sheet, stages, tables),
        "experiment": staged_experiment_text(sheet, stages, wishes),
    }
    new_files = {file: table_texts[key] for key, file in tables.items()}
    new_files |= {file: texts[group] for group, file in options.items()}
    check_free(new_files)
    check_texts(name, texts, table_texts)
    for message in all_doubts(stages):
        warnings.warn(message, stacklevel=2)
    write_options(new_files)
    content: dict[str, Any] = {
        "files": [str(file) for file in new_files],
        "derived": derived(sheet, stages),
        "stages": stage_values(stages),
        "shafts": shaft_values(sheet),
        "next": next_commands(folder, name),
    }
    level = read_level(arguments, folder)
    if level is not None:
        content["healthy_level"] = level.content()
    if arguments.json:
        show_text(json.dumps(content))
        return 0
    _print(content)
    if level is not None:
        show(*level.lines())
    show("next:", *[f"  {line}" for line in content["next"]])
    return 0


def derived(sheet: StagedSheet, stages: Sequence[GearOption]) -> dict[str, float]:
    """Values of the gearbox that follow from the sheet, by key with unit."""
    slowdown = sheet.slowdowns[-1]
    power = stages[0].derived()["power_kw"]
    assert power is not None
    return {
        "ratio": slowdown,
        "output_speed_rpm": sheet.speed / slowdown,
        "output_torque_nm": sheet.torque * slowdown,
        "power_kw": power,
    }


def stage_values(stages: Sequence[GearOption]) -> dict[str, list[float | None]]:
    """Values of each stage, (stage,), by key with unit; None where there is none."""
    of_stages = [
        {**option.derived(), "mesh_force_n": force}
        for option, force in zip(stages, mesh_forces(stages), strict=True)
    ]
    keys = ["mesh_force_n", *(key for key in OF_STAGES if key in of_stages[0])]
    return {key: [values[key] for values in of_stages] for key in keys}


def shaft_values(sheet: StagedSheet) -> list[dict[str, Any]]:
    """Speed, torque, diameter and bearing of each shaft, the input one first."""
    diameters = zip(sheet.slowdowns, shaft_diameters(sheet), strict=True)
    return [
        {
            "speed_rpm": sheet.speed / slowdown,
            "torque_nm": sheet.torque * slowdown,
            "diameter_mm": diameter,
            "torsional_stress_mpa": _torsional_stress(
                sheet.torque * slowdown, diameter
            ),
            "bearing": bearing_for(diameter).describes,
        }
        for slowdown, diameter in diameters
    ]


def _torsional_stress(torque: float, diameter_mm: float) -> float:
    """Nominal stress of a round shaft in torsion, 16 T / (pi d^3), MPa."""
    return 16e-6 * torque / (math.pi * (1e-3 * diameter_mm) ** 3)


def _print(content: dict[str, Any]) -> None:
    *files, last = content["files"]
    show(f"wrote {', '.join(files)} and {last}; each says where its values are from")
    show("with the gears as given it follows:")
    for key, value in content["derived"].items():
        show(f"  {key:<32}{value:.4g}")
    for key, values in content["stages"].items():
        texts = ["-" if value is None else f"{value:.4g}" for value in values]
        show(f"  {key:<32}{'  '.join(f'{text:<10}' for text in texts)}".rstrip())
    for number, shaft in enumerate(content["shafts"], start=1):
        numbers = (
            f"{shaft['speed_rpm']:.4g} r/min, {shaft['torque_nm']:.4g} N m, "
            f"{shaft['diameter_mm']:g} mm at {shaft['torsional_stress_mpa']:.3g} MPa"
        )
        show(f"  {f'shaft {number}':<32}{numbers}, {shaft['bearing']}")
