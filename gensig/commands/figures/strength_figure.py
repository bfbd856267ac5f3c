"""Figure of root stress: over the mesh, and the tooth with its critical section."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gensig.commands.figures.machine_figures import (
    FAULTY,
    GREY,
    SOUND,
    THIRD,
    pyplot,
    save,
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
    """Root stress of both gears over the mesh, the load share of the pair, and the tooth of the
    decisive gear.
    """
    figure, axes = pyplot.subplots(1, 2, figsize=(11, 4.8), layout="constrained")
    _stress(axes[0], system, gears, history)
    _tooth(axes[1], system, gears[system.decisive])
    pair = system.pair
    figure.suptitle(
        f"{pair.pinion.n_teeth}/{pair.wheel.n_teeth} teeth, helix {abs(math.degrees(pair.pinion.helix_angle)):g} deg, "
        f"{system.flanks.torque:.5g} N m, tangential force {system.tangential_force:.5g} N"
    )
    save(figure, path)


def _stress(
    axis: Any, system: RootStrength, gears: dict[str, GearStress], history: RootHistory
) -> None:
    roll = np.degrees(history.roll / system.pair.pinion.base_radius)
    for (name, values), colour in zip(
        history.stress.items(), (SOUND, FAULTY), strict=True
    ):
        axis.plot(roll, values * 1e-6, color=colour, label=f"{name}, through the mesh")
        axis.axhline(
            gears[name].stress * 1e-6,
            color=colour,
            linestyle="--",
            linewidth=1.0,
            label=f"{name}, ISO 6336-3",
        )
    axis.set(
        title="Root stress of one tooth pair",
        xlabel="roll of the pinion since contact begins, deg",
        ylabel="MPa",
    )
    highest = max(
        max(values.max() for values in history.stress.values()),
        max(one.stress for one in gears.values()),
    )
    axis.set_ylim(0.0, 1.45e-6 * highest)  # room for the legend
    share = axis.twinx()
    share.plot(
        roll, history.share, color=GREY, linestyle=":", label="load share of the pair"
    )
    share.set(ylabel="share of the load", ylim=(0.0, 1.45))
    lines = [line for side in (axis, share) for line in side.get_lines()]
    axis.legend(
        lines,
        [line.get_label() for line in lines],
        loc="upper center",
        ncols=2,
        fontsize=8,
    )


def _tooth(axis: Any, system: RootStrength, found: GearStress) -> None:
    """Outline in the normal section with the 30 degree tangents, mm from the centreline and above
    the root circle.
    """
    real = system.pair.gears[system.decisive]
    virtual, section = virtual_gear(real), root_section(real)
    floor = virtual.tip_radius - (real.tip_radius - real.root_radius)
    outline = tooth_profile(_spur(real))
    scale = outline.abscissa[0] - floor  # the drawn tooth has a whole number of teeth
    y, x = (outline.abscissa - scale - floor) * 1e3, outline.half_thickness * 1e3
    for side in (-1.0, 1.0):
        axis.plot(side * x, y, color="black", linewidth=1.5)
    half, height = 0.5e3 * section.thickness, (section.height - floor) * 1e3
    axis.plot(
        [-half, half],
        [height, height],
        color=FAULTY,
        label=f"critical section, {2.0 * half:.3g} mm",
    )
    reach = half / math.tan(TANGENT)
    for side in (-1.0, 1.0):
        axis.plot(
            [side * half * 1.25, 0.0], [height - 0.25 * reach, height + reach], color=THIRD, linewidth=1.0,
            label="tangents at 30 deg" if side > 0.0 else None,
        )  # fmt: skip
    at_tip = system.strength.load_point == "tip"
    pitch = math.pi * real.normal_module * math.cos(real.pressure_angle)
    loading = root_loading(
        real,
        0.0 if at_tip else pitch * (normal_contact_ratio(system.pair) - 1.0),
        allow_extrapolation=True,
    )
    top, slope = (
        height + float(loading.lever_arm[0]) * 1e3,
        math.tan(float(loading.load_angle[0])),
    )
    axis.annotate(
        "", xy=(0.0, top), xytext=(1.6 * half, top + 1.6 * half * slope),
        arrowprops={"arrowstyle": "->", "color": SOUND, "linewidth": 1.8},
    )  # fmt: skip
    axis.plot(
        [0.0, 0.0],
        [height, top],
        color=GREY,
        linestyle="--",
        label=f"lever arm, {top - height:.3g} mm",
    )
    axis.set(
        title=f"Tooth of the {system.decisive}: Y_F {found.factors.form_factor:.3f}, Y_S "
        f"{found.factors.stress_correction_factor:.3f}\nsafety {found.safety.paper:.2f} (paper), "
        f"{found.safety.iso:.2f} (ISO 6336-3)",
        xlabel="mm", ylabel="mm above the root", aspect="equal",
    )  # fmt: skip
    axis.legend(loc="lower center", fontsize=8)


def _spur(gear: Gear) -> Gear:
    """The spur gear with, to the nearest whole number of teeth, the tooth form of the normal
    section.
    """
    n_teeth = round(virtual_gear(gear).n_teeth)
    return replace(
        gear, n_teeth=n_teeth, helix_angle=0.0, bore_radius=0.1 * gear.normal_module
    )
