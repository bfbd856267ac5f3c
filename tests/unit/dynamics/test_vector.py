"""Vector values against numpy: also infinities, not-a-numbers, signed zeros and tiny numbers."""

import operator

import numpy as np
import pytest
from numba import njit

from gensig.dynamics._vector import (
    FOUR,
    PRECISIONS,
    any_above,
    at,
    get_row,
    load_four,
    n_lanes,
    second_and_fourth,
    set_row,
    spread,
    store,
    transpose,
    where_above,
    width,
)

N_GROUPS = 400
SPECIAL = [np.inf, -np.inf, np.nan, 0.0, -0.0, 1.0]
ODD = {
    "float64": [*SPECIAL, 5e-324, -1e-310, 1.7e308],
    "float32": [*SPECIAL, 1e-45, -1e-40, 3.4e38],
}
EXPONENTS = {"float64": 200, "float32": 25}
OPERATIONS = (
    operator.add,
    operator.sub,
    operator.mul,
    operator.truediv,
)
N_RESULTS = 13
COMPILED = njit(error_model="numpy")


def lane_by_lane(read, per_row, n):
    """Compiled operations that mix no lanes, on vectors of n; ``read`` counts in ``per_row``."""

    @COMPILED
    def every(rows, numbers, out, above):
        """``rows`` holds groups of four vectors; ``above`` takes any_above of a and b."""
        for k in range(len(above)):
            here = k * 4 * per_row
            there = k * N_RESULTS * n
            x = numbers[k]
            a = read(rows, here)
            b = read(rows, here + per_row)
            yes = read(rows, here + 2 * per_row)
            no = read(rows, here + 3 * per_row)
            results = (
                a + b,
                a - b,
                a * b,
                a / b,
                a + x,
                a - x,
                a * x,
                a / x,
                x + a,
                x - a,
                x * a,
                x / a,
                where_above(a, b, yes, no),
            )
            for row in range(N_RESULTS):
                store(out, there + row * n, results[row])
            above[k] = any_above(a, b)

    return every


SHAPES = {
    (name, shape): (lane_by_lane(*reading), reading[2])
    for name in PRECISIONS
    for shape, reading in (
        ("group", (get_row, 1, n_lanes(name))),
        ("row", (load_four, FOUR, FOUR)),
    )
}


@COMPILED
def move_row(values, source, target, out):
    set_row(out, target, get_row(values, source))


@COMPILED
def move_four(values, source, target, out):
    store(out, target, load_four(values, source))


