"""Fingerprints of recordings: a part of one is known again by its noise, whatever its form.

A fingerprint holds the signs of the whitened signal at one low rate, in pieces of half a second.
Gain, unit, sign, offset, sampling rate, rounding and length do not matter. Shaft and mesh orders
of a machine sound alike in all its recordings; whitening leaves them as little as any other band.
"""

from __future__ import annotations

import base64
import binascii
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Array
from gensig.signals.recording import Recording
from gensig.signals.resampling import rate_change

Signs = NDArray[np.int8]

RATE = 4000.0  # Hz; carriers have 5 kHz or more
BAND = (60.0, 1500.0)  # Hz, below the low-pass of that rate
PIECE = 2000  # signs
WHITENING = 2048  # taps: 2 Hz, finer than the distance of two shaft orders
LEAST_POWER = 1e-9  # of the strongest band
FRAME = 8192  # signs compared in one transform
MOST_FRAMES = 64  # of a recording that is asked for
MOST_PIECES = 768  # stored, of all channels of all recordings: 192 kB
MOST_CHANNELS = 8
# Likeness of two pieces: signs alike less signs unlike, over all. docs/howto/bridge.md says how
# often other recordings of a machine reach it. It grows by what a recording has with itself.
ALIKE, MARGIN = 0.35, 0.1
MOST_ELSEWHERE = 32  # pieces compared with other places of their recording
SAME_DELAY = 1e-3  # s, four signs: places are rounded to one
MOST_SIGNS = 2**40


