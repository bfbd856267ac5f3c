"""Figure of hot gears: bulk temperature, flash temperature, stiffness effect by effect."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gensig.commands.figures.machine_figures import COLOURS, GREY, pyplot, save
from gensig.commands.gears.heat_report import NAMES, HeatReport
from gensig.systems.hot_pair import APPARENT, COLD

ABOVE = 1.25  # apparent stiffness beyond this multiple of the others' largest is named, not drawn


def plot_heat(report: HeatReport, path: Path) -> None:
    """Bulk field, flash temperature along the path, one pair and the mesh with every effect."""
    figure, axes = pyplot.subplots(2, 2, figsize=(11, 7.6), layout="constrained")
    _bulk(axes[0, 0], report)
    _flash(axes[0, 1], report)
    drawn = {name: one for name, one in report.variants.items() if name != APPARENT}
    top = ABOVE * max(float(one.mesh.max()) for one in drawn.values())
    if APPARENT in report.variants and report.variants[APPARENT].mesh.max() < top:
        drawn = report.variants
    for colour, (name, one) in zip((GREY, *COLOURS), drawn.items(), strict=False):
        style: dict[str, Any] = {
            "color": colour,
            "label": NAMES[name],
            "linestyle": "--" if name == COLD else "-",
        }
        axes[1, 0].plot(one.position, one.single / 1e9, **style)
        phase = np.arange(2 * len(one.mesh)) / len(one.mesh)
        axes[1, 1].plot(phase, np.tile(one.mesh, 2) / 1e9, **style)
    axes[1, 0].set(
        title="One pair, slices on the path",
        xlabel="position of the first slice, base pitches",
        ylabel="stiffness, 10$^9$ N/m",
    )
    left_out = set(report.variants) - set(drawn)
    beyond = (
        f" (apparent, mean {report.variants[APPARENT].mesh.mean() / 1e9:.3g}: beyond)"
        if left_out
        else ""
    )
    axes[1, 1].set(
        title=f"Mesh{beyond}", xlabel="mesh periods", ylabel="stiffness, 10$^9$ N/m"
    )
    axes[1, 0].legend(loc="lower center")
    duty = report.duty
    figure.suptitle(
        f"{duty.system.torque / 1e3:.4g} kN m at {duty.speed * 30.0 / np.pi:.4g} r/min, friction {duty.friction:g}: "
        f"{report.state.friction_heat / 1e3:.3g} kW of friction heat"
    )
    save(figure, path)


def _bulk(axes: Any, report: HeatReport) -> None:
    state, heat = report.state, report.duty.heat
    for colour, (name, body) in zip(
        COLOURS, (("pinion", state.pinion), ("wheel", state.wheel)), strict=False
    ):
        share = (body.radius - body.radius[0]) / (body.radius[-1] - body.radius[0])
        label = f"{name}, bore radius {body.radius[0] * 1e3:.4g}, root {body.radius[-1] * 1e3:.4g} mm"
        axes.plot(share, body.temperature, color=colour, label=label)
    for value, style, name in (
        (heat.oil_temperature, ":", "oil"),
        (heat.housing_temperature, "--", "housing"),
    ):
        axes.axhline(value, color=GREY, linestyle=style, label=name)
    axes.set(
        title="Bulk temperature; the teeth have that of the root",
        xlabel="share of the way from the bore to the root circle",
        ylabel="degrees Celsius",
    )
    axes.legend(fontsize="small")


def _flash(axes: Any, report: HeatReport) -> None:
    pair, state = report.duty.system.pair, report.state
    axes.plot(state.flash_position / pair.base_pitch, state.flash, color=COLOURS[0])
    axes.axvline(
        pair.pitch_point / pair.base_pitch,
        color=GREY,
        linestyle=":",
        label="pitch point",
    )
    axes.set(
        title="Flash temperature under the slices' own loads",
        xlabel="contact position from the start of contact, base pitches",
        ylabel="K above the teeth",
    )
    axes.set_ylim(bottom=0.0)
    axes.legend()
