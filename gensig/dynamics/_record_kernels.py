"""Compiled core: integration and low-pass of records, block by block."""

from __future__ import annotations

from typing import Any

from gensig.dynamics._vector import (
    at,
    compiled,
    get_row,
    plus_product,
    set_row,
    spread,
    width,
)

BLOCK = 64  # output samples between two passes of the low-pass, whose input is still in the cache
TOGETHER = 4  # samples of the low-pass that are summed side by side; divides BLOCK
# The low-pass of float64 motions, too: rounding adds noise of some 1e-7 of the signal, white, and
# the time is half.
LOW_PASS_PRECISION = "float32"


@compiled
def low_pass(means, first, taps, factor, n_channels, n_samples, out, out_row):
    """Every ``factor``-th value of the filtered series of every channel.

    ``means`` (step, channel, lane) and, from row ``out_row`` on, ``out`` (sample, channel, lane)
    are flat; ``first`` is the step at the first tap of the first sample. ``TOGETHER`` samples at a
    time share their input: ``taps`` are padded at both ends with as many zeros as the first and
    the last of these samples are apart.
    """
    apart = (TOGETHER - 1) * factor
    n_taps = len(taps) - 2 * apart
    for s in range(0, n_samples, TOGETHER):
        n_read = n_taps + (min(TOGETHER, n_samples - s) - 1) * factor
        for c in range(n_channels):
            zero = spread(means, 0.0)
            p, q, r, t = zero, zero, zero, zero
            for k in range(n_read):
                value = get_row(means, (first + s * factor + k) * n_channels + c)
                tap = apart + k
                p = plus_product(p, taps, tap, value)
                q = plus_product(q, taps, tap - factor, value)
                r = plus_product(r, taps, tap - 2 * factor, value)
                t = plus_product(t, taps, tap - 3 * factor, value)
            sample = (out_row + s) * n_channels + c
            set_row(out, sample, p)
            if s + 1 < n_samples:
                set_row(out, sample + n_channels, q)
            if s + 2 < n_samples:
                set_row(out, sample + 2 * n_channels, r)
            if s + 3 < n_samples:
                set_row(out, sample + 3 * n_channels, t)


def recorder(integrate: Any) -> Any:
    """Compiled function that integrates and decimates records by a core.

    ``integrate`` advances every lane of a group by ``n_steps`` and returns the next row of
    ``angle``. Its arguments follow ``group``, in this order:

    state : (2, dof, lane)    q and v, advanced in place; the pinion has also turned by
        ``wide[CENTER]``
    lost : (mesh, lane)       the number of steps without contact is added
    fresh : (lane,)           1 where the state is new: its tables are read first. 0 continues as
        if the last call of this group, step and scratch had not ended, so the ends of calls leave
        no trace
    step, first_step, n_steps : s, number of the first step since time 0, and how many
    channels : (channel,)     degrees of freedom
    out : (step, channel, lane)    takes, from row ``out_row`` on, the mean acceleration over each
        step: velocity gained by the equations, over the step. Kinks then alias far less than with
        point values. A negative row stores nothing
    angle : (sample, angle, lane)    takes, from row ``angle_row`` on, the angles in rad since time
        0 at the begin of every step whose number ``per_angle`` divides; a negative row stores
        nothing
    seen : (sample, N_SEEN, lane)    takes the state of the pairs at the same steps; may be empty
    work, wide, near : scratch of the method
    """

    @compiled
    def record(
        group,
        state,
        lost,
        fresh,
        step,
        first_step,
        n_before,
        n_samples,
        factor,
        taps,
        channels,
        out,
        angle,
        seen,
        means,
        narrow,
        work,
        wide,
        near,
    ):
        """Integrate ``n_before`` steps from ``first_step`` on, and then samples, if any.

        Samples are integrated and decimated block by block, so that the internal rate stays in
        the cache. ``out`` (lane, channel, sample) float64 takes ``n_samples``; the first tap of
        the first sample is at the step after those before. ``means`` is a scratch for the steps
        of a block, and ``narrow`` one of ``narrow_steps`` steps of ``step_rows`` rows, of which
        the last ``BLOCK`` take samples.
        """
        n, n_channels = width(work), len(channels)
        per_step, n_rows = n * n_channels, step_rows(n * n_channels, width(narrow))
        n_kept = len(taps) - (2 * TOGETHER - 1) * factor
        angle_row, now, done = 0, first_step, 0
        if n_samples == 0:
            angle_row = -1
        samples = n_kept + BLOCK * factor
        # steps before, the input of the first sample before its last steps, then block by block
        n_steps, out_row, first_row = n_before, -1, 0
        while True:
            angle_row = integrate(
                group,
                state,
                lost,
                fresh,
                step,
                now,
                n_steps,
                channels,
                means,
                out_row,
                angle,
                angle_row,
                factor,
                seen,
                work,
                wide,
                near,
            )
            now += n_steps
            for lane in range(n):
                fresh[lane] = 0.0
            if out_row == 0:
                _narrowed(means, n_steps, per_step, narrow, first_row, n_rows)
            if first_row == n_kept:
                n_block = n_steps // factor
                low_pass(narrow, 0, taps, factor, n_rows, n_block, narrow, samples)
                for lane in range(n):
                    for c in range(n_channels):
                        series = (lane * n_channels + c) * n_samples + done
                        for s in range(n_block):
                            sample = (samples + s) * n_rows * width(narrow)
                            out[series + s] = narrow[sample + at(c, lane, n)]
                for i in range(n_kept * n_rows):
                    set_row(narrow, i, get_row(narrow, n_steps * n_rows + i))
                done += n_block
            if done == n_samples:
                break
            if out_row < 0:
                n_steps, out_row = n_kept, 0
            else:
                n_steps, first_row = min(BLOCK, n_samples - done) * factor, n_kept

    return record


@compiled
def _narrowed(means, n_steps, per_step, narrow, first_step, n_rows):
    """Copy the numbers of steps to the rows of the low-pass, from a step of them on."""
    per_narrow = n_rows * width(narrow)
    for step in range(n_steps):
        source, target = step * per_step, (first_step + step) * per_narrow
        for i in range(per_step):
            narrow[target + i] = means[source + i]


@compiled
def step_rows(n_numbers, n_lanes):
    """Rows of the low-pass that take the channels of a step: two channels of float64 a row."""
    return -(-n_numbers // n_lanes)


def mean_steps(n_taps, factor):
    """Steps that ``record`` integrates at a time, at most, for padded taps."""
    return max(n_taps - (2 * TOGETHER - 1) * factor, BLOCK * factor)


def narrow_steps(n_taps, factor):
    """Steps and samples that ``record`` needs in the rows of its low-pass, for padded taps."""
    return n_taps - (2 * TOGETHER - 1) * factor + BLOCK * factor + BLOCK
