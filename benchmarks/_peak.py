"""The roof over the compiled core.

Vector additions and multiplications one core can do, and what a step needs.
"""

from __future__ import annotations

import time

import numpy as np

from benchmarks._rates import SAMPLING_RATE
from gensig.dynamics._vector import compiled, get_row, n_lanes, set_row

ROUNDS = 200_000
PER_ROUND = 32  # vector operations

# Counted by hand in the code of one step of a sound pair at the usual three followed pairs, a
# lane: the law of four stages 4 x (3 x 43 + 26), motion and accelerations 4 x 90, the sums of
# Runge-Kutta 4 x 72, both readings of the tables and the middle between them 3 x (32 + 24),
# what is set out once 60. Each square root, division or comparison as one.
OPERATIONS = 4 * (3 * 43 + 26) + 4 * 90 + 4 * 72 + 3 * (32 + 24) + 60
TABLE_BYTES = 3 * 64  # two rows of four numbers for each pair


@compiled
def _chains(numbers, rounds):
    """Eight independent chains of products and sums, two registers each."""
    factor, term = get_row(numbers, 0), get_row(numbers, 1)
    a, b, c, d = term, term, term, term
    e, f, g, h = factor, factor, factor, factor
    for _ in range(rounds):
        a, b, c, d = a * factor, b * factor, c * factor, d * factor
        e, f, g, h = e + term, f + term, g + term, h + term
        a, b, c, d = a + term, b + term, c + term, d + term
        e, f, g, h = e * factor, f * factor, g * factor, h * factor
        a, b, c, d = a * factor, b * factor, c * factor, d * factor
        e, f, g, h = e + term, f + term, g + term, h + term
        a, b, c, d = a + term, b + term, c + term, d + term
        e, f, g, h = e * factor, f * factor, g * factor, h * factor
    set_row(numbers, 2, ((a + b) + (c + d)) + ((e + f) + (g + h)))


def peak(runs: int, precision: str = "float64") -> float:
    """Additions and multiplications of one core without memory, 1e9 a CPU second.

    The most of several runs.
    """
    n = n_lanes(precision)
    numbers = np.concatenate([np.full(n, 0.999), np.full(n, 1e-3), np.zeros(n)]).astype(
        precision
    )
    _chains(numbers, 10)
    best = np.inf
    for _ in range(runs):
        begun = time.process_time()
        _chains(numbers, ROUNDS)
        best = min(best, time.process_time() - begun)
    return PER_ROUND * n * ROUNDS / best / 1e9


def roof(runs: int, oversampling: int) -> dict[str, float]:
    """The rate at which a core would do nothing but a step's operations, simulated s per core-s."""
    measured = peak(runs)
    return {
        "measured peak of a core, 1e9 vector operations a s": measured,
        "operations a step and record": OPERATIONS,
        "bytes of tables a step and record": TABLE_BYTES,
        f"roof at x{oversampling}, simulated s per core-s": measured
        * 1e9
        / (OPERATIONS * oversampling * SAMPLING_RATE),
    }
