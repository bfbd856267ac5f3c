"""``gensig wear-life``: wear along both flanks, life to a threshold, map of lives."""

from __future__ import annotations

import math
from argparse import Namespace
from dataclasses import replace
from typing import Any

import numpy as np
import yaml

from gensig.arrays import Array
from gensig.commands.console import remark
from gensig.commands.figures.wear_figure import wear_life_figure
from gensig.commands.gears.wear_summary import wear_lines
from gensig.commands.output import Answer, answered
from gensig.errors import ConfigError, SimulationError
from gensig.life.life_laws import (
    FittedLaw,
    LifeMap,
    fitted_laws,
    life_map,
    torque_exponent,
)
from gensig.life.options import SIDES, WearOptions
from gensig.life.wear.archard import flank_radii, hunting_turns
from gensig.life.wear.wear_case import WearCase
from gensig.life.wear.wear_life import WearLife, hours, wear_life
from gensig.operation.options import read_operating
from gensig.options.configuration import Configuration
from gensig.record.inputs import InputReader
from gensig.record.vibration_limit import WornVibration, limited_by_vibration
from gensig.systems.wear import read_wear_case, wear_fault

# shares of the configured torque and speed
MAP_TORQUES = np.geomspace(0.25, 1.5, 6)
MAP_SPEEDS = np.geomspace(0.25, 2.0, 7)
# Of the hardness: a line contact yields below its surface (Johnson, Contact Mechanics, 1985).
YIELD_SHARE = 0.6


@answered(group="fault")
def wear_life_verb(config: Configuration, arguments: Namespace) -> Answer:
    """Life and wear of a pair's flanks, and the worn flanks as an option."""
    case = read_wear_case(config)
    speed = read_operating(config.section("operating")).speed
    if case.pair.transverse_contact_ratio < 1.0:
        _warn_of_interruption(case)
    case, vibration = limited_by_vibration(case, InputReader(config))
    life = wear_life(case)
    if vibration is not None and vibration.limit_depth is not None:
        life = replace(life, ended_by="vibration")
    lives, laws = _lives(case, speed, arguments)
    content = wear_life_content(life, speed, lives, laws, vibration)
    _warn_of_pressure(case, content)
    return Answer(
        content,
        wear_lines(content, lives, laws),
        lambda: wear_life_figure(life, content, lives),
        lambda: _option_text(life, speed),
    )


def _lives(
    case: WearCase, speed: float, arguments: Namespace
) -> tuple[LifeMap | None, tuple[FittedLaw, ...]]:
    """Map of lives and the laws fitted to it, where they are asked for."""
    if not (arguments.map or arguments.torques or arguments.speeds):
        return None, ()
    torques, speeds = case.torque * MAP_TORQUES, speed * MAP_SPEEDS
    if arguments.torques:
        torques = arguments.torques
    if arguments.speeds:
        speeds = np.array(arguments.speeds) * math.pi / 30.0
    lives = life_map(case, list(torques), list(speeds))
    return lives, fitted_laws(lives, case.torque, speed)


def wear_life_content(
    life: WearLife,
    speed: float,
    lives: LifeMap | None,
    laws: tuple[FittedLaw, ...],
    vibration: WornVibration | None,
) -> dict[str, Any]:
    """The keys of ``gensig wear-life --json``; of several slices the greatest value."""
    case = life.case
    path, pair, options, new = case.path, case.pair, case.options, case.new_flanks()
    worn, load = life.depth[-1], case.line_load(new)
    per_mesh = case.wear_per_mesh(new)
    worn_pressure = case.pressure(case.line_load(worn), worn)
    content: dict[str, Any] = {
        "transverse_contact_ratio": pair.transverse_contact_ratio,
        "overlap_ratio": pair.overlap_ratio,
        "rule": options.rule,
        "n_intervals": None,
        "criterion": options.criterion,
        "sharing": "mesh",
        "geometry": options.geometry,
        "torque_nm": case.torque,
        "speed_rpm": speed * 30.0 / math.pi,
        "mesh_force_n": case.force,
        "life_hours": hours(life.life, speed),
        "life_turns": life.life,
        "threshold_um": life.threshold * 1e6,
        "transmission_error_limit_um": None,
        "ended_by": life.ended_by,
        "deepest": _deepest(case, worn),
        "torque_exponent": _torque_exponent(case),
        "speed_exponent": 1.0,
        "turns_until_the_same_teeth_meet": hunting_turns(pair),
        "n_steps": life.n_steps,
        "position_mm": path.position * 1e3,
        "pressure_angle_deg": np.degrees(path.pressure_angle[0]),
        "wheel_pressure_angle_deg": np.degrees(path.pressure_angle[1]),
        "sliding_velocity_mm_per_s": path.sliding * speed * 1e3,
        "line_load_n_per_mm": load.max(axis=0) * 1e-3,
        "contact_pressure_mpa": case.pressure(load, new).max(axis=0) * 1e-6,
        "contact_pressure_at_end_mpa": worn_pressure.max(axis=0) * 1e-6,
        "pair_wear_per_mesh_nm": per_mesh.sum(axis=0).max(axis=0) * 1e9,
    }
    if options.rule == "fixed_intervals":
        content["n_intervals"] = options.n_intervals
    if case.loads is None:
        content["sharing"] = "one_pair"
    if options.transmission_error_limit is not None:
        limit = options.transmission_error_limit * 1e6
        content["transmission_error_limit_um"] = limit
    content |= _flank_content(case, worn, load, per_mesh)
    content["history"] = _history(life, speed)
    if vibration is not None:
        content["vibration"] = _vibration(vibration, options, speed)
    if lives is not None:
        content["map"] = {
            "torque_nm": lives.torque,
            "speed_rpm": lives.speed * 30.0 / math.pi,
            "life_hours": lives.hours,
        }
        content["laws"] = [_law(law) for law in laws]
    return content


