"""``gensig wear-life``.

Wear along both flanks, the life to a threshold, lives over torque and speed.
"""

from __future__ import annotations

import math
import sys
from argparse import Namespace
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from gensig.commands.console import one_line_warnings
from gensig.commands.output import (
    check_outputs,
    option_file,
    write_option,
    write_outputs,
)
from gensig.commands.request import read_configuration
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
from gensig.record.vibration_limit import WornVibration, limited_by_vibration
from gensig.systems.wear import read_wear_case, wear_fault

Array = NDArray[np.float64]

GROUP = "fault"
MAP_TORQUES, MAP_SPEEDS = (
    np.geomspace(0.25, 1.5, 6),
    np.geomspace(0.25, 2.0, 7),
)  # over the configured
YIELD_SHARE = 0.6  # of the hardness: a line contact yields below its surface (Johnson, Contact Mechanics, 1985)


def wear_life_verb(arguments: Namespace) -> int:
    """Life and wear to JSON, a figure, an option for records, or a summary."""
    check_outputs(arguments)
    target = (
        None
        if arguments.out is None
        else option_file(arguments.out, GROUP, force=arguments.force)
    )
    config = read_configuration(arguments)
    with one_line_warnings("gensig"):
        case = read_wear_case(config)
        speed = read_operating(config.section("operating")).speed
        if case.pair.transverse_contact_ratio < 1.0:
            _warn_of_interruption(case)
        case, vibration = limited_by_vibration(case, config)
        life = wear_life(case)
        if vibration is not None and vibration.limit_depth is not None:
            life = replace(life, ended_by="vibration")
        lives, laws = _lives(case, speed, arguments)
        content = wear_life_content(life, speed, lives, laws, vibration)
    _warn_of_pressure(case, content)

    def draw(path: Path) -> None:
        from gensig.commands.figures.wear_figure import plot_wear_life

        plot_wear_life(life, speed, content, lives, path)

    write_outputs(arguments, content, draw)
    _print(content, lives, laws)
    if target is not None:
        _write_option(life, speed, target)
    return 0


def _lives(
    case: WearCase, speed: float, arguments: Namespace
) -> tuple[LifeMap | None, tuple[FittedLaw, ...]]:
    if not (arguments.map or arguments.torques or arguments.speeds):
        return None, ()
    torques = arguments.torques or case.torque * MAP_TORQUES
    speeds = (
        speed * MAP_SPEEDS
        if not arguments.speeds
        else np.array(arguments.speeds) * math.pi / 30.0
    )
    lives = life_map(case, list(torques), list(speeds))
    return lives, fitted_laws(lives, case.torque, speed)


