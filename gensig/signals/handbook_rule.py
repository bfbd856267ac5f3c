"""Rule of thumb of handbooks: impulsive means one tooth, louder means many.

Kurtosis above 6 and a level of 3 dB above healthy are usual alarm limits; neither is derived. The
kurtosis of healthy machines is near 3: Dyer & Stewart (1978), J. Mechanical Design 100 (2),
229-235.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from gensig.signals.indicators import kurtosis, rms

HandbookState = Literal["healthy", "one_tooth", "many_teeth"]

MOST_KURTOSIS = 6.0  # assumed, as usual
MOST_LEVEL_DB = 3.0  # assumed, as usual: 1.4 times the healthy level


@dataclass(frozen=True, slots=True, kw_only=True)
class HandbookAnswer:
    """Answer of the rule, and the two numbers that it read.

    Attributes
    ----------
    state : "healthy", "one_tooth" or "many_teeth"
    kurtosis : of the signal, the largest of its channels
    level_db : RMS over healthy, of the channel in which it rose most
    """

    state: HandbookState
    kurtosis: float
    level_db: float


def handbook_rule(largest_kurtosis: float, level_db: float) -> HandbookState:
    """State of a gear by kurtosis and level.

    Parameters
    ----------
    largest_kurtosis : of the signal; 3 for Gaussian noise
    level_db : dB    RMS over that of the healthy machine

    Returns
    -------
    "one_tooth" above `MOST_KURTOSIS`, else "many_teeth" above `MOST_LEVEL_DB`, else "healthy"
    """
    if largest_kurtosis > MOST_KURTOSIS:
        return "one_tooth"
    if level_db > MOST_LEVEL_DB:
        return "many_teeth"
    return "healthy"


def handbook_answer(signal: ArrayLike, healthy_rms: ArrayLike) -> HandbookAnswer:
    """Answer of the rule for a signal.

    Parameters
    ----------
    signal : (channel, sample) or (sample,)
    healthy_rms : (channel,) or one number    RMS of the healthy machine, in the signal's unit

    Raises
    ------
    ValueError    for a healthy RMS that is not above 0
    """
    x = np.atleast_2d(np.asarray(signal, dtype=float))
    x = x - x.mean(axis=-1, keepdims=True)
    healthy = np.asarray(healthy_rms, dtype=float)
    if not np.all(healthy > 0.0):
        raise ValueError(f"healthy_rms must be above 0, not {healthy.min():g}")
    impulsive = float(np.nanmax(kurtosis(x), initial=0.0))
    rise = float(np.max(rms(x) / healthy))
    level_db = 20.0 * math.log10(max(rise, 1e-30))
    return HandbookAnswer(
        state=handbook_rule(impulsive, level_db), kurtosis=impulsive, level_db=level_db
    )
