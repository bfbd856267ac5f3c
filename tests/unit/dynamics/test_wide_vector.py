"""Vectors of the two-evaluation core against numpy: float64 halves, table cells, products."""

import numpy as np
import pytest
from numba import njit

from gensig.dynamics._vector import (
    EIGHT,
    GROUP_BYTES,
    aligned,
    cells,
    fused,
    get_row,
    joined,
    load_wide,
    lower,
    n_lanes,
    set_row,
    store,
    truncated,
    upper,
)

PRECISIONS = pytest.mark.parametrize("precision", ["float64", "float32"])
COMPILED = njit(error_model="numpy")


@COMPILED
def halves(row, wide, result):
    """Both halves of a row to float64, and half of them back to a row."""
    low, high = lower(get_row(row, 0)), upper(get_row(row, 0))
    store(wide, 0, low)
    store(wide, EIGHT, high)
    set_row(result, 0, joined(result, 0.5 * low, 0.5 * high))


@COMPILED
def cut(values, result):
    """Eight numbers without their fractions."""
    store(result, 0, truncated(load_wide(values, 0)))


@COMPILED
def columns(table, indices, result):
    """The cells of a table that begin at the lanes' indices."""
    last = len(indices) - EIGHT
    found = cells(table, load_wide(indices, 0), load_wide(indices, last))
    for k in range(EIGHT):
        set_row(result, k, found[k])


@COMPILED
def products(rows, result):
    """a * b + c of rows, and with a number for a."""
    a, b, c = get_row(rows, 0), get_row(rows, 1), get_row(rows, 2)
    set_row(result, 0, fused(a, b, c))
    set_row(result, 1, fused(0.1, b, c))


@PRECISIONS
def test_halves_of_a_row_in_float64(precision):
    n = n_lanes(precision)
    row = np.random.default_rng(0).normal(size=n).astype(precision)
    wide, result = np.empty(2 * EIGHT), np.empty(n, dtype=precision)
    halves(row, wide, result)
    expected = np.concatenate([row[:EIGHT], row[-EIGHT:]])
    assert wide.tolist() == expected.astype(float).tolist()
    assert result.tolist() == (0.5 * row).tolist()


def test_fractions_are_cut_towards_zero():
    values = np.array([0.0, 0.9, -0.9, 7.0, 1e9 + 0.5, -3.2, 1e300, np.inf])
    result = np.empty(EIGHT)
    cut(values, result)
    assert result.tolist() == np.trunc(values).tolist()


@PRECISIONS
def test_cells_are_read_lane_by_lane(precision):
    n = n_lanes(precision)
    table = np.arange(1000).astype(precision)
    indices = np.random.default_rng(1).integers(0, 1000 - EIGHT, n).astype(float)
    result = np.empty((EIGHT, n), dtype=precision)
    columns(table, indices, result.ravel())
    expected = indices.astype(int) + np.arange(EIGHT)[:, None]
    assert result.tolist() == table[expected].tolist()


@PRECISIONS
def test_products_are_rounded_once(precision):
    n = n_lanes(precision)
    rows = np.random.default_rng(2).normal(size=(3, n)).astype(precision)
    rows[2] = -rows[0] * rows[1]  # what is left is the rounding of the product
    result = np.empty((2, n), dtype=precision)
    products(rows.ravel(), result.ravel())
    exact = rows.astype(np.longdouble)
    expected = (exact[0] * exact[1] + exact[2]).astype(precision)
    if precision == "float32":
        assert result[0].tolist() == expected.tolist()
    assert np.abs(result[0]).max() > 0.0
    twice = rows[0] * rows[1] + rows[2]
    assert np.abs(twice).max() == 0.0
    tenth = np.array(0.1, dtype=precision)
    close = np.abs(result[1] - (tenth * rows[1] + rows[2]))
    assert close.max() < 4.0 * np.finfo(precision).eps


@PRECISIONS
def test_copies_begin_at_a_cache_line(precision):
    values = np.random.default_rng(3).normal(size=(5, 7)).astype(precision)
    copy = aligned(values)
    assert copy.ctypes.data % GROUP_BYTES == 0
    assert copy.tolist() == values.tolist()
    assert copy.dtype == values.dtype
    assert copy.flags.c_contiguous
