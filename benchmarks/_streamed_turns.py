"""Turns of streamed records, made in several processes: no record is stored."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import gensig
from diagnose.data.packed_turns import HEADER
from diagnose.data.targets import fault_positions, record_targets, tooth_entries
from diagnose.data.turns import Turns
from diagnose.data.windows import IntArray, WindowSet
from gensig.production.streaming import RecordStream

BLOCK = 64  # records that a process simulates at a time

Words = tuple[str, ...]


@dataclass(slots=True, kw_only=True)
class Packed:
    """Inputs of a network, one after the other, and the records that they are of.

    Attributes
    ----------
    signals : (channel, point) float16 each: half the memory, rounded 60 dB below
    levels : (feature,) each, see `diagnose.data.turn_levels`
    record : number in the stream
    """

    signals: list[NDArray[np.float16]] = field(default_factory=list)
    levels: list[NDArray[np.float32]] = field(default_factory=list)
    record: list[int] = field(default_factory=list)

    def extend(self, other: Packed) -> None:
        """Take the inputs of further records in."""
        self.signals += other.signals
        self.levels += other.levels
        self.record += other.record


@cache
def stream_of(words: Words) -> RecordStream:
    """Stream of overrides, planned once a process."""
    return gensig.stream(*words)


def teeth_of(stream: RecordStream) -> IntArray:
    """(record, gear) teeth of the driving and the driven gear."""
    return np.stack([stream.n_teeth(gear) for gear in ("pinion", "wheel")], axis=1)


def windows_of(
    words: Words,
    inputs: Turns,
    *,
    n_workers: int,
    on_block: Callable[[int, int], None] = lambda done, total: None,
) -> WindowSet:
    """Inputs of all records of a stream, with labels and further targets.

    Records that failed, and those without a whole turn, are left out.

    Parameters
    ----------
    words : overrides of ``gensig generate``
    inputs : of the network
    n_workers : processes; the result does not depend on it
    on_block : called with the number of blocks that are done and of all
    """
    stream, packed = stream_of(words), Packed()
    # Records of a unit are as long before they begin, and are simulated side by side.
    by_unit = np.argsort(stream.column("unit_id"), kind="stable")
    blocks = np.array_split(by_unit, -(-len(stream) // BLOCK))
    with ProcessPoolExecutor(
        max_workers=n_workers, initializer=_begin, initargs=(stream, inputs)
    ) as pool:
        made = pool.map(_block, blocks)
        for done, block in enumerate(made, start=1):
            packed.extend(block)
            on_block(done, len(blocks))
    return _window_set(stream, packed)


_source: dict[str, Any] = {}  # stream and input of a process


def _begin(stream: RecordStream, inputs: Turns) -> None:
    _source.update(stream=stream, teeth=teeth_of(stream), inputs=inputs)


def _block(numbers: IntArray) -> Packed:
    """Inputs of some records of the stream of this process."""
    made, inputs, rate = Packed(), _source["inputs"], _source["stream"].sampling_rate
    teeth = _source["teeth"][numbers].tolist()
    records = _source["stream"].take(numbers)
    for number, record, (driving, driven) in zip(numbers, records, teeth, strict=True):
        if record.values["status"] != "ok":
            continue
        signal, speed = record.signals["acceleration"], record.values["speed_rpm"]
        try:
            turns = inputs.turns(signal, rate, float(speed), (driving, driven))
        except ValueError:
            continue
        for of_channel, sound in inputs.inputs_of(turns, ()):
            made.signals.append(inputs.packed(of_channel, sound).astype(np.float16))
            made.levels.append(inputs.levels(of_channel))
            made.record.append(int(number))
    return made


def _window_set(stream: RecordStream, packed: Packed) -> WindowSet:
    """Inputs as windows that fill their signals, with what is known of their faults."""
    record = np.array(packed.record)
    names = stream.column_names
    columns = SimpleNamespace(column_names=names, column=stream.column)
    begin = np.zeros(len(record))  # every input begins with its record
    targets = record_targets(columns, record)
    targets["position"] = fault_positions(
        columns, record, begin, teeth_of(stream)[record]
    )
    targets["entry"] = tooth_entries(columns, record, begin)
    return WindowSet(
        signals=tuple(packed.signals),
        segment=np.arange(len(record)),
        start=np.zeros(len(record), dtype=np.int64),
        label=np.asarray(stream.column("label"))[record],
        record=record,
        window_samples=max(signal.shape[-1] for signal in packed.signals),
        normalise="rms",
        targets=targets,
        n_header=HEADER,
        levels=np.stack(packed.levels),
    )
