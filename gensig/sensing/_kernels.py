"""Compiled low-pass and decimation of records side by side."""

from __future__ import annotations

from gensig.dynamics._vector import LANES, compiled, load, spread, store


@compiled
def low_pass(means, taps, first, factor, n_steps, n_samples, out):
    """Every ``factor``-th value of the filtered series of one channel.

    ``means`` (step, lane) and ``out`` (sample, lane) flat; ``first`` is the step under the first tap of the first
    sample. Four partial sums, always in the same order.
    """
    n_taps = len(taps)
    for s in range(n_samples):
        base = (first + s * factor) * LANES
        a, b, c, d = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
        for k in range(0, n_taps - 3, 4):
            here = base + k * LANES
            a = a + spread(taps[k]) * load(means, here)
            b = b + spread(taps[k + 1]) * load(means, here + LANES)
            c = c + spread(taps[k + 2]) * load(means, here + 2 * LANES)
            d = d + spread(taps[k + 3]) * load(means, here + 3 * LANES)
        for k in range(n_taps - n_taps % 4, n_taps):
            a = a + spread(taps[k]) * load(means, base + k * LANES)
        store(out, s * LANES, (a + b) + (c + d))