def wear_life_content(
    life: WearLife,
    speed: float,
    lives: LifeMap | None = None,
    laws: tuple[FittedLaw, ...] = (),
    vibration: WornVibration | None = None,
) -> dict[str, Any]:
    """The keys of ``gensig wear-life --json``.

    Where there are several slices, the greatest of them.
    """
    case = life.case
    path, pair, options, new, worn = (
        case.path,
        case.pair,
        case.options,
        case.new_flanks(),
        life.depth[-1],
    )
    load = case.line_load(new)
    per_mesh = case.wear_per_mesh(new)
    deepest = np.unravel_index(_judged(case, worn).argmax(), worn.shape)
    content: dict[str, Any] = {
        "transverse_contact_ratio": pair.transverse_contact_ratio,
        "overlap_ratio": pair.overlap_ratio,
        "rule": options.rule,
        "n_intervals": options.n_intervals
        if options.rule == "fixed_intervals"
        else None,
        "criterion": options.criterion,
        "sharing": "one_pair" if case.loads is None else "mesh",
        "geometry": options.geometry,
        "torque_nm": case.torque,
        "speed_rpm": speed * 30.0 / math.pi,
        "mesh_force_n": case.force,
        "life_hours": hours(life.life, speed),
        "life_turns": life.life,
        "threshold_um": life.threshold * 1e6,
        "transmission_error_limit_um": _micrometres(options.transmission_error_limit),
        "ended_by": life.ended_by,
        "deepest": {
            "gear": "both" if options.criterion == "sum" else SIDES[deepest[0]],
            "position_mm": float(path.position[deepest[2]]) * 1e3,
        },
        "torque_exponent": _torque_exponent(case),
        "speed_exponent": 1.0,
        "turns_until_the_same_teeth_meet": hunting_turns(pair),
        "n_steps": life.n_steps,
        "position_mm": _list(path.position * 1e3),
        "pressure_angle_deg": _list(np.degrees(path.pressure_angle[0])),
        "wheel_pressure_angle_deg": _list(np.degrees(path.pressure_angle[1])),
        "sliding_velocity_mm_per_s": _list(path.sliding * speed * 1e3),
        "line_load_n_per_mm": _list(load.max(axis=0) * 1e-3),
        "contact_pressure_mpa": _list(case.pressure(load, new).max(axis=0) * 1e-6),
        "contact_pressure_at_end_mpa": _list(
            case.pressure(case.line_load(worn), worn).max(axis=0) * 1e-6
        ),
        "pair_wear_per_mesh_nm": _list(per_mesh.sum(axis=0).max(axis=0) * 1e9),
    }
    for side, name in enumerate(SIDES):
        content[f"{name}_wear_per_mesh_nm"] = _list(per_mesh[side].max(axis=0) * 1e9)
        content[f"{name}_depth_um"] = _list(worn[side].max(axis=0) * 1e6)
        if case.shape[1] > 1:
            content[f"{name}_depth_by_slice_um"] = (worn[side] * 1e6).tolist()
        for key, values in flank_radii(
            path, worn.mean(axis=1), load.mean(axis=0), case.material
        ).items():
            content[f"{name}_curvature_radius_{key}_mm"] = _list(values[side] * 1e3)
    content["history"] = {
        "hours": _list(np.array([hours(turns, speed) for turns in life.turns])),
        "pinion_depth_um": _list(life.depth[:, 0].max(axis=(1, 2)) * 1e6),
        "wheel_depth_um": _list(life.depth[:, 1].max(axis=(1, 2)) * 1e6),
        "transmission_error_peak_to_peak_um": _list(
            np.array([case.error_range(one) for one in life.depth]) * 1e6
        ),
    }
    if vibration is not None:
        content["vibration"] = _vibration_content(vibration, options, speed)
    if lives is not None:
        content["map"] = {
            "torque_nm": _list(lives.torque),
            "speed_rpm": _list(lives.speed * 30.0 / math.pi),
            "life_hours": lives.hours.tolist(),
        }
        content["laws"] = [_law_content(law) for law in laws]
    return content


def _torque_exponent(case: WearCase) -> float | None:
    try:
        return torque_exponent(case)
    except (
        ConfigError,
        SimulationError,
    ):  # at 5 % more torque new flanks may be at the limit already
        return None


def _judged(case: WearCase, depth: Array) -> Array:
    """What is compared with the threshold, in the shape of ``depth``."""
    return (
        np.broadcast_to(depth.sum(axis=0), depth.shape)
        if case.options.criterion == "sum"
        else depth
    )


def _vibration_content(
    vibration: WornVibration, options: WearOptions, speed: float
) -> dict[str, Any]:
    return {
        "limit_m_per_s2": options.vibration_limit_m_per_s2,
        "rise_limit_db": options.vibration_rise,
        "is_reached": vibration.limit_depth is not None,
        "sensors": list(vibration.sensors),
        "hours": _list(np.array([hours(turns, speed) for turns in vibration.turns])),
        "depth_um": _list(vibration.depth * 1e6),
        "rms_m_per_s2": vibration.rms.tolist(),
        "rise_db": vibration.rise.tolist(),
    }


def _law_content(law: FittedLaw) -> dict[str, Any]:
    return {
        "form": law.form,
        "hours": law.text,
        "coefficients": {"a": law.a, "b": law.b, "c": law.c},
        "torque_nm": list(law.torque),
        "speed_rad_per_s": list(law.speed),
        "largest_error": law.largest_error,
        "no_life_from_torque_nm": law.no_life_from,
    }


def _micrometres(length: float | None) -> float | None:
    return None if length is None else length * 1e6


def _list(values: Array) -> list[float | None]:
    """Numbers for JSON, which knows neither infinity nor NaN."""
    return [float(value) if np.isfinite(value) else None for value in values]


def _warn_of_interruption(case: WearCase) -> None:
    one = (
        "one pair carries everything on its path"
        if case.loads is None
        else "tips' corners help along"
    )
    print(
        f"gensig: WARNING: the transverse contact ratio {case.pair.transverse_contact_ratio:.4f} is below 1: the drive "
        f"is interrupted at every tooth, and no gears run like this; the wear here is quasi-static, {one}",
        file=sys.stderr,
    )


