"""Arrays as short text: base64 of little-endian bytes, which the page's script unpacks."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gensig.arrays import FloatArray

STEP_DB = 0.4  # of stored amplitudes: 5 % from one to the next, 102 dB in a byte
COUNTS = 32767


def packed(values: ArrayLike, dtype: str) -> str:
    """Values as base64 of the little-endian numpy type, flat."""
    little_endian = np.dtype(dtype).newbyteorder("<")
    content = np.ascontiguousarray(values, dtype=little_endian).tobytes()
    return base64.b64encode(content).decode()


def pack_floats(values: ArrayLike) -> str:
    """Values as float32; NaN stays NaN."""
    return packed(values, "f4")


def pack_signal(signal: FloatArray) -> dict[str, Any]:
    """A signal, (sample,), as 16-bit counts of `scale`."""
    scale = float(np.abs(signal).max(initial=0.0)) / COUNTS
    counts = np.rint(signal / (scale or 1.0))
    return {"scale": scale, "n": packed(counts, "i2")}


def pack_amplitude(amplitude: FloatArray) -> dict[str, Any]:
    """Amplitudes as bytes in steps of `STEP_DB`: 255 is the largest, 0 is all below the range.

    Parameters
    ----------
    amplitude : (...)    not negative

    Returns
    -------
    `top`, `step_db`, and `n`, the bytes in C order
    """
    top = float(amplitude.max(initial=0.0))
    relative = amplitude / (top or 1.0)
    with np.errstate(divide="ignore"):
        counts = 255.0 + np.rint(20.0 * np.log10(relative) / STEP_DB)
    return {"top": top, "step_db": STEP_DB, "n": packed(np.maximum(counts, 0.0), "u1")}
