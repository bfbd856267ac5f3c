"""Figures of the paper on the wear life of gears."""

from __future__ import annotations

from functools import cache

import numpy as np

from gensig.life.life_laws import life_map
from gensig.life.wear.archard import flank_radii
from gensig.life.wear.wear_case import WearCase
from gensig.life.wear.wear_life import wear_life
from gensig.operation.options import read_operating
from gensig.options.compose import compose
from gensig.papers.paper_figure import Curve, Panel, Paper, PaperFigure
from gensig.systems.wear import read_wear_case

GEARS = ("gear=harbin_38_55",)
# every convention of the paper
PRINTED = (
    *GEARS,
    "wear.sharing=one_pair",
    "wear.geometry=unworn",
    "wear.load_radius=reference",
    "wear.rule=fixed_intervals",
    "wear.criterion=sum",
    "wear.threshold_um=100",
    "wear.n_intervals=20",
)
N_POINTS = 12
TORQUES = np.geomspace(20.0, 250.0, N_POINTS)  # N m, about those of figure 8
SPEEDS = np.geomspace(2.0, 30.0, N_POINTS)  # rad/s, about those of figure 9
FEW_SPEEDS = [2.0, 5.0, 12.5, 30.0]  # rad/s
INNER = 10  # nodes at either end, beyond which nothing wears
PRESSURE_ANGLE = "pressure angle at the pinion, rad"
SHORT = (
    "The transverse contact ratio of table 1 is 0.92 with its addendum of half a module: contact "
    "is interrupted once a pitch."
)
FITS = (
    "The printed fits disagree at the rated point, 34.8 and 74.65 h. By the paper's equations "
    "lives fall with the root of the torque and with the speed. The paper prints no threshold; "
    "100 um is assumed."
)


@cache
def case() -> WearCase:
    """The paper's gears by its conventions."""
    return read_wear_case(compose("generate", PRINTED))


@cache
def _speed() -> float:
    return read_operating(compose("generate", PRINTED).section("operating")).speed


def sliding() -> PaperFigure:
    """Figure 5: sliding speed over the pressure angle."""
    path = case().path
    speed = path.sliding * _speed() * 1e3
    panel = Panel(
        "sliding at the contact",
        PRESSURE_ANGLE,
        "sliding speed, mm/s",
        [Curve("ours", path.pressure_angle[0], speed)],
    )
    return PaperFigure("Sliding speed (figure 5)", [panel], SHORT)


def pressure() -> PaperFigure:
    """Figure 6: contact pressure over the pressure angle."""
    new = case().new_flanks()
    found = case().pressure(case().line_load(new), new).max(axis=0) * 1e-6
    curve = Curve("ours", case().path.pressure_angle[0], found)
    panel = Panel("new flanks", PRESSURE_ANGLE, "pressure, MPa", [curve])
    return PaperFigure("Contact pressure (figure 6)", [panel], SHORT)


def radius() -> PaperFigure:
    """Figure 7: curvature radius of the pinion's flank, new and worn."""
    new = case().new_flanks()
    worn = wear_life(case()).depth[-1][:, 0]
    load = case().line_load(new)[0]
    radii = flank_radii(case().path, worn, load, case().material)
    names = {
        "new": "new",
        "worn by 100 um": "worn",
        "worn, as eq. (22) has it": "by_eq_22",
    }
    inner = slice(INNER, -INNER)
    angle = case().path.pressure_angle[0][inner]
    curves = tuple(
        Curve(label, angle, radii[kind][0][inner] * 1e3)
        for label, kind in names.items()
    )
    panel = Panel("pinion", PRESSURE_ANGLE, "curvature radius, mm", curves)
    return PaperFigure(
        "Curvature radius after wear (figure 7)",
        [panel],
        "Eq. (22) takes half the depth off the radius, a shift and no curvature. The "
        "profile that wear leaves is flatter in places and more curved in others.",
    )


def lives() -> PaperFigure:
    """Figure 10: life over torque and speed."""
    found = life_map(case(), TORQUES.tolist(), FEW_SPEEDS).hours
    curves = tuple(
        Curve(f"{speed:g} rad/s", TORQUES, hours)
        for speed, hours in zip(FEW_SPEEDS, found.T, strict=True)
    )
    panel = Panel(
        "life to 100 um, the paper's conventions", "torque, N m", "life, h", curves
    )
    return PaperFigure("Wear life over torque and speed (figure 10)", [panel], FITS)


def life_over_torque() -> PaperFigure:
    """Figure 8: life over torque beside the printed fit, eq. (25)."""
    speed = _speed()
    lives = life_map(case(), TORQUES.tolist(), [speed, 2.0 * speed]).hours[:, 0]
    printed = -127.3 * np.log(TORQUES) + 709.3
    return _life_figure("torque, N m", TORQUES, lives, "eq. (25)", printed, "8")


def life_over_speed() -> PaperFigure:
    """Figure 9: life over speed beside the printed fit, eq. (26)."""
    torque = case().torque
    lives = life_map(case(), [torque, 2.0 * torque], SPEEDS.tolist()).hours[0]
    printed = 675.68 * np.exp(-0.1753 * SPEEDS)
    return _life_figure("speed, rad/s", SPEEDS, lives, "eq. (26)", printed, "9")


def _life_figure(
    x_label: str,
    x: np.ndarray,
    lives: np.ndarray,
    equation: str,
    printed: np.ndarray,
    number: str,
) -> PaperFigure:
    panel = Panel(
        "life to 100 um",
        x_label,
        "life, h",
        (
            Curve("ours, the paper's conventions", x, lives),
            Curve(f"printed fit, {equation}", x, printed, is_printed=True),
        ),
    )
    return PaperFigure(
        f"Wear life over {x_label.split(',')[0]} (figure {number})", [panel], FITS
    )


PAPER = Paper(
    title="Prediction of the wear life of gears",
    figures={
        "5": sliding,
        "6": pressure,
        "7": radius,
        "8": life_over_torque,
        "9": life_over_speed,
        "10": lives,
    },
)