def _warn_of_pressure(case: WearCase, content: Mapping[str, Any]) -> None:
    """Say where the flanks would yield before they are worn so far."""
    greatest = max(content["contact_pressure_at_end_mpa"]) * 1e6
    hardness = min(case.options.hardness_of(name) for name in SIDES)
    if greatest > YIELD_SHARE * hardness:
        new = max(content["contact_pressure_mpa"])
        print(
            f"gensig: note: the largest pressure rises from {new:.0f} MPa to {greatest * 1e-6:.0f} MPa, above "
            f"{YIELD_SHARE:g} of the hardness: what stands proud, such as at the pitch point, would yield first",
            file=sys.stderr,
        )


def _print(
    content: Mapping[str, Any], lives: LifeMap | None, laws: tuple[FittedLaw, ...]
) -> None:
    def ends(key: str) -> str:
        values = content[key]
        return f"{values[0]:.4g} .. {values[-1]:.4g}"

    print(
        f"rule                       {content['rule']}, sharing {content['sharing']}, geometry {content['geometry']}"
    )
    print(f"contact ratio              {content['transverse_contact_ratio']:.4f}")
    print(f"pressure angle, A to E     {ends('pressure_angle_deg')} deg on the pinion")
    print(
        f"sliding, A to E            {ends('sliding_velocity_mm_per_s')} mm/s, 0 at the pitch point"
    )
    print(f"contact pressure, A to E   {ends('contact_pressure_mpa')} MPa, new flanks")
    for name in SIDES:
        print(
            f"{name:<6} wear, A to E       {ends(f'{name}_wear_per_mesh_nm')} nm a mesh, new flanks"
        )
    where = content["deepest"]
    print(
        f"life                       {content['life_hours']:.5g} h, {content['life_turns']:.5g} turns of the pinion"
    )
    print(f"ended by                   {content['ended_by'].replace('_', ' ')}, {content['threshold_um']:.4g} um "
          f"({where['gear']}, {where['position_mm']:.3f} mm from A)")  # fmt: skip
    _print_limits(content)
    if content["torque_exponent"] is not None:
        print(
            f"local law                  life ~ torque^-{content['torque_exponent']:.3f} speed^-1"
        )
    if lives is not None:
        print(
            f"{'life, h':<10}"
            + "".join(f"{speed * 30.0 / math.pi:>11.4g}" for speed in lives.speed)
            + " r/min"
        )
        for torque, row in zip(lives.torque, lives.hours, strict=True):
            print(f"{torque:>6.4g} N m" + "".join(f"{value:>11.4g}" for value in row))
    for law in laws:
        print(f"{law.form:<12} {law.text} h, off by at most {law.largest_error:.1%}; {law.torque[0]:.4g} .. "
              f"{law.torque[1]:.4g} N m, {law.speed[0]:.4g} .. {law.speed[1]:.4g} rad/s" + _refusal(law))  # fmt: skip


def _refusal(law: FittedLaw) -> str:
    return (
        ""
        if law.no_life_from is None
        else f"; no life from {law.no_life_from:.4g} N m on"
    )


def _print_limits(content: Mapping[str, Any]) -> None:
    """How near the life came to limits that did not end it, and how the machine shakes."""
    limit, error = (
        content["transmission_error_limit_um"],
        content["history"]["transmission_error_peak_to_peak_um"],
    )
    if limit is not None and content["ended_by"] != "transmission_error":
        print(f"transmission error         {error[-1]:.4g} um from peak to peak at the end; limit of {limit:g} um not "
              "reached")  # fmt: skip
    vibration = content.get("vibration")
    if vibration is not None:
        rms = np.array(vibration["rms_m_per_s2"])
        end = int(
            np.abs(np.array(vibration["depth_um"]) - content["threshold_um"]).argmin()
        )
        asked = (
            (vibration["limit_m_per_s2"], "m/s2"),
            (vibration["rise_limit_db"], "dB"),
        )
        limits = " and ".join(
            f"{value:g} {unit}" for value, unit in asked if value is not None
        )
        rise, reached = (
            max(vibration["rise_db"][end]),
            "" if vibration["is_reached"] else "not ",
        )
        print(f"vibration                  {rms[0].max():.4g} m/s2 RMS with new flanks, loudest sensor; at the end "
              f"{rms[end].max():.4g}, up by {rise:.3g} dB at most; limit of {limits} {reached}reached")  # fmt: skip


def _write_option(life: WearLife, speed: float, target: Path) -> None:
    """The worn flanks as an option of the group ``fault``."""
    pair = life.case.pair
    option = yaml.safe_dump(
        wear_fault(life.case, life.depth[-1]), sort_keys=False, width=110
    )
    write_option(
        target,
        f"# Flanks of {pair.pinion.n_teeth}/{pair.wheel.n_teeth} teeth after {hours(life.life, speed):.4g} h at "
        f"{life.case.torque:g} N m (gensig wear-life).\n{option}",
    )
