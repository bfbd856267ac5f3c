"""Records as sound: small WAV files for the page."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import FloatArray
from gensig.report.packing import COUNTS
from gensig.signals.resampling import rate_change

SOUND_RATE = 16_000  # Hz
SOUND_SECONDS = 1.0  # at most
LOUDEST = 0.9  # of full scale, the largest peak of a condition


def heard(signal: FloatArray, sampling_rate: float) -> FloatArray:
    """The first second of a signal (sample,) without its mean, at `SOUND_RATE`."""
    part = signal[: int(SOUND_SECONDS * sampling_rate)]
    return rate_change(sampling_rate, SOUND_RATE).apply(part - part.mean())


def sounds(parts: Sequence[FloatArray]) -> list[str]:
    """WAV files as data URIs, 16 bit, one channel, one scale for all.

    Parameters
    ----------
    parts : (sample,) each, of `heard`, of one condition and channel, so that their loudness can
        be compared
    """
    peak = max((float(np.abs(part).max(initial=0.0)) for part in parts), default=0.0)
    scale = LOUDEST * COUNTS / (peak or 1.0)
    return [wav_uri(np.rint(scale * part).astype("<i2")) for part in parts]


def wav_uri(counts: NDArray[np.int16]) -> str:
    """A WAV file of `SOUND_RATE` as data URI, from counts (sample,)."""
    from scipy.io import wavfile

    file = io.BytesIO()
    wavfile.write(file, SOUND_RATE, counts)
    return "data:audio/wav;base64," + base64.b64encode(file.getvalue()).decode("ascii")
