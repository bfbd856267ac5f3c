"""Doubts on a new gearbox: values that no pair of steel gears has."""

from __future__ import annotations

from collections.abc import Sequence

from gensig.commands.new.data_sheet import GearOption
from gensig.geometry.contact import SIDES

# MPa; about twice sigma_Flim of case-hardened steel (ISO 6336-5), which a smooth root bears
STRONGEST = 1000.0
LEAST_STRESS = 1.0  # MPa at the root, below which gears do no work
WIDTHS = (1.0, 25.0)  # modules
PITCH_LINE_SPEEDS = (0.05, 60.0)  # m/s
SLOWEST = 30.0  # r/min


def all_doubts(stages: Sequence[GearOption]) -> list[str]:
    """Doubts of all stages, the first driving; those of several name the stage."""
    speed = stages[0].gear["rated_speed_rpm"]
    result = []
    if speed < SLOWEST:
        result.append(
            f"--speed {speed:g}: the pinion turns slower than {SLOWEST:g} r/min; "
            "is it r/min, not Hz?"
        )
    for number, option in enumerate(stages, start=1):
        named = ""
        if len(stages) > 1:
            named = f"stage {number}: "
        result += [f"{named}{message}" for message in doubts(option)]
    return result


def doubts(option: GearOption) -> list[str]:
    """Warnings of values that no pair of steel gears has, or that gensig will not simulate.

    They often mean that another unit was meant.
    """
    values, result = option.derived(), []
    gear = option.gear
    ratio = option.pair.transverse_contact_ratio
    if ratio < 1.0:
        result.append(
            f"the transverse contact ratio {ratio:.3f} is below 1: the drive is "
            "interrupted at every tooth. gensig stiffness takes these gears, records are "
            "refused; use more teeth or another profile shift"
        )
    line_speed, (slow, fast) = values["pitch_line_speed_m_per_s"], PITCH_LINE_SPEEDS
    if line_speed is not None and not slow <= line_speed <= fast:
        result.append(
            f"a pitch line speed of {line_speed:.3g} m/s, outside {slow:g} to {fast:g}; "
            "are --speed in r/min of the pinion and --module in mm?"
        )
    for side in SIDES:
        modules = gear[side]["face_width_mm"] / gear["normal_module_mm"]
        if not WIDTHS[0] <= modules <= WIDTHS[1]:
            result.append(
                f"the {side} is {modules:.3g} modules wide, outside {WIDTHS[0]:g} "
                f"to {WIDTHS[1]:g}; are --widths in mm?"
            )
    stress, torque = values["nominal_root_stress_mpa"], values["wheel_torque_nm"]
    if stress is not None and not LEAST_STRESS <= stress <= STRONGEST:
        reason = "gears that do no work"
        if stress > STRONGEST:
            reason = f"no steel bears more than about {STRONGEST:g}"
        result.append(
            f"a nominal root stress of {stress:.3g} MPa: {reason}; are --torque in N m of "
            f"the pinion (the wheel has {torque:.4g}) and --widths in mm?"
        )
    return result
