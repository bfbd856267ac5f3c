"""Figure of root stress: over the mesh, and the tooth with its critical section."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gensig.commands.figures.style import (
    FAULTY,
    GREY,
    SMALL,
    SOUND,
    THIRD,
    curve,
    panels,
    save,
    titles,
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


def plot_root_stress(
    system: RootStrength, gears: dict[str, GearStress], history: RootHistory, path: Path
) -> None:
    """Draw root stress of both gears over the mesh, and the tooth of the decisive gear."""
    figure, axes = panels(1, 2, 11, 4.8)
    _stress(axes[0, 0], system, gears, history)
    _tooth(axes[0, 1], system, gears[system.decisive])
    pair = system.pair
    helix = abs(math.degrees(pair.pinion.helix_angle))
    figure.suptitle(
        f"{pair.pinion.n_teeth}/{pair.wheel.n_teeth} teeth, helix {helix:g} deg, "
        f"{system.flanks.torque:.5g} N m, "
        f"tangential force {system.tangential_force:.5g} N"
    )
    save(figure, path)


def _stress(
    axes: Any, system: RootStrength, gears: dict[str, GearStress], history: RootHistory
) -> None:
    """Stress of both gears, that of ISO 6336-3, and the load share of the pair."""
    roll = np.degrees(history.roll / system.pair.pinion.base_radius)
    highest = 0.0
    for (name, values), color in zip(
        history.stress.items(), (SOUND, FAULTY), strict=True
    ):
        iso = gears[name].stress * 1e-6
        curve(axes, roll, values * 1e-6, color, f"{name}, through the mesh")
        look = {"color": color, "linestyle": "--", "linewidth": 1.0}
        axes.axhline(iso, label=f"{name}, ISO 6336-3", **look)
        highest = max(highest, values.max(), gears[name].stress)
    abscissa = "roll of the pinion since contact begins, deg"
    titles(axes, "Root stress of one tooth pair", abscissa, "MPa")
    axes.set_ylim(0.0, 1.45e-6 * highest)  # room for the legend
    share = axes.twinx()
    label = "load share of the pair"
    curve(share, roll, history.share, GREY, label, style=":")
    share.set(ylabel="share of the load", ylim=(0.0, 1.45))
    lines = [*axes.get_lines(), *share.get_lines()]
    axes.legend(handles=lines, loc="upper center", ncols=2, fontsize=SMALL)


def _tooth(axes: Any, system: RootStrength, stress: GearStress) -> None:
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
    for side, label in ((-1.0, None), (1.0, "tangents at 30 deg")):
        curve(axes, side * x, y, "black", width=1.5)
        tangent = [height - 0.25 * reach, height + reach]
        curve(axes, [side * half * 1.25, 0.0], tangent, THIRD, label, width=1.0)
    label = f"critical section, {2.0 * half:.3g} mm"
    curve(axes, [-half, half], [height, height], FAULTY, label)
    load_height = 0.0
    if system.strength.load_point != "tip":
        pitch = math.pi * real.normal_module * math.cos(real.pressure_angle)
        load_height = pitch * (normal_contact_ratio(system.pair) - 1.0)
    loading = root_loading(real, load_height, allow_extrapolation=True)
    top = height + float(loading.lever_arm[0]) * 1e3
    slope = math.tan(float(loading.load_angle[0]))
    axes.annotate(
        "",
        xy=(0.0, top),
        xytext=(1.6 * half, top + 1.6 * half * slope),
        arrowprops={"arrowstyle": "->", "color": SOUND, "linewidth": 1.8},
    )
    label = f"lever arm, {top - height:.3g} mm"
    curve(axes, [0.0, 0.0], [height, top], GREY, label, style="--")
    factors, safety = stress.factors, stress.safety
    title = (
        f"Tooth of the {system.decisive}: Y_F {factors.form_factor:.3f}, "
        f"Y_S {factors.stress_correction_factor:.3f}\n"
        f"safety {safety.paper:.2f} (paper), {safety.iso:.2f} (ISO 6336-3)"
    )
    titles(axes, title, "mm", "mm above the root", aspect="equal")
    axes.legend(loc="lower center", fontsize=SMALL)


def _spur(gear: Gear) -> Gear:
    """The spur gear with the tooth form of the normal section.

    Its number of teeth is the nearest whole one.
    """
    n_teeth = round(virtual_gear(gear).n_teeth)
    bore = 0.1 * gear.normal_module
    return replace(gear, n_teeth=n_teeth, helix_angle=0.0, bore_radius=bore)
