"""Figure of hot gears: bulk temperature, flash temperature, stiffness effect by effect."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np

from gensig.commands.figures.style import (
    COLORS,
    FIRST_SLICE,
    GREY,
    MESH_PERIODS,
    STIFFNESS,
    curve,
    panels,
    save,
    titles,
)
from gensig.commands.gears.heat_report import NAMES, HeatReport
from gensig.systems.hot_pair import (
    APPARENT,
    COLD,
    PAPER,
    PAPER_COLD,
    PAPER_COLD_SUMS,
    PAPER_HOUSED,
    PAPER_SUMS,
)

ABOVE = 1.25  # highest apparent stiffness that is drawn, over the largest of the others

STYLES = {COLD: "--", PAPER_COLD: ":", PAPER: "-.", PAPER_HOUSED: "-."}
# sums of components lie beside the others by more than heat changes
NOT_DRAWN = (PAPER_SUMS, PAPER_COLD_SUMS)


def plot_heat(report: HeatReport, path: Path) -> None:
    """Draw bulk field, flash temperature, and stiffness of pair and mesh with every effect."""
    figure, axes = panels(2, 2, 11, 7.6)
    (bulk, flash), (pair, mesh) = axes
    _bulk(bulk, report)
    _flash(flash, report)
    title = "Mesh"
    drawn = {
        name: variant
        for name, variant in report.variants.items()
        if name not in NOT_DRAWN
    }
    apparent = drawn.pop(APPARENT, None)
    if apparent is not None:
        top = ABOVE * max(float(variant.mesh.max()) for variant in drawn.values())
        if apparent.mesh.max() < top:
            drawn[APPARENT] = apparent
        else:
            title += f" (apparent, mean {apparent.mesh.mean() / 1e9:.3g}: beyond)"
    colors = itertools.cycle((GREY, *COLORS))
    for color, (name, variant) in zip(colors, drawn.items(), strict=False):
        style = STYLES.get(name, "-")
        single = variant.single / 1e9
        curve(pair, variant.position, single, color, NAMES[name], style=style)
        n_phases = len(variant.mesh)
        periods, twice = np.arange(2 * n_phases) / n_phases, np.tile(variant.mesh, 2)
        curve(mesh, periods, twice / 1e9, color, NAMES[name], style=style)
    titles(pair, "One pair, slices on the path", FIRST_SLICE, STIFFNESS)
    titles(mesh, title, MESH_PERIODS, STIFFNESS)
    pair.legend(loc="lower center")
    duty, rpm = report.duty, report.duty.speed * 30.0 / np.pi
    figure.suptitle(
        f"{duty.system.torque / 1e3:.4g} kN m at {rpm:.4g} r/min, "
        f"friction {duty.friction:g}: "
        f"{report.state.friction_heat / 1e3:.3g} kW of friction heat"
    )
    save(figure, path)


def _bulk(axes: Any, report: HeatReport) -> None:
    state, heat = report.state, report.duty.heat
    bodies = {"pinion": state.pinion, "wheel": state.wheel}
    for color, (name, body) in zip(COLORS, bodies.items(), strict=False):
        bore, root = body.radius[0], body.radius[-1]
        share = (body.radius - bore) / (root - bore)
        label = f"{name}, bore radius {bore * 1e3:.4g}, root {root * 1e3:.4g} mm"
        curve(axes, share, body.temperature, color, label)
    axes.axhline(heat.oil_temperature, color=GREY, linestyle=":", label="oil")
    axes.axhline(heat.housing_temperature, color=GREY, linestyle="--", label="housing")
    titles(
        axes,
        "Bulk temperature; the teeth have that of the root",
        "share of the way from the bore to the root circle",
        "degrees Celsius",
    )
    axes.legend(fontsize="small")


def _flash(axes: Any, report: HeatReport) -> None:
    pair, state = report.duty.system.pair, report.state
    curve(axes, state.flash_position / pair.base_pitch, state.flash, COLORS[0])
    pitch_point = pair.pitch_point / pair.base_pitch
    axes.axvline(pitch_point, color=GREY, linestyle=":", label="pitch point")
    titles(
        axes,
        "Flash temperature under the slices' own loads",
        "contact position from the start of contact, base pitches",
        "K above the teeth",
    )
    axes.set_ylim(bottom=0.0)
    axes.legend()