@COMPILED
def transposed(rows, columns, picked):
    for k in range(0, len(rows), FOUR * FOUR):
        a = load_four(rows, k)
        b = load_four(rows, k + FOUR)
        c = load_four(rows, k + 2 * FOUR)
        d = load_four(rows, k + 3 * FOUR)
        results = transpose(a, b, c, d)
        for row in range(FOUR):
            store(columns, k + row * FOUR, results[row])
        store(picked, k // FOUR, second_and_fourth(a))


@COMPILED
def spread_over(value, out):
    store(out, 1, spread(out, value))
    return width(out), at(3, 2, 7)


@pytest.fixture(scope="module", params=PRECISIONS)
def precision(request):
    return request.param


def draw(precision, *size):
    """Random numbers, a third of them special."""
    rng = np.random.default_rng(4)
    reach = EXPONENTS[precision]
    values = rng.standard_normal(size) * 10.0 ** rng.integers(-reach, reach, size)
    return np.where(
        rng.random(size) < 0.3,
        rng.choice(ODD[precision], size),
        values,
    )


def compute(kind, rows, scalars):
    out = np.empty((len(rows), N_RESULTS, rows.shape[2]), dtype=kind[0])
    above = np.empty(len(rows), dtype=np.bool_)
    SHAPES[kind][0](
        rows.ravel(),
        scalars,
        out.ravel(),
        above,
    )
    return out.swapaxes(0, 1), above


def assert_same(numbers, expected):
    """Equal, of one type, zeros of the same sign; every not-a-number equals every other."""
    assert numbers.dtype == expected.dtype
    assert np.array_equal(numbers, expected, equal_nan=True)
    known = ~np.isnan(numbers)
    assert np.array_equal(np.signbit(numbers)[known], np.signbit(expected)[known])


@pytest.mark.parametrize("shape", ["group", "row"])
def test_operations_lane_by_lane(precision, shape):
    kind = precision, shape
    n = SHAPES[kind][1]
    rows = draw(precision, N_GROUPS, 4, n).astype(precision)
    scalars = draw(precision, N_GROUPS)
    rows[::5, 1] = rows[::5, 0]
    results, above = compute(kind, rows, scalars)
    a, b, yes, no = rows.swapaxes(0, 1)
    x = scalars.astype(precision)[:, None]  # a Python float is rounded first
    operands = (a, b), (a, x), (x, a)
    with np.errstate(all="ignore"):
        expected = [apply(*pair) for pair in operands for apply in OPERATIONS]
    for values, wanted in zip(
        results,
        [*expected, np.where(a > b, yes, no)],
        strict=True,
    ):
        assert_same(values, wanted)

    assert all(np.isnan(values).any() for values in (*expected, x))
    assert 0.2 < (a > b).mean() < 0.8
    assert above.tolist() == (a > b).any(axis=1).tolist()
    assert 0 < above.sum() < N_GROUPS

    tiniest = np.finfo(precision).smallest_subnormal
    for lane in range(n):
        others = np.delete(np.arange(n), lane)
        for value in (np.nan, np.inf):
            changed = rows.copy()
            changed[:, :, lane] = value
            beside = compute(kind, changed, scalars)[0]
            assert beside[..., others].tobytes() == results[..., others].tobytes()
        pair = np.zeros((2, 4, n), dtype=precision)
        pair[0, 0, lane] = tiniest
        pair[1, 1, lane] = 1.0
        assert compute(kind, pair, np.ones(2))[1].tolist() == [
            True,
            False,
        ]


def test_rows_of_four_are_transposed(precision):
    rows = draw(precision, N_GROUPS, FOUR, FOUR).astype(precision)
    columns = np.empty_like(rows)
    picked = np.empty_like(rows[:, 0])
    transposed(rows.ravel(), columns.ravel(), picked.ravel())

    assert_same(columns, rows.transpose(0, 2, 1))
    assert_same(picked, rows[:, 0, [1, 1, 3, 3]])


@pytest.mark.parametrize("move", [move_row, move_four])
def test_rows_move_anywhere(precision, move):
    """Rows count in groups, rows of four in numbers."""
    n = n_lanes(precision) if move is move_row else FOUR
    step = n if move is move_row else 1
    values = np.arange(5 * n, dtype=precision)
    for source in range(5):
        for target in range(5):
            out, expected = np.full((2, 5 * n), -1.0, dtype=precision)
            move(values, source, target, out)
            first = source * step
            expected[target * step : target * step + n] = values[first : first + n]
            assert out.tolist() == expected.tolist()


def test_a_vector_needs_an_array_of_its_kind(precision):
    (other,) = (name for name in PRECISIONS if name != precision)
    values = np.zeros(16, dtype=precision)
    out = np.full(16, 7.0, dtype=other)
    n = n_lanes(precision)
    for move, text in (
        (
            move_row,
            f"{precision}x{n} is no row of an array of {other}",
        ),
        (
            move_four,
            f"{precision}x{FOUR} does not fit an array of {other}",
        ),
    ):
        with pytest.raises(TypeError, match=text):
            move(values, 0, 0, out)

    assert (out == 7.0).all()


def test_a_number_is_spread_over_a_group_of_64_bytes(precision):
    n = 64 // np.dtype(precision).itemsize
    for value in ODD[precision]:
        out = np.full(n + 2, 7.0, dtype=precision)
        assert spread_over(value, out) == (n, 3 * 7 + 2)
        assert_same(
            out,
            np.array([7.0, *[value] * n, 7.0], dtype=precision),
        )
