"""Figure of hot gears: bulk temperature, flash temperature, stiffness effect by effect."""

from __future__ import annotations

import itertools

import numpy as np

from gensig.commands.figures.panels import (
    COLORS,
    FIRST_SLICE,
    GREY,
    MESH_PERIODS,
    STIFFNESS,
    Figure,
    Panel,
    across,
    curve,
    upright,
)
from gensig.commands.gears.heat_report import NAMES, HeatReport, bodies
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


def heat_figure(report: HeatReport) -> Figure:
    """Bulk field, flash temperature, and stiffness of pair and mesh with every effect."""
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
    pair, mesh = [], []
    for color, (name, variant) in zip(colors, drawn.items(), strict=False):
        look = NAMES[name], color, STYLES.get(name, "-")
        pair.append(curve(variant.position, variant.single / 1e9, *look))
        n_phases = len(variant.mesh)
        periods, twice = np.arange(2 * n_phases) / n_phases, np.tile(variant.mesh, 2)
        mesh.append(curve(periods, twice / 1e9, *look))
    stiffness = [
        Panel(
            "One pair, slices on the path",
            FIRST_SLICE,
            STIFFNESS,
            pair,
            legend="lower center",
        ),
        Panel(title, MESH_PERIODS, STIFFNESS, mesh, legend=None),
    ]
    duty, rpm = report.duty, report.duty.speed * 30.0 / np.pi
    return Figure(
        [[_bulk(report), _flash(report)], stiffness],
        (11, 7.6),
        f"{duty.system.torque / 1e3:.4g} kN m at {rpm:.4g} r/min, "
        f"friction {duty.friction:g}: "
        f"{report.state.friction_heat / 1e3:.3g} kW of friction heat",
    )


def _bulk(report: HeatReport) -> Panel:
    marks, heat = [], report.duty.heat
    for name, body in bodies(report.state).items():
        bore, root = body.radius[0], body.radius[-1]
        share = (body.radius - bore) / (root - bore)
        label = f"{name}, bore radius {bore * 1e3:.4g}, root {root * 1e3:.4g} mm"
        marks.append(curve(share, body.temperature, label))
    marks += [
        across(heat.oil_temperature, linewidth=1.5, linestyle=":", label="oil"),
        across(
            heat.housing_temperature, linewidth=1.5, linestyle="--", label="housing"
        ),
    ]
    return Panel(
        "Bulk temperature; the teeth have that of the root",
        "share of the way from the bore to the root circle",
        "degrees Celsius",
        marks,
    )


def _flash(report: HeatReport) -> Panel:
    pair, state = report.duty.system.pair, report.state
    pitch_point = pair.pitch_point / pair.base_pitch
    return Panel(
        "Flash temperature under the slices' own loads",
        "contact position from the start of contact, base pitches",
        "K above the teeth",
        [
            curve(state.flash_position / pair.base_pitch, state.flash),
            upright(pitch_point, linestyle=":", label="pitch point"),
        ],
        ylim=(0.0, None),
    )
