"""Figures of the paper on the timing gears of a marine diesel."""

from __future__ import annotations

import math
from functools import cache, partial

import numpy as np

from gensig.driveline.engine_dampers import (
    DynamicRootStress,
    mesh_between,
    read_mesh_strength,
)
from gensig.driveline.engine_line import read_engine_line
from gensig.driveline.excitation.cycle_statistics import (
    fluctuations,
    order_amplitudes,
)
from gensig.driveline.in_time import (
    TimeResponse,
    read_tooth_law,
    tabulated_meshes,
    time_response,
)
from gensig.driveline.linear.forced import Waterfall, run_of_speeds
from gensig.driveline.time_root_stress import root_stress_in_time
from gensig.options.compose import compose
from gensig.papers.paper_figure import (
    Array,
    Curve,
    Panel,
    Paper,
    PaperFigure,
    printed_level,
)
from gensig.units import from_si, to_si

ENGINE = ("system=engine_gear_train", "system.lateral=true")
FIRING_ORDERS = {
    "least couples": "excitation=engine_v20",
    "in sequence": "excitation=engine_v20_in_sequence",
}
NODES = {"flywheel": 14, "pump gear": 45}
# half the peak to peak of the speed in r/min, computed and measured by the paper
PRINTED = {"flywheel": (15.0, 20.0), "pump gear": (120.0, 125.0)}
PUMP_DRIVE = 21, 45
# root stress in MPa without and with dampers
PRINTED_STRESS = {False: 349.39, True: 292.88}
# the best ones of the linear search: docs/theory/engine.md
DAMPERS = (
    "system.dampers=[{node:21,ring_inertia_kg_m2:0.01539,damping_nms_per_rad:6.161,"
    "stiffness_nm_per_rad:245900},{node:45,ring_inertia_kg_m2:0.01138,"
    "damping_nms_per_rad:4.763,stiffness_nm_per_rad:143100}]"
)
# natural frequencies in Hz that the paper measured by its waterfalls (table 1)
MEASURED_MODES = (28.7, 69.9, 169.4)
RUN_STEP = to_si("speed_rpm", 10.0)
RUN_ORDERS = 24
RUN_SHOWN = (1.0, 2.5, 5.0, 7.5, 10.0)  # orders of the crank
RUN_HIGHEST = 200.0  # Hz
DURATION = 1.0  # s, 14 cycles at 1688 r/min
SHOWN = 2  # cycles
CYCLES = np.array([0.0, SHOWN])
N_ORDERS = 80  # half orders
RPM = from_si("speed_rpm", 1.0)
ASSUMED = (
    "Sizes, pressures, firing order, backlash, damping and supports are not printed; all are "
    "assumed, none is fitted. The drive rattles and is chaotic: numbers scatter by some per cent."
)


def response(firing_order: str) -> TimeResponse:
    """The engine at the point where its gear broke, teeth free to part, gears on supports."""
    return _motion((*ENGINE, FIRING_ORDERS[firing_order]))


@cache
def _motion(words: tuple[str, ...]) -> TimeResponse:
    config = compose("generate", words)
    line = read_engine_line(config)
    point = line.engine.reference
    return time_response(
        line,
        point.speed,
        point.torque,
        teeth=tabulated_meshes(line, read_tooth_law(config), point.speed, point.torque),
        nodes=tuple(NODES.values()),
        duration=DURATION,
    )


def speed(number: str, place: str) -> PaperFigure:
    """Figures 10 and 11: speed of flywheel and pump gear less its mean, over two cycles."""
    curves, found = [], []
    for name in FIRING_ORDERS:
        motion = response(name)
        own = RPM * motion.speed[list(NODES).index(place)]
        cycles = (motion.crank_angle - motion.crank_angle[0]) / (4.0 * math.pi)
        shown = cycles < SHOWN
        curves.append(Curve(name, cycles[shown], own[shown]))
        half = float(np.median(fluctuations(own[None], motion.crank_angle)))
        found.append(f"{name} {half:.3g} r/min")
    for label, half in zip(("computed", "measured"), PRINTED[place], strict=True):
        for end, sign in (("highest", 1.0), ("lowest", -1.0)):
            curves.append(
                printed_level(f"printed, {label}, {end}", sign * half, CYCLES)
            )
    computed, measured = PRINTED[place]
    panel = Panel(place, "cycles of the engine", "speed less its mean, r/min", curves)
    return PaperFigure(
        f"Speed of the {place} (figure {number})",
        [panel],
        f"Half the peak to peak in a cycle: {', '.join(found)}; printed {computed:g}, "
        f"measured {measured:g}. {ASSUMED}",
    )


