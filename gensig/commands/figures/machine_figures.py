"""Figures of one machine and one record; colours that the colour-blind can tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from numpy.typing import NDArray

from gensig.faults.base import Fault
from gensig.systems.base import Machine
from gensig.systems.stiffness_curves import StiffnessCurves
from gensig.units import SPEED, channel_unit

matplotlib.use("Agg")
from matplotlib import pyplot

SOUND, FAULTY, THIRD, FOURTH, GREY = (
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#CC79A7",
    "#777777",
)
COLOURS = (SOUND, FAULTY, THIRD, FOURTH, "#56B4E9", GREY)
# above the mesh line, below the highest usable frequency: where teeth ring and faults modulate
ENVELOPE_BAND_HZ = (5000.0, 19000.0)


def plot_stiffness(
    system: Machine,
    curves: StiffnessCurves,
    faults: Sequence[Fault],
    path: Path,
    *,
    sound: StiffnessCurves,
) -> None:
    """Single pair, mesh over one revolution and as it is when ``sound``, load sharing and
    compliance terms.
    """
    figure, axes = pyplot.subplots(2, 2, figsize=(11, 7.2), layout="constrained")
    _single_pair(axes[0, 0], curves, faults)
    _mesh(axes[0, 1], system, curves, faults, sound)
    _load_sharing(axes[1, 0], system, curves, faults)
    _terms(axes[1, 1], curves)
    pair, of_what = (
        system.pair,
        f" of the {system.torque_of}" if system.torque_of else "",
    )
    figure.suptitle(
        f"{pair.pinion.n_teeth}/{pair.wheel.n_teeth} teeth, contact ratio {pair.transverse_contact_ratio:.3f}, "
        f"{system.operating.torque:g} N m{of_what}, mesh.law={system.mesh.law}, "
        f"pair_coupling={system.mesh.pair_coupling}"
    )
    save(figure, path)


def _single_pair(axes: Any, curves: StiffnessCurves, faults: Sequence[Fault]) -> None:
    axes.plot(
        curves.contact_position,
        curves.single_pair_stiffness / 1e8,
        color=SOUND,
        label="sound pair",
    )
    if curves.faulty_pair_stiffness is not None:
        axes.plot(
            curves.contact_position,
            curves.faulty_pair_stiffness / 1e8,
            "--",
            color=FAULTY,
            label=f"{faults[0].kind} pair",
        )
    if curves.faulty_pair_gap is not None and np.any(
        np.abs(curves.faulty_pair_gap) > 1e-9
    ):
        late = axes.twinx()
        late.plot(
            curves.contact_position, curves.faulty_pair_gap * 1e6, ":", color=GREY
        )
        late.set_ylabel("touches later by (dotted), um")
    axes.set(
        title="One pair carrying the whole load",
        xlabel="contact position from the start of contact, base pitches",
        ylabel="stiffness, 10$^8$ N/m",
    )
    axes.legend()


def _mesh(
    axes: Any,
    system: Machine,
    curves: StiffnessCurves,
    faults: Sequence[Fault],
    sound: StiffnessCurves,
) -> None:
    angle = np.degrees(curves.roll_angle)
    if faults:
        # A sound mesh has the period of a tooth, so that its turn of the pinion fits a turn of
        # the wheel too.
        without = np.resize(sound.mesh_stiffness, angle.shape)
        axes.plot(angle, without / 1e8, color=GREY, linewidth=0.7, label="sound")
    label = f"with {faults[0].kind}" if faults else None
    axes.plot(
        angle, curves.mesh_stiffness / 1e8, color=SOUND, linewidth=0.9, label=label
    )
    if faults:
        begin = _fault_angle(system, faults[0])
        end = begin + _contact_angle(system, faults[0])
        axes.axvspan(begin, end, color=FAULTY, alpha=0.2, label="its tooth in contact")
        axes.legend(loc="lower right")
    axes.set(
        title="Mesh stiffness over one revolution",
        xlabel=f"roll angle of the {faults[0].gear if faults else 'pinion'}, degrees",
        ylabel="stiffness, 10$^8$ N/m",
    )


def _load_sharing(
    axes: Any, system: Machine, curves: StiffnessCurves, faults: Sequence[Fault]
) -> None:
    pitch_angle = 360.0 / _n_teeth(system, faults)
    begin = _fault_angle(system, faults[0]) - pitch_angle if faults else 0.0
    angle = np.degrees(curves.roll_angle)
    shown = (angle >= begin) & (angle < begin + 4.0 * pitch_angle)
    names = ("pair about to enter", "newest pair", "pair before it", "pair before that")
    for k, name in enumerate(names):
        axes.plot(
            angle[shown],
            curves.load_share[shown, k],
            ".",
            markersize=3,
            color=COLOURS[k],
            label=name,
        )
    axes.set(
        title="Load sharing at static equilibrium",
        xlabel="roll angle, degrees",
        ylabel="share of the load",
    )
    axes.set_ylim(-0.05, 1.35)
    axes.legend(fontsize="small", ncols=2, loc="upper center")


def _terms(axes: Any, curves: StiffnessCurves) -> None:
    styles = {"pinion": "-", "wheel": "--"}
    for gear, terms in curves.compliance.items():
        for colour, (name, values) in zip(COLOURS, terms.items(), strict=True):
            if not values.any():
                continue
            axes.plot(
                curves.contact_position,
                values * 1e12,
                styles[gear],
                color=colour,
                label=f"{gear} {name}",
            )
    axes.set(
        title="Compliance terms",
        xlabel="contact position, base pitches",
        ylabel="compliance, 10$^{-12}$ m/N",
        yscale="log",
    )
    axes.set_ylim(bottom=0.004)
    axes.legend(fontsize="x-small", ncols=3, loc="lower right")


def plot_record(
    system: Machine,
    acceleration: NDArray[np.float32],
    values: dict[str, Any],
    path: Path,
    *,
    name: str | None = None,
) -> None:
    """Signal, spectrum and envelope spectrum of the most telling channel, shaft and mesh
    frequencies marked.

    ``name`` is that of the record in the title; None takes its class and severity.
    """
    from gensig.signals.envelope import envelope_spectrum
    from gensig.signals.spectrum import amplitude_spectrum

    names = system.sensing.channel_names
    channel = "pinion_y" if "pinion_y" in names else names[0]
    signal = acceleration[names.index(channel)].astype(np.float64)
    rate = system.sensing.sampling_rate
    unit = channel_unit(channel).replace("^2", "$^2$")
    what = "speed less the nominal one" if channel.endswith(SPEED) else "acceleration"
    shaft, mesh = values["speed_rpm"] / 60.0, values["mesh_frequency_hz"]
    figure, axes = pyplot.subplots(3, 1, figsize=(11, 8.5), layout="constrained")
    shown = min(len(signal), int(5.0 * rate / shaft))
    axes[0].plot(np.arange(shown) / rate, signal[:shown], color=SOUND, linewidth=0.5)
    axes[0].set(
        title=f"{channel}, first turns of the pinion",
        xlabel="time, s",
        ylabel=f"{what}, {unit}",
    )
    frequency, amplitude = amplitude_spectrum(signal, rate)
    axes[1].semilogy(
        frequency / 1e3, np.maximum(amplitude, 1e-9), color=SOUND, linewidth=0.5
    )
    for harmonic in range(1, int(0.39 * rate / mesh) + 1):
        axes[1].axvline(harmonic * mesh / 1e3, color=FAULTY, linewidth=0.4, alpha=0.5)
    axes[1].set(
        title=f"Spectrum; lines at harmonics of the mesh frequency {mesh:.1f} Hz",
        xlabel="frequency, kHz",
        ylabel=f"amplitude, {unit}",
        xlim=(0, 0.39 * rate / 1e3),
        ylim=(max(amplitude.max() * 1e-6, 1e-9), amplitude.max() * 2.0),
    )
    band = (ENVELOPE_BAND_HZ[0] / 51200.0 * rate, ENVELOPE_BAND_HZ[1] / 51200.0 * rate)
    frequency, amplitude = envelope_spectrum(signal, rate, band)
    below = (frequency > 0.0) & (frequency < 12.0 * shaft)
    axes[2].plot(frequency[below], amplitude[below], color=SOUND, linewidth=0.8)
    for turn in range(1, 12):
        axes[2].axvline(turn * shaft, color=FAULTY, linewidth=0.5, alpha=0.5)
    axes[2].set(
        title=f"Envelope spectrum of {band[0] / 1e3:.3g} to {band[1] / 1e3:.3g} kHz; lines at turns of the pinion",
        xlabel="frequency, Hz",
        ylabel=f"amplitude, {unit}",
    )
    title = name or f"{values['label_name']}, severity {values['severity']:.2f}"
    figure.suptitle(
        f"{title}: {values['speed_rpm']:.1f} r/min, {values['torque_nm']:.3g} N m"
    )
    save(figure, path)


def save(figure: Any, path: Path) -> None:
    """Write a figure and forget it."""
    figure.savefig(path, dpi=130)
    pyplot.close(figure)


def _n_teeth(system: Machine, faults: Sequence[Fault]) -> int:
    return (
        system.pair.wheel.n_teeth
        if faults and faults[0].gear == "wheel"
        else system.pair.pinion.n_teeth
    )


def _fault_angle(system: Machine, fault: Fault) -> float:
    """Roll angle at which the faulty tooth enters contact, degrees."""
    return 360.0 * max(fault.first_tooth, 0) / _n_teeth(system, [fault])


def _contact_angle(system: Machine, fault: Fault) -> float:
    """Roll angle over which one tooth is in contact, degrees."""
    return 360.0 / _n_teeth(system, [fault]) * system.pair.transverse_contact_ratio
