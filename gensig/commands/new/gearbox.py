"""``gensig new gearbox``: options of a gearbox of one stage or several from its data sheet."""

from __future__ import annotations

import json
import math
import warnings
from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gensig.commands.new.asking import N_TEETH, ask_missing, counts_text
from gensig.commands.new.doubts import all_doubts
from gensig.commands.new.experiment import experiment_text, read_wishes
from gensig.commands.new.healthy_level import read_level
from gensig.commands.new.line_option import system_text
from gensig.commands.new.line_tables import gears_table, shafting_table
from gensig.commands.new.option_files import (
    check_free,
    check_name,
    check_texts,
    next_commands,
    write_options,
)
from gensig.commands.new.stages import Gearbox, read_gearbox
from gensig.commands.new.tip_relief import modification_text
from gensig.errors import ConfigError
from gensig.geometry.bearing_sizes import bearing_for
from gensig.terminal.printing import show, show_text

# of ``GearOption.derived``, those that are told of each of several stages
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


def new(arguments: Namespace) -> int:
    """Write the options of a gearbox, and print derived values and the next commands."""
    folder, name = Path(arguments.dir), arguments.name
    check_name(name, ["experiment"], [_option(folder, "experiment", name)])
    ask_missing(arguments)
    if len(arguments.teeth) not in N_TEETH:
        raise ConfigError(
            f"--teeth takes {counts_text(N_TEETH)} numbers, driving and driven gear of each "
            f"stage, not {len(arguments.teeth)}"
        )
    groups, contents = ["gear", "modification"], pair_content
    if len(arguments.teeth) > 2:
        groups, contents = ["system"], line_content
    check_name(name, groups, ())
    gearbox = read_gearbox(arguments)
    wishes = read_wishes(arguments)
    texts, tables = option_texts(gearbox, folder)
    texts["experiment"] = experiment_text(gearbox, wishes)
    new_files = dict(tables.values())
    new_files |= {_option(folder, group, name): text for group, text in texts.items()}
    check_free(new_files)
    check_texts(name, texts, {key: text for key, (_, text) in tables.items()})
    for message in all_doubts(gearbox.stages):
        warnings.warn(message, stacklevel=2)
    write_options(new_files)
    derived = contents(gearbox)
    content: dict[str, Any] = {
        "files": [str(file) for file in new_files],
        **derived,
        "next": next_commands(folder, name),
    }
    level = read_level(arguments, folder)
    if level is not None:
        content["healthy_level"] = level.content()
    if arguments.json:
        show_text(json.dumps(content))
        return 0
    *first, last = content["files"]
    origin = "each line there says where it is from"
    if tables:
        origin = "each says where its values are from"
    show(f"wrote {', '.join(first)} and {last}; {origin}")
    show("with the gears as given it follows:")
    show(*[f"  {key:<32}{text}" for key, text in _rows(derived)])
    if level is not None:
        show(*level.lines())
    show("next:", *[f"  {line}" for line in content["next"]])
    return 0


def _option(folder: Path, group: str, name: str) -> Path:
    return folder / group / f"{name}.yaml"


def option_texts(
    gearbox: Gearbox, folder: Path
) -> tuple[dict[str, str], dict[str, tuple[Path, str]]]:
    """Texts of the machine's options by group; file and text of its tables by their key."""
    if len(gearbox.stages) == 1:
        (stage,) = gearbox.stages
        texts = {"gear": stage.text(), "modification": modification_text(stage)}
        return {group: text for group, text in texts.items() if text}, {}
    written = {"shafting": shafting_table(gearbox), "gears": gears_table(gearbox)}
    tables = {
        f"{key}_csv": (folder / "tables" / f"{gearbox.sheet.name}_{key}.csv", text)
        for key, text in written.items()
    }
    files = {key: file for key, (file, _) in tables.items()}
    return {"system": system_text(gearbox, files)}, tables


def pair_content(gearbox: Gearbox) -> dict[str, Any]:
    """Values that follow from the sheet of a single pair."""
    (stage,) = gearbox.stages
    return {"derived": stage.derived(), "bearings": stage.bearings()}


def line_content(gearbox: Gearbox) -> dict[str, Any]:
    """Values of several stages that follow: of the whole, of each stage and of each shaft."""
    sheet, last = gearbox.sheet, gearbox.slowdowns[-1]
    of_stages = [
        {**stage.derived(), "mesh_force_n": force}
        for stage, force in zip(gearbox.stages, gearbox.mesh_forces, strict=True)
    ]
    keys = ["mesh_force_n", *(key for key in OF_STAGES if key in of_stages[0])]
    return {
        "derived": {
            "ratio": last,
            "output_speed_rpm": sheet.speed / last,
            "output_torque_nm": sheet.torque * last,
            "power_kw": of_stages[0]["power_kw"],
        },
        "stages": {key: [values[key] for values in of_stages] for key in keys},
        "shafts": [
            _shaft(sheet.speed / slowdown, sheet.torque * slowdown, diameter)
            for slowdown, diameter in zip(
                gearbox.slowdowns, gearbox.diameters, strict=True
            )
        ],
    }


def _shaft(speed: float, torque: float, diameter_mm: float) -> dict[str, Any]:
    """Values of a round shaft; its stress in torsion is 16 T / (pi d^3)."""
    return {
        "speed_rpm": speed,
        "torque_nm": torque,
        "diameter_mm": diameter_mm,
        "torsional_stress_mpa": 16e-6 * torque / (math.pi * (1e-3 * diameter_mm) ** 3),
        "bearing": bearing_for(diameter_mm).describes,
    }


def _rows(content: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Names and texts of what follows from the sheet."""
    rows = [(key, _short(value)) for key, value in content["derived"].items()]
    bearings = content.get("bearings", {})
    rows += [(f"{side}_bearings", bearing) for side, bearing in bearings.items()]
    for key, values in content.get("stages", {}).items():
        cells = "  ".join(f"{_short(value):<10}" for value in values)
        rows.append((key, cells.rstrip()))
    for number, shaft in enumerate(content.get("shafts", ()), start=1):
        numbers = (
            f"{shaft['speed_rpm']:.4g} r/min, {shaft['torque_nm']:.4g} N m, "
            f"{shaft['diameter_mm']:g} mm at {shaft['torsional_stress_mpa']:.3g} MPa"
        )
        rows.append((f"shaft {number}", f"{numbers}, {shaft['bearing']}"))
    return rows


def _short(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}"
