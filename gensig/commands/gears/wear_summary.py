"""Summary of ``gensig wear-life`` on the terminal."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from gensig.life.life_laws import FittedLaw, LifeMap
from gensig.life.options import SIDES


def wear_lines(
    content: Mapping[str, Any], lives: LifeMap | None, laws: tuple[FittedLaw, ...]
) -> Iterator[str]:
    """Lines on the life, the values at both ends of the path, the map and its laws."""

    def ends(key: str) -> str:
        values = content[key]
        return f"{values[0]:.4g} .. {values[-1]:.4g}"

    rule, sharing, geometry = content["rule"], content["sharing"], content["geometry"]
    life, turns = content["life_hours"], content["life_turns"]
    deepest = content["deepest"]
    yield f"rule                       {rule}, sharing {sharing}, geometry {geometry}"
    yield f"contact ratio              {content['transverse_contact_ratio']:.4f}"
    yield f"pressure angle, A to E     {ends('pressure_angle_deg')} deg on the pinion"
    sliding = ends("sliding_velocity_mm_per_s")
    yield f"sliding, A to E            {sliding} mm/s, 0 at the pitch point"
    yield f"contact pressure, A to E   {ends('contact_pressure_mpa')} MPa, new flanks"
    for name in SIDES:
        wear = ends(f"{name}_wear_per_mesh_nm")
        yield f"{name:<6} wear, A to E       {wear} nm a mesh, new flanks"
    yield f"life                       {life:.5g} h, {turns:.5g} turns of the pinion"
    yield (
        f"ended by                   {content['ended_by'].replace('_', ' ')}, "
        f"{content['threshold_um']:.4g} um "
        f"({deepest['gear']}, {deepest['position_mm']:.3f} mm from A)"
    )
    yield from _error_limit(content)
    if "vibration" in content:
        yield _vibration(content["vibration"], content["threshold_um"])
    if content["torque_exponent"] is not None:
        exponent = content["torque_exponent"]
        yield f"local law                  life ~ torque^-{exponent:.3f} speed^-1"
    if lives is not None:
        yield from _map(lives)
    yield from map(_law, laws)


def _error_limit(content: Mapping[str, Any]) -> Iterator[str]:
    """A line on the transmission error beside a limit that did not end the life."""
    limit = content["transmission_error_limit_um"]
    if limit is not None and content["ended_by"] != "transmission_error":
        error = content["history"]["transmission_error_peak_to_peak_um"][-1]
        yield (
            f"transmission error         {error:.4g} um from peak to peak at the end; "
            f"limit of {limit:g} um not reached"
        )


def _vibration(vibration: Mapping[str, Any], threshold_um: float) -> str:
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
    return (
        f"vibration                  {rms[0].max():.4g} m/s2 RMS with new flanks, "
        f"loudest sensor; at the end {rms[end].max():.4g}, up by {rise:.3g} dB at most; "
        f"limit of {limits} {reached}"
    )


def _map(lives: LifeMap) -> Iterator[str]:
    heads = [f"{speed * 30.0 / math.pi:>11.4g}" for speed in lives.speed]
    yield f"{'life, h':<10}{''.join(heads)} r/min"
    for torque, row in zip(lives.torque, lives.hours, strict=True):
        cells = [f"{value:>11.4g}" for value in row]
        yield f"{torque:>6.4g} N m{''.join(cells)}"


def _law(law: FittedLaw) -> str:
    line = (
        f"{law.form:<12} {law.text} h, off by at most {law.largest_error:.1%}; "
        f"{law.torque[0]:.4g} .. {law.torque[1]:.4g} N m, "
        f"{law.speed[0]:.4g} .. {law.speed[1]:.4g} rad/s"
    )
    if law.no_life_from is not None:
        line += f"; no life from {law.no_life_from:.4g} N m on"
    return line
