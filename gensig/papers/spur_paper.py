"""Figures of the paper on spur gears with several faults and the root transition curve."""

from __future__ import annotations

from functools import partial

import numpy as np

from gensig.faults.registry import read_faults
from gensig.options.compose import compose
from gensig.papers.paper_figure import Array, Curve, Panel, Paper, PaperFigure
from gensig.signals.spectrum import amplitude_spectrum
from gensig.systems.base import Machine
from gensig.systems.registry import read_system

CONVENTIONS = {
    "the paper's equations": ("experiment=paper",),
    "gensig's default": ("quality.iso1328_grade=null", "sensing.snr_db=null"),
}
RIG = ("operating.speed_rpm=1800", "operating.torque_nm=20")
TURN = 1.0 / 30.0  # s, of the pinion
SHOWN_TURNS, SHOWN_PITCHES = 3, 5
HIGHEST_HZ = 12000.0
# fault of figures 8, 11 and 14 by the sizes that the paper prints
FAULTS = {
    "8": (
        "crack of 1 mm",
        ("fault=crack", "fault.crack_depth_mm=1", "fault.crack_start=arc_mid"),
    ),
    "11": ("pit of 1 x 10 x 0.5 mm", ("fault=pitting", "fault.pit_width_mm=10")),
    "14": ("missing tooth", ("fault=missing_tooth",)),
}
ASSUMED = (
    "The paper prints neither torque nor damping, friction or bores: 20 N m, 0.07, 0.05, 9 and "
    "15 mm are assumed, so that levels are not compared. No scale of its figures is printed."
)
SEEN = {
    "8": "The crack takes 4 to 7 % of one pair's stiffness. The turn's loudest tooth is 3 to 6 % "
    "louder than the others: no impact is seen in the signal, only in what is left without mesh "
    "harmonics.",
    "11": "The pit is hardly seen in the signal, as the paper says.",
    "14": "By the paper's equations the spring that switches on after the gap injects energy: "
    "peaks of 1e5 m/s2. With gaps in contact the neighbours carry, and the peak is 2e3 to 3e3.",
}


def stiffness() -> PaperFigure:
    """Figure 5: mesh stiffness of healthy gears, and without a tooth."""
    sound: list[Curve] = []
    missing: list[Curve] = []
    for name, words in CONVENTIONS.items():
        system = read_system(compose("generate", (*words, *RIG)))
        faults = read_faults(compose("generate", ("fault=missing_tooth",))["fault"])
        pitches = system.pair.pinion.n_teeth / (2.0 * np.pi)
        for curves, applied in ((sound, ()), (missing, faults)):
            found = system.stiffness_curves(applied)
            roll = found.roll_angle * pitches
            shown = roll < SHOWN_PITCHES
            stiff = found.mesh_stiffness[shown] / 1e8
            curves.append(Curve(name, roll[shown], stiff))
    panels = tuple(
        Panel(title, "roll, base pitches", "mesh stiffness, 1e8 N/m", curves)
        for title, curves in (("healthy", sound), ("missing tooth", missing))
    )
    return PaperFigure(
        "Mesh stiffness (figure 5)",
        panels,
        "The paper adds both pairs, whose bodies it counts twice; pairs that share the "
        "gear bodies are softer together. " + ASSUMED,
    )


def response(number: str) -> PaperFigure:
    """Figures 8, 11 and 14: acceleration of the pinion's bearing in time and its spectrum."""
    title, fault = FAULTS[number]
    times, spectra = [], []
    for name, words in CONVENTIONS.items():
        config = compose("generate", (*words, *RIG, *fault))
        system: Machine = read_system(config)
        record = system.simulate(tuple(read_faults(config["fault"])))
        channel = list(system.sensing.channels).index("pinion_y")
        signal, rate = record.acceleration[channel], system.sensing.sampling_rate
        shown = signal[: int(SHOWN_TURNS * TURN * rate)]
        times.append(Curve(name, np.arange(len(shown)) / rate, shown))
        spectra.append(_spectrum(name, signal, rate))
    label = "pinion_y, m/s2"
    panels = (
        Panel("time", "time, s", label, times),
        Panel("spectrum", "frequency, Hz", label, spectra),
    )
    return PaperFigure(
        f"Response to a {title} (figure {number})",
        panels,
        f"{SEEN[number]} {ASSUMED}",
    )


def _spectrum(name: str, signal: Array, rate: float) -> Curve:
    frequency, amplitude = amplitude_spectrum(signal, rate)
    below = frequency < HIGHEST_HZ
    x, y = (np.asarray(each[below], np.float64) for each in (frequency, amplitude))
    return Curve(name, x, y)


PAPER = Paper(
    title="Multi-fault dynamics of spur gears considering the root transition curve",
    figures={
        "5": stiffness,
        **{number: partial(response, number) for number in FAULTS},
    },
)
