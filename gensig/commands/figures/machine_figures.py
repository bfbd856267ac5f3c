"""Figures of one machine and of one record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.commands.figures.style import (
    COLORS,
    FAULTY,
    FREQUENCY,
    GREY,
    SOUND,
    curve,
    panels,
    save,
    titles,
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


def plot_stiffness(
    system: Machine,
    curves: StiffnessCurves,
    faults: Sequence[Fault],
    path: Path,
    *,
    sound: StiffnessCurves,
) -> None:
    """Draw single pair, mesh over one revolution, load sharing and compliance terms.

    ``sound`` are the curves of the machine without its faults.
    """
    figure, axes = panels(2, 2, 11, 7.2)
    (single, mesh), (sharing, terms) = axes
    _single_pair(single, curves, faults)
    _mesh(mesh, system, curves, faults, sound)
    _load_sharing(sharing, system, curves, faults)
    _terms(terms, curves)
    pair, torque = system.pair, f"{system.operating.torque:g} N m"
    if system.torque_of:
        torque += f" of the {system.torque_of}"
    figure.suptitle(
        f"{pair.pinion.n_teeth}/{pair.wheel.n_teeth} teeth, "
        f"contact ratio {pair.transverse_contact_ratio:.3f}, "
        f"{torque}, mesh.law={system.mesh.law}, "
        f"pair_coupling={system.mesh.pair_coupling}"
    )
    save(figure, path)


def _single_pair(axes: Any, curves: StiffnessCurves, faults: Sequence[Fault]) -> None:
    position = curves.contact_position
    curve(axes, position, curves.single_pair_stiffness / 1e8, SOUND, "healthy pair")
    if curves.faulty_pair_stiffness is not None:
        stiffness = curves.faulty_pair_stiffness / 1e8
        label = f"{faults[0].kind} pair"
        curve(axes, position, stiffness, FAULTY, label, style="--")
    gap = curves.faulty_pair_gap
    if gap is not None and np.any(np.abs(gap) > 1e-9):
        second = axes.twinx()
        curve(second, position, gap * 1e6, GREY, style=":")
        second.set_ylabel("touches later by (dotted), um")
    title = "One pair carrying the whole load"
    abscissa = "contact position from the start of contact, base pitches"
    titles(axes, title, abscissa, STIFFNESS)
    axes.legend()


def _mesh(
    axes: Any,
    system: Machine,
    curves: StiffnessCurves,
    faults: Sequence[Fault],
    sound: StiffnessCurves,
) -> None:
    angle, stiffness = np.degrees(curves.roll_angle), curves.mesh_stiffness / 1e8
    gear = "pinion"
    if not faults:
        curve(axes, angle, stiffness, SOUND, width=0.9)
    else:
        fault, gear = faults[0], faults[0].gear
        # A healthy mesh repeats with every tooth, so that its turn of the pinion fits a turn of
        # the wheel too.
        without = np.resize(sound.mesh_stiffness, angle.shape) / 1e8
        curve(axes, angle, without, GREY, "healthy", width=0.7)
        curve(axes, angle, stiffness, SOUND, f"with {fault.kind}", width=0.9)
        begin, pitch = _fault_angle(system, fault), _pitch_angle(system, faults)
        end = begin + pitch * system.pair.transverse_contact_ratio
        axes.axvspan(begin, end, color=FAULTY, alpha=0.2, label="its tooth in contact")
        axes.legend(loc="lower right")
    title = "Mesh stiffness over one revolution"
    titles(axes, title, f"roll angle of the {gear}, degrees", STIFFNESS)


def _load_sharing(
    axes: Any, system: Machine, curves: StiffnessCurves, faults: Sequence[Fault]
) -> None:
    pitch, begin = _pitch_angle(system, faults), 0.0
    if faults:
        begin = _fault_angle(system, faults[0]) - pitch
    angle = np.degrees(curves.roll_angle)
    shown = (angle >= begin) & (angle < begin + 4.0 * pitch)
    names = ("pair about to enter", "newest pair", "pair before it", "pair before that")
    for name, share, color in zip(names, curves.load_share.T, COLORS, strict=False):
        axes.plot(
            angle[shown], share[shown], ".", markersize=3, color=color, label=name
        )
    title = "Load sharing at static equilibrium"
    titles(axes, title, "roll angle, degrees", "share of the load")
    axes.set_ylim(-0.05, 1.35)
    axes.legend(fontsize="small", ncols=2, loc="upper center")


def _terms(axes: Any, curves: StiffnessCurves) -> None:
    styles = {"pinion": "-", "wheel": "--"}
    for gear, terms in curves.compliance.items():
        for color, (name, values) in zip(COLORS, terms.items(), strict=True):
            if values.any():
                label, style = f"{gear} {name}", styles[gear]
                position = curves.contact_position
                curve(axes, position, values * 1e12, color, label, style=style)
    ordinate = "compliance, 10$^{-12}$ m/N"
    abscissa = "contact position, base pitches"
    titles(axes, "Compliance terms", abscissa, ordinate, yscale="log")
    axes.set_ylim(bottom=0.004)
    axes.legend(fontsize="x-small", ncols=3, loc="lower right")


def shown_channel(names: Sequence[str]) -> str:
    """Channel that figures of a record show: ``pinion_y`` where there is one, else the first."""
    if "pinion_y" in names:
        return "pinion_y"
    return names[0]


def record_name(values: Mapping[str, Any], name: str | None) -> str:
    """The given name of a record, or its class and severity."""
    return name or f"{values['label_name']}, severity {values['severity']:.2f}"


def plot_record(
    system: Machine,
    acceleration: NDArray[np.float32],
    values: Mapping[str, Any],
    path: Path,
    *,
    name: str | None = None,
    sound: NDArray[np.float32] | None = None,
) -> None:
    """Draw signal, spectrum and envelope spectrum of one channel of a record.

    ``name`` is that of the record in the title; None takes its class and severity. ``sound``
    (channel, sample) is the same record of the healthy machine, drawn in front of the faulty one.
    """
    names = system.sensing.channel_names
    channel = shown_channel(names)
    rate = system.sensing.sampling_rate
    unit = channel_unit(channel).replace("^2", "$^2$")
    shaft = values["speed_rpm"] / 60.0
    shown_name = record_name(values, name)
    row = names.index(channel)
    lines = [_Line(signal=acceleration[row].astype(np.float64))]
    if sound is not None:
        lines = [
            replace(lines[0], color=FAULTY, label=str(values["label_name"])),
            _Line(signal=sound[row].astype(np.float64), label="without the fault"),
        ]
    figure, axes = panels(3, 1, 11, 8.5)
    wave, spectrum, envelope = axes[:, 0]
    _wave(wave, lines, rate, shaft)
    what = "acceleration"
    if channel.endswith(SPEED):
        what = "speed less the nominal one"
    title = f"{channel}, first turns of the pinion"
    titles(wave, title, "time, s", f"{what}, {unit}")
    _spectrum(spectrum, lines, rate, values["mesh_frequency_hz"])
    _envelope(envelope, lines, rate, shaft)
    for panel in (spectrum, envelope):
        panel.set_ylabel(f"amplitude, {unit}")
    if sound is not None:
        wave.legend(loc="upper right")
    point = f"{values['speed_rpm']:.1f} r/min, {values['torque_nm']:.3g} N m"
    figure.suptitle(f"{shown_name}: {point}")
    save(figure, path)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Line:
    """One record in a figure; ``signal`` (sample,)."""

    signal: NDArray[np.float64]
    color: str = SOUND
    label: str = ""


def _wave(axes: Any, lines: Sequence[_Line], rate: float, shaft: float) -> None:
    for line in lines:
        shown = min(len(line.signal), int(5.0 * rate / shaft))
        time = np.arange(shown) / rate
        curve(axes, time, line.signal[:shown], line.color, line.label, width=0.5)


def _spectrum(axes: Any, lines: Sequence[_Line], rate: float, mesh: float) -> None:
    from gensig.signals.spectrum import amplitude_spectrum

    highest, top = USABLE_SHARE * rate, 0.0
    for line in lines:
        frequency, amplitude = amplitude_spectrum(line.signal, rate)
        top = max(top, float(amplitude.max()))
        shown = np.maximum(amplitude, 1e-9)
        axes.semilogy(frequency / 1e3, shown, color=line.color, linewidth=0.5)
    for harmonic in range(1, int(highest / mesh) + 1):
        axes.axvline(harmonic * mesh / 1e3, color=GREY, linewidth=0.4, alpha=0.5)
    axes.set(
        title=f"Spectrum; lines at harmonics of the mesh frequency {mesh:.1f} Hz",
        xlabel="frequency, kHz",
        xlim=(0, highest / 1e3),
        ylim=(max(top * 1e-6, 1e-9), top * 2.0),
    )


def _envelope(axes: Any, lines: Sequence[_Line], rate: float, shaft: float) -> None:
    from gensig.signals.envelope import envelope_spectrum

    low, high = (share * rate for share in ENVELOPE_BAND)
    for line in lines:
        frequency, amplitude = envelope_spectrum(line.signal, rate, (low, high))
        shown = (frequency > 0.0) & (frequency < 12.0 * shaft)
        curve(axes, frequency[shown], amplitude[shown], line.color, width=0.8)
    for turn in range(1, 12):
        axes.axvline(turn * shaft, color=GREY, linewidth=0.5, alpha=0.5)
    kilohertz = f"{low / 1e3:.3g} to {high / 1e3:.3g} kHz"
    title = f"Envelope spectrum of {kilohertz}; lines at turns of the pinion"
    axes.set(title=title, xlabel=FREQUENCY)


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
