"""Time blocks of healthy recordings: those that carry implants, and those held out.

A network that is scored on a stretch that carried in its training knows it by heart. So blocks are
cut first, every data set lists them, and `refuse_carried` refuses such a stretch.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from gensig.dataset.folder.joining import IMPLANTS
from gensig.errors import ConfigError, DatasetError
from gensig.implants.carriers import Carrier, samples_digest
from gensig.implants.gearing import Gearing
from gensig.signals.recording import Recording

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

# assumed: records of a block overlap, so that their starts differ
RECORDS_A_BLOCK = 2.0
WANTED_BLOCKS, FEWEST_BLOCKS = 20, 8
FEWEST_CARRYING = 5  # so that a split on new machines can be made
# of the slowest shaft, in a record
FEWEST_TURNS, MOST_TURNS = 3.0, 20.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A stretch of a healthy recording.

    Attributes
    ----------
    number : among all blocks, from 0
    recording : number of its recording
    file, sha256, samples_sha256 : of that recording
    start, stop : samples of it, stop exclusive
    carries : True if records of the set are made of it, False if it is held out
    """

    number: int
    recording: int
    file: str
    sha256: str
    samples_sha256: str
    start: int
    stop: int
    carries: bool

    @property
    def name(self) -> str:
        """Name as a unit of a data set."""
        return f"block-{self.number:04d}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Cut:
    """Recordings cut into blocks: the blocks, and the samples of a record."""

    blocks: tuple[Block, ...]
    n_samples: int

    @property
    def carrying(self) -> tuple[Block, ...]:
        """Blocks that carry."""
        return tuple(block for block in self.blocks if block.carries)


def cut_blocks(
    carriers: Sequence[Carrier],
    gearing: Gearing,
    *,
    duration: float | None,
    held_out: float,
) -> Cut:
    """Recordings cut in time, the last blocks of each held out.

    Parameters
    ----------
    duration : s    of a record, half a block; None makes about 20 blocks of 3 to 20 turns of the
        slowest shaft a record
    held_out : share of the blocks of each recording that are held out

    Raises
    ------
    ConfigError    for a duration of too few turns, and for too few blocks
    """
    rate = carriers[0].recording.sampling_rate
    lengths = [carrier.recording.acceleration.shape[1] for carrier in carriers]
    slow = min(
        carrier.speed_rpm(0, n) for carrier, n in zip(carriers, lengths, strict=True)
    )
    turn = 60.0 / (slow * gearing.slowest)
    n_samples = math.ceil(rate * _duration(duration, turn, sum(lengths) / rate))
    n_block = math.ceil(RECORDS_A_BLOCK * n_samples)
    counts = [length // n_block for length in lengths]
    n_out = [math.floor(held_out * count + 0.5) for count in counts]
    if not any(n_out):
        n_out[counts.index(max(counts))] = 1
    if sum(counts) < FEWEST_BLOCKS or sum(counts) - sum(n_out) < FEWEST_CARRYING:
        raise ConfigError(
            f"too few blocks: {sum(lengths) / rate:.3g} s of recordings are {sum(counts)} blocks "
            f"of {n_block / rate:.3g} s, {sum(counts) - sum(n_out)} of them to carry; "
            f"{FEWEST_BLOCKS} and {FEWEST_CARRYING} are needed: record longer, give more "
            "recordings, a shorter --duration, or a smaller --held-out"
        )
    blocks: list[Block] = []
    for index, carrier in enumerate(carriers):
        for k in range(counts[index]):
            block = Block(
                number=len(blocks),
                recording=index,
                file=carrier.name,
                sha256=carrier.sha256,
                samples_sha256=carrier.samples_sha256,
                start=k * n_block,
                stop=(k + 1) * n_block,
                carries=k < counts[index] - n_out[index],
            )
            blocks.append(block)
    return Cut(blocks=tuple(blocks), n_samples=n_samples)


def _duration(wanted: float | None, turn: float, total: float) -> float:
    """Length of a record, s; ``turn`` and ``total`` are of the slowest shaft, of all recordings."""
    if wanted is None:
        even = total / (WANTED_BLOCKS * RECORDS_A_BLOCK)
        return min(max(even, FEWEST_TURNS * turn), MOST_TURNS * turn)
    if wanted < FEWEST_TURNS * turn:
        raise ConfigError(
            f"--duration {wanted:g} s is {wanted / turn:.2g} turns of the slowest shaft; "
            f"at least {FEWEST_TURNS:g} are needed, {FEWEST_TURNS * turn:.3g} s"
        )
    return wanted


def blocks_content(blocks: Sequence[Block]) -> list[dict[str, Any]]:
    """Blocks as the configuration of a set holds them."""
    return [
        {
            "number": block.number,
            "recording": block.recording,
            "file": block.file,
            "sha256": block.sha256,
            "samples_sha256": block.samples_sha256,
            "start_sample": block.start,
            "stop_sample": block.stop,
            "carries": block.carries,
        }
        for block in blocks
    ]


def read_blocks(data: Dataset | Mapping[str, Any]) -> tuple[Block, ...]:
    """Blocks that a set of implants was made of; none for any other data set.

    Parameters
    ----------
    data : open data set, or its configuration

    Raises
    ------
    DatasetError    for a list of blocks that is damaged
    """
    content = data
    if not isinstance(content, Mapping):
        content = content.manifest.configuration
    section = content.get(IMPLANTS)
    if section is None:
        return ()
    try:
        return tuple(
            Block(
                number=int(entry["number"]),
                recording=int(entry["recording"]),
                file=str(entry["file"]),
                sha256=str(entry["sha256"]),
                samples_sha256=str(entry["samples_sha256"]),
                start=int(entry["start_sample"]),
                stop=int(entry["stop_sample"]),
                carries=bool(entry["carries"]),
            )
            for entry in section["blocks"]
        )
    except (KeyError, TypeError, ValueError) as error:
        raise DatasetError(
            f"the list of blocks is damaged ({type(error).__name__}: {error}); restore the "
            "configuration from a copy"
        ) from error


def refuse_carried(
    blocks: Sequence[Block],
    recording: Recording | str,
    *,
    start: int = 0,
    stop: int | None = None,
    name: str = "the recording",
) -> None:
    """Raise DatasetError where a stretch that is to be scored carried implants.

    A network trained on implants knows the stretches that carried them: a score on one says
    nothing.

    Parameters
    ----------
    blocks : of `read_blocks`, of the set that the network was trained on
    recording : a whole recording with the channels of the set, or its file's sha256
    start, stop : samples of it that are to be scored, stop exclusive; None is its end
    name : of the recording, for the message

    Raises
    ------
    DatasetError    with one line, which names the first block and the stretches held out
    """
    digest = recording
    if isinstance(recording, Recording):
        digest = samples_digest(recording)
    own = [block for block in blocks if digest in (block.sha256, block.samples_sha256)]
    last = math.inf if stop is None else stop
    for block in own:
        if not (block.carries and start < block.stop and block.start < last):
            continue
        free = [each for each in own if not each.carries]
        remedy = "none of it was held out: score another recording"
        if free:
            parts = ", ".join(f"{each.start} to {each.stop}" for each in free[:4])
            remedy = f"held out are its samples {parts}"
        raise DatasetError(
            f"{name}: samples {block.start} to {block.stop} carried implants in the training, and "
            f"a score on them is memory; {remedy}"
        )
