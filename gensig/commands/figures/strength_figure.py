"""Figure of root stress: over the mesh, and the tooth with its critical section."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from gensig.commands.figures.panels import (
    COLORS,
    FAULTY,
    GREY,
    SOUND,
    THIRD,
    Figure,
    Mark,
    Panel,
    across,
    curve,
)
from gensig.geometry.gear import Gear
from gensig.geometry.tooth_profile import tooth_profile
from gensig.life.root.root_stress import normal_contact_ratio
from gensig.life.root.tooth_root import (
    TANGENT,
    root_loading,
    root_section,
    virtual_gear,
)
from gensig.systems.root_strength import GearStress, RootHistory, RootStrength


def root_stress_figure(
    system: RootStrength, gears: dict[str, GearStress], history: RootHistory
) -> Figure:
    """Root stress of both gears over the mesh, and the tooth of the decisive gear."""
    stress, tooth = _stress(system, gears, history), _tooth(system, gears)
    pair = system.pair
    helix = abs(math.degrees(pair.pinion.helix_angle))
    return Figure(
        [[stress, tooth]],
        (11, 4.8),
        f"{pair.pinion.n_teeth}/{pair.wheel.n_teeth} teeth, helix {helix:g} deg, "
        f"{system.flanks.torque:.5g} N m, "
        f"tangential force {system.tangential_force:.5g} N",
    )


def _stress(
    system: RootStrength, gears: dict[str, GearStress], history: RootHistory
) -> Panel:
    """Stress of both gears, that of ISO 6336-3, and the load share of the pair."""
    roll = np.degrees(history.roll / system.pair.pinion.base_radius)
    highest, marks = 0.0, []
    for (name, values), color in zip(history.stress.items(), COLORS, strict=False):
        iso = gears[name].stress
        look = {"color": color, "linestyle": "--", "linewidth": 1.0}
        marks += [
            curve(roll, values * 1e-6, f"{name}, through the mesh", color),
            across(iso * 1e-6, label=f"{name}, ISO 6336-3", **look),
        ]
        highest = max(highest, values.max(), iso)
    label = "load share of the pair"
    share = curve(roll, history.share, label, GREY, ":")
    return Panel(
        "Root stress of one tooth pair",
        "roll of the pinion since contact begins, deg",
        "MPa",
        marks,
        legend="upper center",
        columns=2,
        ylim=(0.0, 1.45e-6 * highest),  # room for the legend
        second=Panel(
            "", "", "share of the load", [share], legend=None, ylim=(0.0, 1.45)
        ),
    )


def _tooth(system: RootStrength, gears: dict[str, GearStress]) -> Panel:
    """Outline in the normal section with the 30 degree tangents, the load and its lever arm.

    Millimetres from the centerline and above the root circle.
    """
    real = system.pair.gears[system.decisive]
    virtual, section = virtual_gear(real), root_section(real)
    floor = virtual.tip_radius - (real.tip_radius - real.root_radius)
    outline = tooth_profile(_spur(real))
    scale = outline.abscissa[0] - floor  # the drawn tooth has a whole number of teeth
    y, x = (outline.abscissa - scale - floor) * 1e3, outline.half_thickness * 1e3
    half, height = 0.5e3 * section.thickness, (section.height - floor) * 1e3
    reach = half / math.tan(TANGENT)
    label = f"critical section, {2.0 * half:.3g} mm"
    tangent = [height - 0.25 * reach, height + reach]
    marks: list[Mark] = []
    for side, name in ((-1.0, None), (1.0, "tangents at 30 deg")):
        sloped = [side * half * 1.25, 0.0]
        marks += [
            curve(side * x, y, None, "black", width=1.5),
            curve(sloped, tangent, name, THIRD, width=1.0),
        ]
    marks.append(curve([-half, half], [height, height], label, FAULTY))
    load_height = 0.0
    if system.strength.load_point != "tip":
        pitch = math.pi * real.normal_module * math.cos(real.pressure_angle)
        load_height = pitch * (normal_contact_ratio(system.pair) - 1.0)
    loading = root_loading(real, load_height, allow_extrapolation=True)
    top = height + float(loading.lever_arm[0]) * 1e3
    slope = math.tan(float(loading.load_angle[0]))
    ends = {"xy": (0.0, top), "xytext": (1.6 * half, top + 1.6 * half * slope)}
    look = {"arrowstyle": "->", "color": SOUND, "linewidth": 1.8}
    marks.append(Mark("annotate", ("",), {**ends, "arrowprops": look}))
    label = f"lever arm, {top - height:.3g} mm"
    marks.append(curve([0.0, 0.0], [height, top], label, GREY, "--"))
    factors = gears[system.decisive].factors
    safety = gears[system.decisive].safety
    return Panel(
        f"Tooth of the {system.decisive}: Y_F {factors.form_factor:.3f}, "
        f"Y_S {factors.stress_correction_factor:.3f}\n"
        f"safety {safety.paper:.2f} (paper), {safety.iso:.2f} (ISO 6336-3)",
        "mm",
        "mm above the root",
        marks,
        legend="lower center",
        aspect="equal",
    )


def _spur(gear: Gear) -> Gear:
    """The spur gear with the tooth form of the normal section.

    Its number of teeth is the nearest whole one.
    """
    n_teeth = round(virtual_gear(gear).n_teeth)
    bore = 0.1 * gear.normal_module
    return replace(gear, n_teeth=n_teeth, helix_angle=0.0, bore_radius=bore)
