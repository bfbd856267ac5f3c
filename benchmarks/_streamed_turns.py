"""Turns of streamed records, made in several processes: no record is stored."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

import gensig
from diagnose.data.packed_turns import HEADER, packed, turns_of
from diagnose.data.targets import fault_positions, record_targets, tooth_entries
from diagnose.data.turns import Steady, Turns
from diagnose.data.windows import IntArray, WindowSet
from gensig.production.streaming import RecordStream
from gensig.signals.separation import GearTurns

BLOCK = 64  # records that a process simulates at a time

Words = tuple[str, ...]
Halves = NDArray[np.float16]


@dataclass(slots=True, kw_only=True)
class Inputs:
    """Inputs of a network, one after the other, and the records that they are of.

    Attributes
    ----------
    signals : (channel, point) each, in half precision: rounded 60 dB below
    levels : (feature,) each, see `diagnose.data.turn_levels`
    record : number in the stream
    """

    signals: list[Halves] = field(default_factory=list)
    levels: list[NDArray[np.float32]] = field(default_factory=list)
    record: list[int] = field(default_factory=list)

    def extend(self, other: Inputs) -> None:
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
    kept: Path | None = None,
    on_block: Callable[[int, int], None] = lambda done, total: None,
) -> WindowSet:
    """Inputs of all records of a stream, with labels and further targets.

    Records that failed, and those without a whole turn, are left out.

    Parameters
    ----------
    words : overrides of ``gensig generate``
    inputs : of the network
    n_workers : processes; the result does not depend on it
    kept : folder in which the turns are kept for another training, which reads them from there
    on_block : called with the number of blocks that are done and of all
    """
    stream, made = stream_of(words), Inputs()
    # Records of a unit are as long before they begin, and are simulated side by side.
    by_unit = np.argsort(stream.column("unit_id"), kind="stable")
    blocks = np.array_split(by_unit, -(-len(stream) // BLOCK))
    files: list[Path | None] = [None] * len(blocks)
    if kept is not None:
        folder = kept / hashlib.sha256(json.dumps(words).encode()).hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True)
        files = [folder / f"{number:04d}.npz" for number in range(len(blocks))]
    with ProcessPoolExecutor(
        max_workers=n_workers, initializer=_begin, initargs=(stream, inputs)
    ) as pool:
        for done, block in enumerate(pool.map(_block, blocks, files), start=1):
            made.extend(block)
            on_block(done, len(blocks))
    return _window_set(stream, made)


_source: dict[str, Any] = {}  # stream and input of a process


def _begin(stream: RecordStream, inputs: Turns) -> None:
    threadpool_limits(1)  # as many threads as processes already
    # The turns are kept as they are recorded; each training prepares them in its own way.
    recorded = replace(inputs, whitened=False)
    _source.update(
        stream=stream, teeth=teeth_of(stream), inputs=inputs, recorded=recorded
    )


def _block(numbers: IntArray, file: Path | None) -> Inputs:
    """Inputs of some records of the stream of this process."""
    made, inputs = Inputs(), _source["inputs"]
    for number, array in _turns(numbers, file):
        turns = inputs.prepared(_unpacked(array, inputs.samples_per_tooth))
        for of_channel, sound in inputs.inputs_of([Steady(turns, math.nan)], math.nan):
            made.signals.append(inputs.packed(of_channel, sound).astype(np.float16))
            made.levels.append(inputs.levels(of_channel))
            made.record.append(number)
    return made


def _turns(numbers: IntArray, file: Path | None) -> list[tuple[int, Halves]]:
    """Packed turns (channel, point) of records with their numbers, from a file if it is there."""
    if file is not None and file.exists():
        with np.load(file, allow_pickle=False) as arrays:
            ends = np.cumsum(arrays["length"])[:-1]
            turns = np.split(arrays["points"], ends, axis=-1)
            return list(zip(arrays["record"].tolist(), turns, strict=True))
    made = list(_simulated(numbers))
    if file is not None and made:
        arrays = [array for _, array in made]
        np.savez(
            file,
            record=[number for number, _ in made],
            length=[array.shape[-1] for array in arrays],
            points=np.concatenate(arrays, axis=-1),
        )
    return made


def _simulated(numbers: IntArray) -> Iterator[tuple[int, Halves]]:
    """Numbers and packed turns of the records that hold a turn."""
    inputs, rate = _source["recorded"], _source["stream"].sampling_rate
    records = _source["stream"].take(numbers)
    for number, record in zip(numbers.tolist(), records, strict=True):
        if record.values["status"] != "ok":
            continue
        driving, driven = _source["teeth"][number].tolist()
        signal, speed = (
            record.signals["acceleration"],
            float(record.values["speed_rpm"]),
        )
        try:
            turns = inputs.turns(signal, rate, speed, (driving, driven))
        except ValueError:
            continue
        yield number, _packed(turns, inputs.samples_per_tooth)


def _packed(turns: GearTurns, samples_per_tooth: int) -> Halves:
    """Turns of both gears and mean passage in one array (channel, point)."""
    gears = [
        turn.reshape(len(turn), -1, samples_per_tooth)
        for turn in (turns.driving, turns.driven)
    ]
    return packed(gears, turns.mesh).astype(np.float16)


def _unpacked(array: Halves, samples_per_tooth: int) -> GearTurns:
    """Turns of both gears and mean passage of an array of `_packed`."""
    driving, driven, mesh = turns_of(array.astype(float), samples_per_tooth)
    n_channels = len(array)
    return GearTurns(
        driving=driving.reshape(n_channels, -1),
        driven=driven.reshape(n_channels, -1),
        mesh=mesh,
    )


def _window_set(stream: RecordStream, made: Inputs) -> WindowSet:
    """Inputs as windows that fill their signals, with what is known of their faults."""
    record = np.array(made.record)
    names = stream.column_names
    columns = SimpleNamespace(column_names=names, column=stream.column)
    begin = np.zeros(len(record))  # every input begins with its record
    targets = record_targets(columns, record)
    targets["position"] = fault_positions(
        columns, record, begin, teeth_of(stream)[record]
    )
    targets["entry"] = tooth_entries(columns, record, begin)
    return WindowSet(
        signals=tuple(made.signals),
        segment=np.arange(len(record)),
        start=np.zeros(len(record), dtype=np.int64),
        label=np.asarray(stream.column("label"))[record],
        record=record,
        window_samples=max(signal.shape[-1] for signal in made.signals),
        normalise="rms",
        targets=targets,
        n_header=HEADER,
        levels=np.stack(made.levels),
    )
