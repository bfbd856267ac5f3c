"""``gensig measured``: what a folder of measured recordings holds."""

from __future__ import annotations

import json
from argparse import Namespace
from dataclasses import asdict
from pathlib import Path
from typing import Any

from gensig.errors import ConfigError
from gensig.measured.found_table import hash_lines, known_lines, set_lines
from gensig.measured.loading import load, sets
from gensig.measured.measured_set import MeasuredRecording, MeasuredSet
from gensig.measured.measured_signal import read_signal
from gensig.terminal.printing import show, show_text


def measured(arguments: Namespace) -> int:
    """Print the known sets, or what a folder holds of one."""
    words = list(arguments.words)
    if not words:
        show(*known_lines())
        return 0
    found = open_set(words)
    if arguments.json:
        show_text(json.dumps(_plain(found), indent=2))
        return 0
    show(*set_lines(found))
    show("", "sha256 of what was read:")
    show(*hash_lines(found, whole=arguments.hashes))
    show(*_first_lines(found))
    return 0


def open_set(words: list[str]) -> MeasuredSet:
    """The set of the words SET DIR, DIR or a YAML.

    Raises
    ------
    ConfigError    for other words
    """
    if len(words) > 2:
        raise ConfigError(
            f"'{words[2]}' is too much; give SET and its folder, or a YAML"
        )
    if len(words) == 1:
        if words[0] in sets() and not Path(words[0]).exists():
            raise ConfigError(
                f"{words[0]}: give the folder too: gensig measured {words[0]} DIR"
            )
        return load(None, words[0])
    return load(words[0], words[1])


def _first_lines(found: MeasuredSet) -> list[str]:
    """A line for the first recording of each machine: it is read, as a check of the layout."""
    lines = []
    for machine in found.machines():
        first = found.of_machine(machine)[0]
        if first.sampling_rate is None:
            continue
        signal = read_signal(first)
        n_samples = signal.acceleration.shape[1]
        lines.append("")
        lines.append(
            f"{first.name}: {len(signal.sensors)} channel(s) {', '.join(signal.sensors)}, "
            f"{n_samples} samples, {signal.duration:.3g} s"
        )
    return lines


def _plain(found: MeasuredSet) -> dict[str, Any]:
    """The set as plain values."""
    return {
        "name": found.name,
        "title": found.title,
        "licence": found.licence,
        "missing": dict(found.missing),
        "sources": dict(found.sources),
        "others": list(found.others),
        "n_others": found.n_others,
        "recordings": [_plain_recording(one) for one in found.recordings],
    }


def _plain_recording(one: MeasuredRecording) -> dict[str, Any]:
    """A recording as plain values, with units in the keys."""
    speed = one.shaft_frequency and 60.0 * one.shaft_frequency
    return {
        "name": one.name,
        "sha256": one.sha256,
        "class": one.own_class,
        "label": one.label,
        "machine": one.machine,
        "specimen": one.specimen,
        "train": one.train and asdict(one.train),
        "speed_rpm": speed,
        "speed_varies": one.speed_varies,
        "load": one.load,
        "sampling_rate_hz": one.sampling_rate,
        "unit": one.unit,
    }