@dataclass(frozen=True, slots=True, kw_only=True)
class Fingerprint:
    """Whitened signs of one channel of a recording.

    Attributes
    ----------
    samples_sha256 : of the samples of the recording, as `gensig.implants.carriers` has it
    sampling_rate : Hz    of the recording
    first : number of the first sign of each piece
    packed : bits of the signs of all pieces, 1 for a positive sign
    least : likeness of a piece from which it counts as known again
    """

    samples_sha256: str
    sampling_rate: float
    first: tuple[int, ...]
    packed: bytes
    least: float

    def __post_init__(self) -> None:
        if not self.least >= ALIKE:  # nan too
            raise ValueError(f"a fingerprint is known from a likeness of {self.least}")
        if 8 * len(self.packed) != len(self.first) * PIECE:
            raise ValueError("a fingerprint has other pieces than it says")
        if any(not 0 <= first < MOST_SIGNS for first in self.first):
            raise ValueError("a piece of a fingerprint begins nowhere in its recording")
        if not 0 < self.sampling_rate < np.inf:
            raise ValueError("a fingerprint has no sampling rate")

    @property
    def pieces(self) -> Signs:
        """Signs (piece, sign), -1 or 1."""
        bits = np.unpackbits(np.frombuffer(self.packed, dtype=np.uint8))
        return (2 * bits.astype(np.int8) - 1).reshape(-1, PIECE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """A stretch of one recording that was found in another.

    Attributes
    ----------
    samples_sha256, sampling_rate : of the recording whose fingerprint it is
    delay : s    time of that recording at the first sample of the other
    alike : share of equal signs less that of others, of the piece that is most alike
    """

    samples_sha256: str
    sampling_rate: float
    delay: float
    alike: float


def whitened_signs(signal: Array, sampling_rate: float) -> Signs:
    """Signs (sign,) of a signal (sample,) at `RATE`, all bands of `BAND` made equally strong.

    The power is that of the whole signal (Welch), so that lines count no more than noise.
    """
    from scipy.signal import oaconvolve, welch

    centered = signal - signal.mean()
    slow = rate_change(sampling_rate, RATE).apply(centered)
    n_taps = min(WHITENING, slow.size)
    if n_taps < 2:
        return np.ones(slow.size, dtype=np.int8)
    frequency, power = welch(slow, RATE, nperseg=n_taps)
    is_heard = (frequency >= BAND[0]) & (frequency <= BAND[1])
    floor = LEAST_POWER * power[is_heard].max(initial=0.0) + np.finfo(float).tiny
    gain = np.where(is_heard, 1.0 / np.sqrt(np.maximum(power, floor)), 0.0)
    response = np.roll(np.fft.irfft(gain, n_taps), n_taps // 2) * np.hanning(n_taps)
    white = oaconvolve(slow, response, mode="same")
    return np.where(white < 0, -1, 1).astype(np.int8)


def fingerprints_of(
    recordings: Mapping[str, Recording], most: int = MOST_PIECES
) -> tuple[Fingerprint, ...]:
    """Fingerprint of every channel of some recordings.

    Parameters
    ----------
    recordings : by the sha256 of their samples
    most : pieces of all of them; where there are more, evenly spread ones are kept
    """
    signs = [
        (
            digest,
            recording.sampling_rate,
            whitened_signs(channel, recording.sampling_rate),
        )
        for digest, recording in recordings.items()
        for channel in recording.acceleration[:MOST_CHANNELS]
    ]
    n_pieces = sum(each.size // PIECE for _, _, each in signs)
    step = max(1.0, n_pieces / most)
    made = []
    for digest, rate, each in signs:
        numbers = np.arange(0.0, each.size // PIECE, step).astype(int)
        first = tuple(int(number) * PIECE for number in numbers)
        rows = [each[start : start + PIECE] for start in first]
        pieces = np.array(rows, dtype=np.int8).reshape(-1, PIECE)
        made.append(
            Fingerprint(
                samples_sha256=digest,
                sampling_rate=rate,
                first=first,
                packed=np.packbits(pieces > 0).tobytes(),
                least=max(ALIKE, _elsewhere(each, first, pieces) + MARGIN),
            )
        )
    return tuple(made)


def _elsewhere(signs: Signs, first: Sequence[int], pieces: Signs) -> float:
    """Likeness of pieces of a recording to other places of it, the greatest of all.

    What two recordings of a steady machine share, two parts of one recording share too.
    """
    from scipy import fft

    chosen = np.arange(0.0, len(first), max(1.0, len(first) / MOST_ELSEWHERE))
    begin = np.array(first, dtype=np.int64)[chosen.astype(int)]
    spectra = fft.rfft(pieces[chosen.astype(int)].astype(np.float32), FRAME).conj()
    lag, most = np.arange(FRAME - PIECE + 1), 0.0
    for start, frame in _frames([(0, signs)]):
        alike = np.abs(fft.irfft(spectra * frame, FRAME)[:, : lag.size])
        is_own = np.abs(begin[:, None] - start - lag) < PIECE
        most = max(most, float(alike[~is_own].max(initial=0.0)) / PIECE)
    return most


def known_in(
    recording: Recording, fingerprints: Sequence[Fingerprint]
) -> tuple[Known, ...]:
    """Recordings that a recording holds a part of, with the delay of each part."""
    frames = [
        frame
        for channel in recording.acceleration
        for frame in _frames([(0, whitened_signs(channel, recording.sampling_rate))])
    ]
    return _found(frames, fingerprints)


def known_alike(
    asked: Sequence[Fingerprint], fingerprints: Sequence[Fingerprint]
) -> tuple[Known, ...]:
    """The same for one recording of which only the fingerprints of its channels are there."""
    frames = [frame for each in asked for frame in _frames(_runs(each))]
    return _found(frames, fingerprints)


def _runs(fingerprint: Fingerprint) -> list[tuple[int, Signs]]:
    """Pieces that follow one another as one, each with the number of its first sign."""
    first = np.array(fingerprint.first, dtype=np.int64)
    ends = np.flatnonzero(np.diff(first) != PIECE) + 1
    rows = np.split(fingerprint.pieces, ends)
    return [
        (int(start[0]), part.ravel())
        for start, part in zip(np.split(first, ends), rows, strict=True)
        if start.size
    ]


def _frames(runs: Sequence[tuple[int, Signs]]) -> list[tuple[int, Array]]:
    """First sign and transform of each frame; at most `MOST_FRAMES`, evenly spread.

    Half a piece of zeros before and after a run lets a piece reach over its ends.
    """
    cut = []
    for first, signs in runs:
        padded = np.pad(signs.astype(np.float32), PIECE // 2)
        for start in range(0, max(padded.size - PIECE, 1), FRAME - PIECE):
            cut.append((first + start - PIECE // 2, padded[start : start + FRAME]))
    from scipy import fft

    step = max(1.0, len(cut) / MOST_FRAMES)
    chosen = np.arange(0.0, len(cut), step).astype(int)
    return [(cut[k][0], fft.rfft(cut[k][1], FRAME)) for k in chosen]


def _found(
    frames: Sequence[tuple[int, Array]], fingerprints: Sequence[Fingerprint]
) -> tuple[Known, ...]:
    """Stretches of the fingerprints in some frames, the most alike first."""
    from scipy import fft

    found: list[Known] = []
    for fingerprint in fingerprints:
        if not fingerprint.first:
            continue
        pieces = fft.rfft(fingerprint.pieces.astype(np.float32), FRAME).conj()
        for start, frame in frames:
            alike = np.abs(fft.irfft(pieces * frame, FRAME)[:, : FRAME - PIECE + 1])
            place = alike.argmax(axis=1)
            most = alike[np.arange(place.size), place] / PIECE
            for piece in np.flatnonzero(most >= fingerprint.least):
                delay = fingerprint.first[piece] - start - int(place[piece])
                one = Known(
                    samples_sha256=fingerprint.samples_sha256,
                    sampling_rate=fingerprint.sampling_rate,
                    delay=delay / RATE,
                    alike=float(most[piece]),
                )
                found.append(one)
    return _distinct(sorted(found, key=lambda known: -known.alike))


def _distinct(found: Sequence[Known]) -> tuple[Known, ...]:
    """Stretches of different recordings or delays; the first of those that agree."""
    kept: list[Known] = []
    for one in found:
        agrees = any(
            other.samples_sha256 == one.samples_sha256
            and abs(other.delay - one.delay) <= SAME_DELAY
            for other in kept
        )
        if not agrees:
            kept.append(one)
    return tuple(kept)


def fingerprints_content(
    fingerprints: Sequence[Fingerprint],
) -> list[dict[str, Any]]:
    """Fingerprints as plain values; signs as bits, in base64."""
    return [
        {
            "samples_sha256": each.samples_sha256,
            "sampling_rate_hz": each.sampling_rate,
            "least": each.least,
            "first": list(each.first),
            "pieces": base64.b64encode(each.packed).decode(),
        }
        for each in fingerprints
    ]


def fingerprints_from(content: Sequence[Mapping[str, Any]]) -> tuple[Fingerprint, ...]:
    """Fingerprints from plain values.

    Raises
    ------
    ValueError    for values that are none, and for more pieces than `MOST_PIECES`
    """
    try:
        made = tuple(_from_values(each) for each in content)
    except (AttributeError, KeyError, TypeError, binascii.Error) as error:
        raise ValueError(f"its fingerprints are damaged: {error}") from None
    if sum(len(each.first) for each in made) > MOST_PIECES + len(made):
        raise ValueError(f"its fingerprints have more than {MOST_PIECES} pieces")
    return made


def _from_values(values: Mapping[str, Any]) -> Fingerprint:
    return Fingerprint(
        samples_sha256=str(values["samples_sha256"]),
        sampling_rate=float(values["sampling_rate_hz"]),
        first=tuple(int(number) for number in values["first"]),
        packed=base64.b64decode(values["pieces"], validate=True),
        least=float(values["least"]),
    )
