"""Figures of the paper on helical mesh stiffness with temperature."""

from __future__ import annotations

import math
from functools import cache, partial

import numpy as np

from gensig.options.compose import compose
from gensig.papers.paper_figure import (
    Curve,
    Panel,
    Paper,
    PaperFigure,
    printed_level,
)
from gensig.systems.hot_pair import (
    COLD,
    SOFTENED,
    TRUE,
    Duty,
    Variant,
    hot_state,
    stiffness_variants,
    sweep,
)
from gensig.systems.hot_pair import PAPER as BY_EQUATIONS
from gensig.systems.registry import PairParts

PAIR = ("system=helical_pair", "gear=chongqing_40_162", "heat=chongqing_rated")
# the paper's: table 1, independent slices with linear contact, gears and housing alike
PRINTED = (
    *PAIR,
    "material.youngs_modulus_gpa=210",
    "mesh.law=paper",
    "mesh.pair_coupling=sum",
    "mesh.contact=linear",
    "mesh.slice_coupling=independent",
    "mesh.allow_extrapolation=true",
    "mesh.n_slices=84",
    "gear.cutter_tip_radius_coefficient=0.02",
    "heat.center_distance=false",
    "heat.softening=false",
)
CONVENTIONS = {
    "the paper's conventions": (*PRINTED, "mesh.heat_law=paper"),
    "gensig's default": PAIR,
}
SHOWN = {
    COLD: "cold",
    TRUE: "hot",
    BY_EQUATIONS: "hot by its equations",
    SOFTENED: "hot, with its softer steel",
}
N_POINTS = 5
STIFFNESS = "stiffness, 1e9 N/m"
FIRST_SLICE = "position of the first slice, base pitches"
# range of each sweep, printed means at its ends in 1e9 N/m, axis label, and what makes it of SI
SWEEPS = {
    "friction": ((0.03, 0.07), (3.858, 4.311), "friction coefficient", 1.0),
    "torque": ((12e3, 36e3), (3.586, 4.454), "torque, kN m", 1e-3),
    "speed": (
        (1200 * math.pi / 30, 6000 * math.pi / 30),
        (4.118, 4.554),
        "speed, r/min",
        30 / math.pi,
    ),
}
STEEPER = (
    "A body that grows as a whole keeps its angles, and with them its stiffness per width: true "
    "stiffness rises by the width alone, 0.1 % in 100 K. Eqs. (10) to (12) and (15) let angles "
    "grow less than once; if they grew twice, it were 0.15 % more in 100 K. No equation of the "
    "paper has the load in it but through heat."
)


@cache
def duty(convention: str) -> Duty:
    """The paper's second pair at work."""
    return PairParts(compose("generate", CONVENTIONS[convention])).duty


def stiffness() -> PaperFigure:
    """Figure 3: single pair and mesh, cold and hot; the printed numbers are highest and mean."""
    pair: list[Curve] = []
    mesh: list[Curve] = []
    for convention in CONVENTIONS:
        at_work = duty(convention)
        variants = stiffness_variants(at_work, hot_state(at_work))
        for name, shown in SHOWN.items():
            if name in variants:
                _add_stiffness(f"{convention}, {shown}", variants[name], pair, mesh)
    for label, highest, mean in (
        ("printed, cold", 2.592, 3.726),
        ("printed, hot", 2.878, 4.117),
    ):
        pair.append(printed_level(f"{label}: highest", highest, pair[0].x))
        mesh.append(printed_level(f"{label}: mean", mean, mesh[0].x))
    return PaperFigure(
        "Mesh stiffness with and without heat (figure 3)",
        (
            Panel("one pair", FIRST_SLICE, STIFFNESS, pair),
            Panel("mesh", "mesh periods", STIFFNESS, mesh),
        ),
        STEEPER,
    )


def _add_stiffness(
    label: str, variant: Variant, pair: list[Curve], mesh: list[Curve]
) -> None:
    pair.append(Curve(label, variant.position, variant.single / 1e9))
    periods = np.arange(len(variant.mesh)) / len(variant.mesh)
    mesh.append(Curve(label, periods, variant.mesh / 1e9))


def bulk() -> PaperFigure:
    """Figure 4: bulk temperature of both gears from the bore to the root circle."""
    state = hot_state(duty("gensig's default"))
    curves = tuple(
        Curve(name, body.radius * 1e3, body.temperature)
        for name, body in (("pinion", state.pinion), ("wheel", state.wheel))
    )
    panel = Panel(
        "bulk temperature", "radius, mm", "temperature, degrees Celsius", curves
    )
    return PaperFigure(
        "Bulk temperature (figure 4)",
        [panel],
        "The scale of the figure, the oil and its convection are not printed; oil of 60 "
        "degrees Celsius and 300 W/m2K are assumed.",
    )


def swept(number: str, name: str) -> PaperFigure:
    """Figures 7 to 9: mean hot stiffness over friction, torque or speed."""
    (low, high), printed, x_label, per_si = SWEEPS[name]
    values = np.linspace(low, high, N_POINTS)
    curves, changes = [], []
    for convention in CONVENTIONS:
        variants = sweep(duty(convention), name, values.tolist())
        for variant, label in (
            (TRUE, convention),
            (BY_EQUATIONS, f"{convention}, hot by its equations"),
        ):
            if variant in variants[0]:
                mean = np.array([one[variant].mesh.mean() for one in variants]) / 1e9
                curves.append(Curve(label, values * per_si, mean))
                change = 100 * (mean[-1] / mean[0] - 1)
                changes.append(f"{label} {change:+.2g} %")
    change = 100 * (printed[1] / printed[0] - 1)
    ends = np.array([low, high]) * per_si
    curves.append(Curve("printed", ends, np.array(printed), is_printed=True))
    panel = Panel("mesh, mean, hot", x_label, STIFFNESS, curves)
    return PaperFigure(
        f"Mesh stiffness over {name} (figure {number})",
        [panel],
        f"From the first to the last: {', '.join(changes)}, printed {change:+.3g} %. "
        f"{STEEPER}",
    )


PAPER = Paper(
    title="Time-varying mesh stiffness of helical gears with temperature",
    figures={
        "3": stiffness,
        "4": bulk,
        **{
            number: partial(swept, number, name)
            for number, name in zip("789", SWEEPS, strict=True)
        },
    },
)
