"""Recordings that carried implants in the training of a network: stored with it, and refused.

A network knows by heart the stretches that carried, so that a score on them says nothing.
"""

from __future__ import annotations

import string
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import Segments, Task, subset_segments
from gensig.dataset.folder.joining import IMPLANTS
from gensig.dataset.folder.layout import FINGERPRINTS, read_config
from gensig.errors import DatasetError
from gensig.implants.blocks import Block, blocks_content, read_blocks
from gensig.implants.carriers import samples_digest
from gensig.implants.fingerprints import (
    Fingerprint,
    Known,
    fingerprints_content,
    fingerprints_from,
    known_alike,
    known_in,
)
from gensig.signals.recording import Recording

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

SEEN = ("train", "validation")  # parts of a split that a training looks at
HELD_OUT = "--held-out"
DIGITS_OF_A_DIGEST = 64
SLACK = 2e-3  # s, of a stretch that is found by fingerprints
BY_CHECKSUM = (
    "this model is of an earlier version: it knows the recordings that carried in its training by "
    "their checksums alone, not where they were cut, resampled or rounded; train it again"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Carried:
    """Blocks of healthy recordings behind a network that was trained on implants.

    Attributes
    ----------
    blocks : all of its data set, those held out too
    seen : numbers of the blocks whose records were in its training or validation
    fingerprints : of the recordings; none in models of earlier versions
    """

    blocks: tuple[Block, ...]
    seen: tuple[int, ...]
    fingerprints: tuple[Fingerprint, ...] = ()

    def __post_init__(self) -> None:
        carrying = {block.number for block in self.blocks if block.carries}
        if len({block.number for block in self.blocks}) < len(self.blocks):
            raise ValueError("two blocks of implants have one number")
        if not set(self.seen) <= carrying:
            raise ValueError("seen names blocks of implants that carry nothing")
        for block in self.blocks:
            if not 0 <= block.start < block.stop:
                raise ValueError(
                    f"a block of implants has samples {block.start} to {block.stop}"
                )
            if not (is_digest(block.sha256) and is_digest(block.samples_sha256)):
                raise ValueError("a block of implants has no sha256")

    def content(self) -> dict[str, Any]:
        """Plain values, as ``model.json`` holds them."""
        return {
            "blocks": blocks_content(self.blocks),
            "seen": list(self.seen),
            FINGERPRINTS: fingerprints_content(self.fingerprints),
        }

    def of_recording(
        self, digests: frozenset[str], recording: Recording
    ) -> tuple[Block, ...]:
        """Blocks that lie in a recording, in its samples, from its first sample on.

        Those of the recording that has one of the digests; else of those whose fingerprints it
        shows, wherever and at whatever rate.
        """
        own = [
            block
            for block in self.blocks
            if digests & {block.sha256, block.samples_sha256}
        ]
        if not own:
            for known in known_in(recording, self.fingerprints):
                own += [
                    _placed(block, known, recording.sampling_rate)
                    for block in self.blocks
                    if block.samples_sha256 == known.samples_sha256
                ]
        return tuple(sorted(own, key=lambda block: block.start))


def _placed(block: Block, known: Known, sampling_rate: float) -> Block:
    """A block in the samples of a recording that holds a part of its own.

    Of a block that carried `SLACK` is left out at both ends; one held out begins and ends later.
    """

    def sample(of_block: int, slack: float) -> int:
        time = of_block / known.sampling_rate - known.delay + slack
        return round(time * sampling_rate)

    return replace(
        block,
        start=max(sample(block.start, SLACK), 0),
        stop=max(sample(block.stop, -SLACK if block.carries else SLACK), 0),
    )


def is_digest(text: str) -> bool:
    """True for a sha256 in hexadecimal digits."""
    return len(text) == DIGITS_OF_A_DIGEST and set(text) <= set(string.hexdigits)


def carried_from(content: Mapping[str, Any]) -> Carried:
    """Blocks from the values of ``model.json``.

    Raises
    ------
    ValueError    for values that are no such blocks
    """
    try:
        for entry in content["blocks"]:
            if not isinstance(entry["carries"], bool):
                raise ValueError(f"carries {entry['carries']!r} is not true or false")
        blocks = read_blocks({IMPLANTS: content})
        fingerprints = fingerprints_from(content.get(FINGERPRINTS, ()))
    except (DatasetError, KeyError, TypeError) as error:
        raise ValueError(f"its blocks of implants are damaged: {error}") from None
    seen = tuple(int(number) for number in content["seen"])
    return Carried(blocks=blocks, seen=seen, fingerprints=fingerprints)


def carried_in(task: Task, protocol: str) -> Carried | None:
    """Blocks behind a network that is trained on a split of a data set; None without implants."""
    blocks = blocks_of(task.dataset)
    if not blocks:
        return None
    records = np.concatenate(
        [subset_segments(task, protocol, subset).record for subset in SEEN]
    )
    names = _block_names(task.dataset, records)
    seen = tuple(block.number for block in blocks if block.name in names)
    return Carried(
        blocks=blocks, seen=seen, fingerprints=stored_fingerprints(task.dataset)
    )


def stored_fingerprints(dataset: Dataset) -> tuple[Fingerprint, ...]:
    """Fingerprints of the recordings that carry a set of implants; none in older sets.

    Raises
    ------
    DatasetError    for fingerprints that are damaged
    """
    try:
        return fingerprints_from(read_config(dataset.folder).get(FINGERPRINTS, ()))
    except ValueError as error:
        raise DatasetError(f"{dataset.folder}: config.yaml: {error}") from None


def blocks_of(dataset: Dataset) -> tuple[Block, ...]:
    """Blocks that a data set was made of; none where it is no set of implants, or a stream."""
    manifest = getattr(dataset, "manifest", None)
    if manifest is None:
        return ()
    return read_blocks(manifest.configuration)


def _block_names(dataset: Dataset, records: NDArray[np.integer]) -> set[str]:
    """Names of the blocks that some records of a set of implants lie in."""
    units = np.asarray(dataset.column("unit_id"))[records]
    return {str(unit) for unit in units}


def refuse_seen(carried: Carried | None, dataset: Dataset, segments: Segments) -> None:
    """Refuse to score records whose carrier a network saw in its training.

    Raises
    ------
    DatasetError    with one line: how many records, of which stretch the first
    """
    if carried is None:
        return
    known = [block for block in carried.blocks if block.number in carried.seen]
    overlapping = {
        block.name: block
        for block, placed in _in_training(carried, dataset)
        if any(_overlap(placed, other) for other in known)
    }
    names = np.asarray(dataset.column("unit_id"))[segments.record]
    records = segments.record[np.isin(names, list(overlapping))]
    if not records.size:
        return
    first = overlapping[str(dataset.column("unit_id")[records[0]])]
    raise DatasetError(
        f"{dataset.folder}: {len(set(records.tolist()))} of {len(set(segments.record.tolist()))} "
        f"records lie on stretches that carried implants in the training of this model (samples "
        f"{first.start} to {first.stop} of {first.file}), and a score on them is memory; judge "
        "the test part of its own split, or implants in other recordings"
    )


def _in_training(carried: Carried, dataset: Dataset) -> list[tuple[Block, Block]]:
    """Blocks of a set of implants, each as it is and in the samples of a training's recordings."""
    blocks = blocks_of(dataset)
    pairs = [(block, block) for block in blocks]
    trained_on = {block.samples_sha256 for block in carried.blocks}
    others = {block.samples_sha256 for block in blocks} - trained_on
    if not (others and carried.fingerprints):
        return pairs
    prints = stored_fingerprints(dataset)
    for digest in others:
        asked = [each for each in prints if each.samples_sha256 == digest]
        for known in known_alike(asked, carried.fingerprints):
            pairs += [
                (block, _in_its_samples(block, known, asked[0].sampling_rate))
                for block in blocks
                if block.samples_sha256 == digest
            ]
    return pairs


def _in_its_samples(block: Block, known: Known, sampling_rate: float) -> Block:
    """A block in the samples of the known recording, without `SLACK` at both ends."""
    start = block.start / sampling_rate + known.delay + SLACK
    stop = block.stop / sampling_rate + known.delay - SLACK
    return replace(
        block,
        sha256=known.samples_sha256,
        samples_sha256=known.samples_sha256,
        start=round(start * known.sampling_rate),
        stop=round(stop * known.sampling_rate),
    )


def _overlap(block: Block, other: Block) -> bool:
    """True if two blocks share samples of one recording."""
    is_same = (
        block.sha256 == other.sha256 or block.samples_sha256 == other.samples_sha256
    )
    return is_same and block.start < other.stop and other.start < block.stop


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """Samples of a recording that carried nothing.

    Attributes
    ----------
    start, stop : samples, stop exclusive
    n_samples : of the whole recording
    sampling_rate : Hz
    """

    start: int
    stop: int
    n_samples: int
    sampling_rate: float

    @property
    def text(self) -> str:
        """Samples and seconds in words."""
        first, last = self.start / self.sampling_rate, self.stop / self.sampling_rate
        return f"samples {self.start} to {self.stop} ({first:.4g} to {last:.4g} s)"

    def facts(self) -> dict[str, Any]:
        """Plain values for ``diagnose predict --json``."""
        return {
            "start_sample": self.start,
            "stop_sample": self.stop,
            "start_s": self.start / self.sampling_rate,
            "stop_s": self.stop / self.sampling_rate,
            "n_samples_recorded": self.n_samples,
        }

    def of(self, recording: Recording) -> Recording:
        """The stretch of a recording, without its mean."""
        part = recording.acceleration[:, self.start : self.stop]
        return replace(recording, acceleration=part - part.mean(axis=1, keepdims=True))


def digests_of(file: str, *recordings: Recording) -> frozenset[str]:
    """Digests that a recording may be known by: of its file, and of its samples as read."""
    from gensig.dataset.storage.atomic import sha256_file

    samples = [samples_digest(recording) for recording in recordings]
    return frozenset([sha256_file(Path(file).expanduser()), *samples])


def held_out_stretch(
    carried: Carried,
    digests: frozenset[str],
    recording: Recording,
    *,
    file: str,
    held_out: bool,
) -> Stretch | None:
    """Samples of a recording that may be scored; None for all of one that carried nothing.

    Parameters
    ----------
    digests : of `digests_of`
    held_out : True if the stretch that was held out is asked for

    Raises
    ------
    DatasetError    for a recording that carried, unless its held-out stretch is asked for, and
        where nothing of it was held out
    """
    n_samples = recording.acceleration.shape[1]
    own = [
        replace(block, stop=min(block.stop, n_samples))
        for block in carried.of_recording(digests, recording)
        if block.start < min(block.stop, n_samples)
    ]
    n_carried = sum(block.stop - block.start for block in own if block.carries)
    if not n_carried:
        return None
    said = (
        f"{file}: {n_carried} of its {n_samples} samples ({n_carried / n_samples:.0%}) carried "
        "implants in the training of this model, and a score on them is memory"
    )
    last = max(block.stop for block in own if block.carries)
    free = [block for block in own if not block.carries and block.start >= last]
    if not free:
        raise DatasetError(f"{said}; none of it was held out: score another recording")
    stretch = Stretch(
        start=free[0].start,
        stop=_end_of_run(free),
        n_samples=n_samples,
        sampling_rate=recording.sampling_rate,
    )
    if not held_out:
        raise DatasetError(
            f"{said}; held out are its {stretch.text}: give {HELD_OUT} to score these alone"
        )
    return stretch


def _end_of_run(blocks: list[Block]) -> int:
    """Last sample of the blocks that follow one another without a gap."""
    stop = blocks[0].stop
    for block in blocks[1:]:
        if block.start > stop:
            break
        stop = max(stop, block.stop)
    return stop
