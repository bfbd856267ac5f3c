"""Sections of the page on signals: whole conditions, and a slider over severity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gensig.dataset.cards.class_figures import first_channel
from gensig.dataset.reader import Dataset
from gensig.report.conditions import Choice
from gensig.report.examples import envelope_band
from gensig.report.rotation_frequencies import Rotation
from gensig.report.sound import SOUND_RATE, SOUND_SECONDS
from gensig.report.turns import FINE_TEETH
from gensig.text.escaping import plain
from gensig.text.page import Charts, Section, Select, Slider, Switch

MARKS = (
    ("decibel", "logarithmic", True),
    ("mesh", "mesh harmonics", True),
    ("sidebands", "sidebands", False),
    ("shafts", "shaft orders", False),
    ("fault", "fault frequency", True),
)


def choice(
    name: str, label: str, options: Sequence[tuple[str, str]], chosen: str = ""
) -> Select:
    """A drop-down of one group of (value, text)."""
    return Select(name=name, label=label, groups=[("", options)], chosen=chosen)


def channel_choice(chosen: Choice) -> Select:
    """The drop-down of channels; that of the data card's figures is shown first."""
    options = [(str(k), plain(name)) for k, name in enumerate(chosen.channels)]
    return choice("channel", "Channel", options, str(first_channel(chosen.channels)))


def signals_section(
    data: Dataset,
    chosen: Choice,
    rotation: Rotation,
    views: Sequence[dict[str, Any]],
    opening: int,
) -> Section:
    """Charts of records, opened on a fault over its healthy signal.

    Parameters
    ----------
    views : of `gensig.report.signal_views.signal_views`
    opening : number of the record shown first
    """
    orders = [("hz", "Hz and ms")] + [
        (name, f"orders: {words}") for name, words in rotation.references
    ]
    zooms = [("all", "usable band")]
    if any(name == "mesh" for name, _ in orders):
        zooms += [(f"{k}", f"around mesh harmonic {k}") for k in (1, 2, 3)]
    selects = [
        Select(
            name="record",
            label="Record",
            groups=_records_by_condition(views),
            chosen=str(opening),
        ),
        choice("other", "Compare with", *_compared(views, opening)),
        channel_choice(chosen),
        choice("axis", "Axis", orders, "hz"),
        choice("zoom", "Spectrum", zooms, "all"),
    ]
    return Section(
        title="Signals",
        text=_signal_lines(data, chosen),
        notes=_signal_notes(),
        charts=Charts(
            name="signals",
            label="Choice of signal",
            selects=selects,
            switches=[
                Switch(name=name, label=label, on=on) for name, label, on in MARKS
            ],
            plots=_plots(data.sampling_rate),
            sounds=[
                ("record", "Sound of the record"),
                ("other", "Sound of the one beside it"),
            ],
        ),
    )


def severity_section(sweeps: Sequence[dict[str, Any]], channel: str) -> Section:
    """Slider over the severity of a class.

    Parameters
    ----------
    sweeps : at least one, of `gensig.report.severity_slider.sweep_content`
    channel : the one that they are of
    """
    steps = [step for sweep in sweeps for step in sweep["steps"]]
    options = [(str(k), sweep["class"]) for k, sweep in enumerate(sweeps)]
    plots = [
        ("step_turn", "Averaged turn, and below it the difference"),
        ("step_change", "Change of the averaged turn over severity"),
    ]
    if any("wave" in step for step in steps):
        plots.append(("step_wave", "Record minus its healthy twin"))
    return Section(
        title="Severity",
        text=[
            f"Records of one class in the order of severity, on {plain(channel)}. Each is "
            "compared with its own healthy signal. Change: RMS of the difference of both "
            "averaged turns over the RMS of the healthy one."
        ],
        charts=Charts(
            name="severity",
            label="Choice of severity",
            selects=[choice("class", "Class", options, "0")],
            sliders=[
                Slider(name="step", label="Severity", last=len(sweeps[0]["steps"]) - 1)
            ],
            plots=plots,
        ),
    )


