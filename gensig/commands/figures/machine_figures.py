"""Figures of one machine and of one record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Array
from gensig.commands.figures.panels import (
    COLORS,
    FAULTY,
    FREQUENCY,
    GREY,
    SOUND,
    Figure,
    Mark,
    Panel,
    curve,
    upright,
)
from gensig.faults.base import Fault
from gensig.systems.base import Machine
from gensig.systems.stiffness_curves import StiffnessCurves
from gensig.units import SPEED, channel_unit

STIFFNESS = "stiffness, 10$^8$ N/m"
# Shares of the sampling rate, 5 to 19 kHz at 51.2 kHz: above the mesh line, below the highest
# usable frequency, where teeth ring and faults modulate.
ENVELOPE_BAND = (5000.0 / 51200.0, 19000.0 / 51200.0)
USABLE_SHARE = 0.39  # of the sampling rate
PAIRS = ("pair about to enter", "newest pair", "pair before it", "pair before that")

# label, color and signal (sample,) of the records in a figure
Signals: TypeAlias = Sequence[tuple[str | None, str, Array]]


def stiffness_figure(
    system: Machine,
    curves: StiffnessCurves,
    faults: Sequence[Fault],
    sound: StiffnessCurves,
) -> Figure:
    """Single pair, mesh over one revolution, load sharing and compliance terms.

    ``sound`` are the curves of the machine without its faults.
    """
    pair, torque = system.pair, f"{system.operating.torque:g} N m"
    if system.torque_of:
        torque += f" of the {system.torque_of}"
    upper = [_single_pair(curves, faults), _mesh(system, curves, faults, sound)]
    lower = [_load_sharing(system, curves, faults), _terms(curves)]
    return Figure(
        [upper, lower],
        (11, 7.2),
        f"{pair.pinion.n_teeth}/{pair.wheel.n_teeth} teeth, "
        f"contact ratio {pair.transverse_contact_ratio:.3f}, "
        f"{torque}, mesh.law={system.mesh.law}, "
        f"pair_coupling={system.mesh.pair_coupling}",
    )


def _single_pair(curves: StiffnessCurves, faults: Sequence[Fault]) -> Panel:
    position, second = curves.contact_position, None
    marks = [curve(position, curves.single_pair_stiffness / 1e8, "healthy pair")]
    if curves.faulty_pair_stiffness is not None:
        stiffness = curves.faulty_pair_stiffness / 1e8
        marks.append(curve(position, stiffness, f"{faults[0].kind} pair", style="--"))
    gap = curves.faulty_pair_gap
    if gap is not None and np.any(np.abs(gap) > 1e-9):
        dotted = curve(position, gap * 1e6, None, GREY, ":")
        second = Panel("", "", "touches later by (dotted), um", [dotted])
    return Panel(
        "One pair carrying the whole load",
        "contact position from the start of contact, base pitches",
        STIFFNESS,
        marks,
        second=second,
    )


def _mesh(
    system: Machine,
    curves: StiffnessCurves,
    faults: Sequence[Fault],
    sound: StiffnessCurves,
) -> Panel:
    angle, stiffness = np.degrees(curves.roll_angle), curves.mesh_stiffness / 1e8
    gear, marks = "pinion", [curve(angle, stiffness, None, SOUND, width=0.9)]
    if faults:
        fault, gear = faults[0], faults[0].gear
        # A healthy mesh repeats with every tooth, so that its turn of the pinion fits a turn of
        # the wheel too.
        without = np.resize(sound.mesh_stiffness, angle.shape) / 1e8
        begin, pitch = _fault_angle(system, fault), _pitch_angle(system, faults)
        end = begin + pitch * system.pair.transverse_contact_ratio
        shade = {"color": FAULTY, "alpha": 0.2, "label": "its tooth in contact"}
        marks = [
            curve(angle, without, "healthy", GREY, width=0.7),
            curve(angle, stiffness, f"with {fault.kind}", SOUND, width=0.9),
            Mark("axvspan", (begin, end), shade),
        ]
    return Panel(
        "Mesh stiffness over one revolution",
        f"roll angle of the {gear}, degrees",
        STIFFNESS,
        marks,
        legend="lower right",
    )


def _load_sharing(
    system: Machine, curves: StiffnessCurves, faults: Sequence[Fault]
) -> Panel:
    pitch, begin = _pitch_angle(system, faults), 0.0
    if faults:
        begin = _fault_angle(system, faults[0]) - pitch
    angle = np.degrees(curves.roll_angle)
    shown = (angle >= begin) & (angle < begin + 4.0 * pitch)
    shares = zip(PAIRS, curves.load_share.T, strict=False)
    return Panel(
        "Load sharing at static equilibrium",
        "roll angle, degrees",
        "share of the load",
        [
            curve(angle[shown], share[shown], name, style=".", markersize=3)
            for name, share in shares
        ],
        legend="upper center",
        columns=2,
        ylim=(-0.05, 1.35),
    )


def _terms(curves: StiffnessCurves) -> Panel:
    styles, marks = {"pinion": "-", "wheel": "--"}, []
    for gear, terms in curves.compliance.items():
        for color, (name, values) in zip(COLORS, terms.items(), strict=True):
            if values.any():
                look = f"{gear} {name}", color, styles[gear]
                marks.append(curve(curves.contact_position, values * 1e12, *look))
    return Panel(
        "Compliance terms",
        "contact position, base pitches",
        "compliance, 10$^{-12}$ m/N",
        marks,
        legend="lower right",
        columns=3,
        log="y",
        ylim=(0.004, None),
    )


def shown_channel(names: Sequence[str]) -> str:
    """Channel that figures of a record show: ``pinion_y`` where there is one, else the first."""
    if "pinion_y" in names:
        return "pinion_y"
    return names[0]


def record_name(values: Mapping[str, Any], name: str | None) -> str:
    """The given name of a record, or its class and severity."""
    return name or f"{values['label_name']}, severity {values['severity']:.2f}"


def record_figure(
    system: Machine,
    acceleration: NDArray[np.float32],
    values: Mapping[str, Any],
    *,
    name: str | None = None,
    sound: NDArray[np.float32] | None = None,
) -> Figure:
    """Signal, spectrum and envelope spectrum of one channel of a record.

    ``name`` is that of the record in the title; None takes its class and severity. ``sound``
    (channel, sample) is the same record of the healthy machine, drawn in front of the faulty one.
    """
    names = system.sensing.channel_names
    channel = shown_channel(names)
    rate = system.sensing.sampling_rate
    unit = channel_unit(channel).replace("^2", "$^2$")
    row = names.index(channel)
    signals: Signals = [(None, SOUND, acceleration[row].astype(np.float64))]
    if sound is not None:
        signals = [
            (str(values["label_name"]), FAULTY, signals[0][-1]),
            ("without the fault", SOUND, sound[row].astype(np.float64)),
        ]
    shaft = values["speed_rpm"] / 60.0
    quantity = "acceleration"
    if channel.endswith(SPEED):
        quantity = "speed less the nominal one"
    time = np.arange(int(5.0 * rate / shaft)) / rate
    lines = []
    for label, color, signal in signals:
        shown = time[: len(signal)]
        lines.append(curve(shown, signal[: len(shown)], label, color, width=0.5))
    wave = Panel(
        f"{channel}, first turns of the pinion",
        "time, s",
        f"{quantity}, {unit}",
        lines,
        legend="upper right",
    )
    amplitude = f"amplitude, {unit}"
    spectrum = _spectrum(signals, rate, values["mesh_frequency_hz"], amplitude)
    envelope = _envelope(signals, rate, shaft, amplitude)
    point = f"{values['speed_rpm']:.1f} r/min, {values['torque_nm']:.3g} N m"
    title = f"{record_name(values, name)}: {point}"
    return Figure([[wave], [spectrum], [envelope]], (11, 8.5), title)


def _spectrum(signals: Signals, rate: float, mesh: float, unit: str) -> Panel:
    from gensig.signals.spectrum import amplitude_spectrum

    highest, top, marks = USABLE_SHARE * rate, 0.0, []
    for _, color, signal in signals:
        frequency, amplitude = amplitude_spectrum(signal, rate)
        top = max(top, float(amplitude.max()))
        shown = np.maximum(amplitude, 1e-9)
        marks.append(curve(frequency / 1e3, shown, None, color, width=0.5))
    for harmonic in range(1, int(highest / mesh) + 1):
        marks.append(upright(harmonic * mesh / 1e3, linewidth=0.4, alpha=0.5))
    return Panel(
        f"Spectrum; lines at harmonics of the mesh frequency {mesh:.1f} Hz",
        "frequency, kHz",
        unit,
        marks,
        log="y",
        xlim=(0, highest / 1e3),
        ylim=(max(top * 1e-6, 1e-9), top * 2.0),
    )


def _envelope(signals: Signals, rate: float, shaft: float, unit: str) -> Panel:
    from gensig.signals.envelope import envelope_spectrum

    low, high = (share * rate for share in ENVELOPE_BAND)
    marks = []
    for _, color, signal in signals:
        frequency, amplitude = envelope_spectrum(signal, rate, (low, high))
        shown = (frequency > 0.0) & (frequency < 12.0 * shaft)
        line = curve(frequency[shown], amplitude[shown], None, color, width=0.8)
        marks.append(line)
    for turn in range(1, 12):
        marks.append(upright(turn * shaft, linewidth=0.5, alpha=0.5))
    kilohertz = f"{low / 1e3:.3g} to {high / 1e3:.3g} kHz"
    title = f"Envelope spectrum of {kilohertz}; lines at turns of the pinion"
    return Panel(title, FREQUENCY, unit, marks)


def _pitch_angle(system: Machine, faults: Sequence[Fault]) -> float:
    """Roll angle from tooth to tooth of the gear with the first fault, degrees."""
    pair = system.pair
    gear = pair.pinion
    if faults and faults[0].gear == "wheel":
        gear = pair.wheel
    return 360.0 / gear.n_teeth


def _fault_angle(system: Machine, fault: Fault) -> float:
    """Roll angle at which the faulty tooth enters contact, degrees."""
    return max(fault.first_tooth, 0) * _pitch_angle(system, [fault])