def _flank_content(
    case: WearCase, worn: Array, load: Array, per_mesh: Array
) -> dict[str, Any]:
    """Wear and curvature of each gear's flank."""
    content: dict[str, Any] = {}
    mean_depth, mean_load = worn.mean(axis=1), load.mean(axis=0)
    radii = flank_radii(case.path, mean_depth, mean_load, case.material)
    for side, name in enumerate(SIDES):
        content[f"{name}_wear_per_mesh_nm"] = per_mesh[side].max(axis=0) * 1e9
        content[f"{name}_depth_um"] = worn[side].max(axis=0) * 1e6
        if case.shape[1] > 1:
            content[f"{name}_depth_by_slice_um"] = worn[side] * 1e6
        for state, radius in radii.items():
            content[f"{name}_curvature_radius_{state}_mm"] = radius[side] * 1e3
    return content


def _torque_exponent(case: WearCase) -> float | None:
    """Exponent of the life over torque; None where new flanks are at a limit already."""
    try:
        return torque_exponent(case)
    except (ConfigError, SimulationError):
        return None


def _deepest(case: WearCase, depth: Array) -> dict[str, Any]:
    """Gear and position of the depth that is compared with the threshold."""
    if case.options.criterion == "sum":
        total, gear = depth.sum(axis=0), "both"
        _, point = np.unravel_index(total.argmax(), total.shape)
    else:
        side, _, point = np.unravel_index(depth.argmax(), depth.shape)
        gear = SIDES[side]
    return {"gear": gear, "position_mm": case.path.position[point] * 1e3}


def _history(life: WearLife, speed: float) -> dict[str, Any]:
    error = [life.case.error_range(depth) for depth in life.depth]
    return {
        "hours": [hours(turns, speed) for turns in life.turns],
        "pinion_depth_um": life.depth[:, 0].max(axis=(1, 2)) * 1e6,
        "wheel_depth_um": life.depth[:, 1].max(axis=(1, 2)) * 1e6,
        "transmission_error_peak_to_peak_um": np.array(error) * 1e6,
    }


def _vibration(
    vibration: WornVibration, options: WearOptions, speed: float
) -> dict[str, Any]:
    return {
        "limit_m_per_s2": options.vibration_limit_m_per_s2,
        "rise_limit_db": options.vibration_rise,
        "is_reached": vibration.limit_depth is not None,
        "sensors": vibration.sensors,
        "hours": [hours(turns, speed) for turns in vibration.turns],
        "depth_um": vibration.depth * 1e6,
        "rms_m_per_s2": vibration.rms,
        "rise_db": vibration.rise,
    }


def _law(law: FittedLaw) -> dict[str, Any]:
    return {
        "form": law.form,
        "hours": law.text,
        "coefficients": {"a": law.a, "b": law.b, "c": law.c},
        "torque_nm": law.torque,
        "speed_rad_per_s": law.speed,
        "largest_error": law.largest_error,
        "no_life_from_torque_nm": law.no_life_from,
    }


def _warn_of_interruption(case: WearCase) -> None:
    reason = "tips' corners help along"
    if case.loads is None:
        reason = "one pair carries everything on its path"
    ratio = case.pair.transverse_contact_ratio
    remark(
        f"WARNING: the transverse contact ratio {ratio:.4f} is below 1: the drive "
        "is interrupted at every tooth, and no gears run like this; "
        f"the wear here is quasi-static, {reason}"
    )


def _warn_of_pressure(case: WearCase, content: dict[str, Any]) -> None:
    """Print a note where the flanks would yield before they are worn so far."""
    greatest = max(content["contact_pressure_at_end_mpa"])
    hardness = min(case.options.hardness_of(name) for name in SIDES)
    if greatest * 1e6 > YIELD_SHARE * hardness:
        new = max(content["contact_pressure_mpa"])
        remark(
            f"note: the largest pressure rises from {new:.0f} MPa to {greatest:.0f} MPa, "
            f"above {YIELD_SHARE:g} of the hardness: what stands proud, such as at the "
            "pitch point, would yield first"
        )


def _option_text(life: WearLife, speed: float) -> str:
    """The worn flanks as an option of the group ``fault``."""
    case, pair = life.case, life.case.pair
    option = yaml.safe_dump(
        wear_fault(case, life.depth[-1]), sort_keys=False, width=110
    )
    teeth = f"{pair.pinion.n_teeth}/{pair.wheel.n_teeth} teeth"
    duration = f"{hours(life.life, speed):.4g} h at {case.torque:g} N m"
    return f"# Flanks of {teeth} after {duration} (gensig wear-life).\n{option}"