def counted(number: int, noun: str) -> str:
    """A number with its noun, whose plural ends in s."""
    if number == 1:
        return f"1 {noun}"
    return f"{number} {noun}s"


def _signal_lines(data: Dataset, chosen: Choice) -> list[str]:
    """Sentences on the records that are shown."""
    n_conditions = counted(len(chosen.conditions), "whole condition")
    lines = [
        f"{chosen.n_records} of {data.n_records} records, as {n_conditions}: one machine at one "
        "speed and torque. A record is compared with others of its condition only."
    ]
    if chosen.remark:
        lines.append(f"Shown are {chosen.remark}.")
    return lines


def _signal_notes() -> list[tuple[str, str]]:
    """Reading of the charts and sounds."""
    return [
        (
            "Opening",
            "the class whose averaged turns differ most from the healthy ones, its record of "
            "middle severity",
        ),
        (
            "Averaged turn",
            "of the gear with the fault, at the record's mean speed, from tooth 0 on; the "
            "faulty tooth is shaded. Turns of a condition are rotated to its healthy one by "
            f"at most {FINE_TEETH:g} of a tooth. Few turns leave some of the other gear in it",
        ),
        (
            "Sound",
            f"the first {SOUND_SECONDS:g} s at most, at {SOUND_RATE / 1e3:g} kHz, on one scale "
            "within a condition, so that loudness can be compared",
        ),
        (
            "Rounding",
            "amplitudes of spectra to 0.4 dB; waveform and spectrogram are those of the first "
            "samples, up to 8192",
        ),
    ]


def view_label(view: dict[str, Any]) -> str:
    """Class, severity and name of a record in one line."""
    if view["class"] == "healthy twin":
        return plain(f"healthy twin of {view['record']}")
    severity = "unknown"
    if view["severity"] is not None:
        severity = f"{view['severity']:.2f}"
    label = f"{view['class']}, severity {severity}, {view['record']}"
    if view["condition"] != view["of"]:
        label += ", of another condition"
    return plain(label)


def _records_by_condition(
    views: Sequence[dict[str, Any]],
) -> list[tuple[str, list[tuple[str, str]]]]:
    """Number and label of each record, by condition; twins are only compared with."""
    labels: dict[int, str] = {}
    options: dict[int, list[tuple[str, str]]] = {}
    for number, view in enumerate(views):
        if view["condition"] == view["of"]:
            labels[view["set"]] = _condition_label(view)
        if view["class"] != "healthy twin":
            option = (str(number), view_label(view))
            options.setdefault(view["set"], []).append(option)
    return [(labels[number], options[number]) for number in options]


def _condition_label(view: dict[str, Any]) -> str:
    parts = [view["unit"], view["condition"]]
    if view["frequencies"].get("drive"):
        parts.append(f"{60 * view['frequencies']['drive']:.0f} r/min")
    if view["torque"] is not None:
        parts.append(f"{view['torque']:.3g} N m")
    return plain(", ".join(parts))


def _compared(
    views: Sequence[dict[str, Any]], opening: int
) -> tuple[list[tuple[str, str]], str]:
    """Options of what the first record is compared with, and the one that is chosen."""
    view = views[opening]
    options = [("", "nothing")]
    options += [(str(k), view_label(views[k])) for k in view["compare"]]
    if view["healthy"] is None:
        return options, ""
    return options, str(view["healthy"])


def _plots(sampling_rate: float) -> list[tuple[str, str]]:
    """Names and titles of the plots of a signal."""
    low, high = envelope_band(sampling_rate)
    band = f"{low / 1e3:.3g} to {high / 1e3:.3g} kHz"
    return [
        ("turn", "Averaged turn, and below it the difference"),
        ("wave", "Waveform"),
        ("spectrum", "Amplitude spectrum"),
        ("envelope", f"Spectrum of the envelope of {band}"),
        ("spectrogram", "Spectrogram"),
    ]