def spectrum(number: str, place: str) -> PaperFigure:
    """Figures 12 and 13: angular displacement of flywheel and pump gear by orders."""
    curves = []
    for name in FIRING_ORDERS:
        motion = response(name)
        amplitudes = order_amplitudes(motion.angle, motion.crank_angle, N_ORDERS)
        own: Array = np.degrees(amplitudes[list(NODES).index(place)])
        orders: Array = 0.5 * np.arange(1.0, len(own) + 1.0)
        curves.append(Curve(name, orders, own))
    panel = Panel(place, "order of the crank", "angle, degrees", curves)
    return PaperFigure(
        f"Angular displacement of the {place} (figure {number})",
        [panel],
        f"The scale of the figure is not printed. {ASSUMED}",
    )


@cache
def _run() -> dict[str, Waterfall]:
    """Steady vibration without load over the speeds of the paper's run, by place."""
    line = read_engine_line(compose("generate", ENGINE))
    campbell, numbers = line.drive.campbell, line.drive.numbers
    speeds = np.arange(
        campbell.low_speed, campbell.high_speed + 0.5 * RUN_STEP, RUN_STEP
    )
    runs = run_of_speeds(
        line.linear()[0],
        lambda speed: line.on_line(line.torques(speed, 0.0)),
        speeds,
        [numbers.index(node) for node in NODES.values()],
        n_orders=RUN_ORDERS,
    )
    return dict(zip(NODES, runs, strict=True))


def waterfall(number: str, place: str) -> PaperFigure:
    """Figures 8 and 9: angle of flywheel and pump gear in a slow run of speeds, by frequency.

    The paper shows a map over speed and frequency, whose colours peak at natural frequencies.
    Here every order of the map is a curve over its frequency.
    """
    run = _run()[place]
    curves = []
    for order in RUN_SHOWN:
        column = int(np.flatnonzero(run.orders == order)[0])
        frequency: Array = order * run.speeds / (2.0 * math.pi)
        angle: Array = np.log10(np.degrees(run.angle[:, column]))
        is_shown = frequency <= RUN_HIGHEST
        curves.append(Curve(f"order {order:g}", frequency[is_shown], angle[is_shown]))
    ends = [f(curve.y) for f in (np.min, np.max) for curve in curves]
    for mode, frequency_hz in enumerate(MEASURED_MODES, start=1):
        curves.append(
            Curve(
                f"measured, mode {mode}",
                np.full(2, frequency_hz),
                np.array([min(ends), max(ends)]),
                is_printed=True,
            )
        )
    panel = Panel(
        place, "frequency of the order, Hz", "angle in degrees, log10", curves
    )
    return PaperFigure(
        f"Waterfall of the {place}'s angle by orders (figure {number})",
        [panel],
        "The paper's map is measured and its colours have no scale; the natural "
        "frequencies that it reads off are in table 1. Ours is steady at each speed, without "
        "load, teeth always in contact. Modes 2 and 3 lie 2 and 5 % lower: table A1 does not "
        "give table 1 (docs/validation/engine.md).",
    )


@cache
def _strained(with_dampers: bool) -> DynamicRootStress:
    """Root stress of the pump drive, without and with sprung dampers on both gears."""
    words: tuple[str, ...] = (*ENGINE, FIRING_ORDERS["least couples"])
    if with_dampers:
        words = *words, DAMPERS
    config = compose("generate", words)
    line = read_engine_line(config)
    place = mesh_between(line, PUMP_DRIVE)
    strength = read_mesh_strength(config, line, place)
    return root_stress_in_time(strength, line, place, _motion(words))


def root_stress(number: str) -> PaperFigure:
    """Figures 14 and 16: root stress of the pump gear through the mesh, pair by pair."""
    with_dampers = number == "16"
    found = _strained(with_dampers)
    gear = found.strength.decisive
    passes, roll = found.passes[gear] * 1e-6, found.history.roll * 1e3
    iso = found.gears[gear].stress * 1e-6
    ends = np.array([roll[0], roll[-1]])
    curves = [
        Curve("largest of all pairs", roll, passes.max(axis=0)),
        Curve("median of all pairs", roll, np.median(passes, axis=0)),
        Curve("one pair, ISO 6336-3", ends, np.full(2, iso)),
        printed_level("printed", PRINTED_STRESS[with_dampers], roll),
    ]
    title = "with sprung dampers" if with_dampers else "without dampers"
    panel = Panel(title, "roll of the pair, mm", "root stress, MPa", curves)
    return PaperFigure(
        f"Root stress of the pump gear (figure {number})",
        [panel],
        "Impacts of teeth that part and come back carry twice the printed force; pairs "
        f"that share it bring the stress near the printed one. {ASSUMED}",
    )


PAPER = Paper(
    title="Bending-torsional coupling of the timing gears of a marine diesel",
    figures={
        "8": partial(waterfall, "8", "flywheel"),
        "9": partial(waterfall, "9", "pump gear"),
        "10": partial(speed, "10", "flywheel"),
        "11": partial(speed, "11", "pump gear"),
        "12": partial(spectrum, "12", "flywheel"),
        "13": partial(spectrum, "13", "pump gear"),
        "14": partial(root_stress, "14"),
        "16": partial(root_stress, "16"),
    },
)
