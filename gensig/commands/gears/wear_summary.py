"""Summary of ``gensig wear-life`` on the terminal."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gensig.life.life_laws import FittedLaw, LifeMap
from gensig.life.options import SIDES
from gensig.terminal.printing import show


def print_wear_life(
    content: Mapping[str, Any], lives: LifeMap | None, laws: tuple[FittedLaw, ...]
) -> None:
    """Print the life, the values at both ends of the path, the map and its laws."""

    def ends(key: str) -> str:
        values = content[key]
        return f"{values[0]:.4g} .. {values[-1]:.4g}"

    rule, sharing, geometry = content["rule"], content["sharing"], content["geometry"]
    life, turns = content["life_hours"], content["life_turns"]
    deepest = content["deepest"]
    show(f"rule                       {rule}, sharing {sharing}, geometry {geometry}")
    show(f"contact ratio              {content['transverse_contact_ratio']:.4f}")
    show(f"pressure angle, A to E     {ends('pressure_angle_deg')} deg on the pinion")
    sliding = ends("sliding_velocity_mm_per_s")
    show(f"sliding, A to E            {sliding} mm/s, 0 at the pitch point")
    show(f"contact pressure, A to E   {ends('contact_pressure_mpa')} MPa, new flanks")
    for name in SIDES:
        wear = ends(f"{name}_wear_per_mesh_nm")
        show(f"{name:<6} wear, A to E       {wear} nm a mesh, new flanks")
    show(f"life                       {life:.5g} h, {turns:.5g} turns of the pinion")
    show(
        f"ended by                   {content['ended_by'].replace('_', ' ')}, "
        f"{content['threshold_um']:.4g} um "
        f"({deepest['gear']}, {deepest['position_mm']:.3f} mm from A)"
    )
    _print_error_limit(content)
    if "vibration" in content:
        _print_vibration(content["vibration"], content["threshold_um"])
    if content["torque_exponent"] is not None:
        exponent = content["torque_exponent"]
        show(f"local law                  life ~ torque^-{exponent:.3f} speed^-1")
    if lives is not None:
        _print_map(lives)
    for law in laws:
        _print_law(law)


def _print_error_limit(content: Mapping[str, Any]) -> None:
    """Print how near the transmission error came to a limit that did not end the life."""
    limit = content["transmission_error_limit_um"]
    if limit is not None and content["ended_by"] != "transmission_error":
        error = content["history"]["transmission_error_peak_to_peak_um"][-1]
        show(
            f"transmission error         {error:.4g} um from peak to peak at the end; "
            f"limit of {limit:g} um not reached"
        )


def _print_vibration(vibration: Mapping[str, Any], threshold_um: float) -> None:
    rms = vibration["rms_m_per_s2"]
    end = int(np.abs(vibration["depth_um"] - threshold_um).argmin())
    asked = {"m/s2": vibration["limit_m_per_s2"], "dB": vibration["rise_limit_db"]}
    limits = " and ".join(
        f"{value:g} {unit}" for unit, value in asked.items() if value is not None
    )
    reached = "reached"
    if not vibration["is_reached"]:
        reached = "not reached"
    rise = max(vibration["rise_db"][end])
    show(
        f"vibration                  {rms[0].max():.4g} m/s2 RMS with new flanks, "
        f"loudest sensor; at the end {rms[end].max():.4g}, up by {rise:.3g} dB at most; "
        f"limit of {limits} {reached}"
    )


def _print_map(lives: LifeMap) -> None:
    heads = [f"{speed * 30.0 / math.pi:>11.4g}" for speed in lives.speed]
    show(f"{'life, h':<10}{''.join(heads)} r/min")
    for torque, row in zip(lives.torque, lives.hours, strict=True):
        cells = [f"{value:>11.4g}" for value in row]
        show(f"{torque:>6.4g} N m{''.join(cells)}")


def _print_law(law: FittedLaw) -> None:
    line = (
        f"{law.form:<12} {law.text} h, off by at most {law.largest_error:.1%}; "
        f"{law.torque[0]:.4g} .. {law.torque[1]:.4g} N m, "
        f"{law.speed[0]:.4g} .. {law.speed[1]:.4g} rad/s"
    )
    if law.no_life_from is not None:
        line += f"; no life from {law.no_life_from:.4g} N m on"
    show(line)
