"""Vector values against numpy, lane by lane: also infinities, not-a-numbers, zeros of both signs, and tiny numbers."""

import operator

import numpy as np
import pytest
from numba import njit

from gensig.dynamics._vector import (
    FOUR,
    LANES,
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
ODD = {"float64": [np.inf, -np.inf, np.nan, 0.0, -0.0, 5e-324, -1e-310, 1.7e308, -1.7e308, 1.0],
       "float32": [np.inf, -np.inf, np.nan, 0.0, -0.0, 1e-45, -1e-40, 3.4e38, -3.4e38, 1.0]}  # fmt: skip
EXPONENTS = {"float64": 200, "float32": 25}
OPERATIONS = {
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "truediv": operator.truediv,
}
COMPILED = njit(error_model="numpy")
CHOICE, N_LANE_BY_LANE = (
    12,
    13,
)  # results before: two vectors, vector and number, number and vector


def lane_by_lane(read, per_row, n):
    """Every operation that mixes no lanes, on vectors of n; ``read`` counts rows, or numbers if ``per_row`` is n."""

    @COMPILED
    def every(rows, numbers, out, above):
        """``rows`` holds groups of four vectors; ``above`` takes whether a > b anywhere."""
        for k in range(len(above)):
            here, there, x = k * 4 * per_row, k * N_LANE_BY_LANE * n, numbers[k]
            a, b = read(rows, here), read(rows, here + per_row)
            store(out, there, a + b)
            store(out, there + n, a - b)
            store(out, there + 2 * n, a * b)
            store(out, there + 3 * n, a / b)
            store(out, there + 4 * n, a + x)
            store(out, there + 5 * n, a - x)
            store(out, there + 6 * n, a * x)
            store(out, there + 7 * n, a / x)
            store(out, there + 8 * n, x + a)
            store(out, there + 9 * n, x - a)
            store(out, there + 10 * n, x * a)
            store(out, there + 11 * n, x / a)
            store(
                out,
                there + 12 * n,
                where_above(
                    a, b, read(rows, here + 2 * per_row), read(rows, here + 3 * per_row)
                ),
            )
            above[k] = any_above(a, b)

    return every


EVERY = {
    (precision, shape): lane_by_lane(*of)
    for precision in PRECISIONS
    for shape, of in (
        ("group", (get_row, 1, n_lanes(precision))),
        ("row", (load_four, FOUR, FOUR)),
    )
}


@COMPILED
def move(values, source, target, out):
    set_row(out, target, get_row(values, source))


@COMPILED
def place_of(row, lane, n):
    return at(row, lane, n)


@COMPILED
def move_four(values, source, target, out):
    store(out, target, load_four(values, source))


@COMPILED
def rows_of_four(rows, columns, picked):
    for k in range(0, len(rows), FOUR * FOUR):
        a, b = load_four(rows, k), load_four(rows, k + FOUR)
        c, d = load_four(rows, k + 2 * FOUR), load_four(rows, k + 3 * FOUR)
        first, second, third, fourth = transpose(a, b, c, d)
        store(columns, k, first)
        store(columns, k + FOUR, second)
        store(columns, k + 2 * FOUR, third)
        store(columns, k + 3 * FOUR, fourth)
        store(picked, k, second_and_fourth(a))
        store(picked, k + FOUR, second_and_fourth(b))
        store(picked, k + 2 * FOUR, second_and_fourth(c))
        store(picked, k + 3 * FOUR, second_and_fourth(d))


@COMPILED
def spread_over(value, out):
    store(out, 1, spread(out, value))


@COMPILED
def asked_width(values):
    return width(values)


@pytest.fixture(scope="module", params=PRECISIONS)
def precision(request):
    return request.param


@pytest.fixture(scope="module", params=["group", "row"])
def shape(request):
    return request.param


@pytest.fixture(scope="module")
def numbers(precision):
    """Draws numbers, a third of them odd."""
    rng, reach = np.random.default_rng(4), EXPONENTS[precision]

    def draw(*size):
        values = rng.standard_normal(size) * 10.0 ** rng.integers(-reach, reach, size)
        return np.where(
            rng.random(size) < 0.3, rng.choice(ODD[precision], size), values
        )

    return draw


@pytest.fixture(scope="module")
def rows(precision, shape, numbers):
    """(group, a to d, lane); some of a equal to b."""
    values = numbers(
        N_GROUPS, 4, n_lanes(precision) if shape == "group" else FOUR
    ).astype(precision)
    values[::5, 1] = values[::5, 0]
    return values


@pytest.fixture(scope="module")
def scalars(numbers):
    """One float64 for every group."""
    return numbers(N_GROUPS)


@pytest.fixture(scope="module")
def compute(precision, shape):
    def results(rows, scalars):
        out = np.empty((len(rows), N_LANE_BY_LANE, rows.shape[2]), dtype=precision)
        above = np.empty(len(rows), dtype=np.bool_)
        EVERY[precision, shape](rows.ravel(), scalars, out.ravel(), above)
        return out, above

    return results


@pytest.fixture(scope="module")
def found(compute, rows, scalars):
    return compute(rows, scalars)


def same_numbers(one, two):
    """Equal and of one kind, zeros of the same sign; one not-a-number is as good as another."""
    return (
        one.dtype == two.dtype
        and np.array_equal(one, two, equal_nan=True)
        and np.array_equal(
            np.signbit(one)[~np.isnan(one)], np.signbit(two)[~np.isnan(two)]
        )
    )


def test_a_group_is_64_bytes_wide():
    assert {name: n_lanes(name) for name in PRECISIONS} == {"float64": 8, "float32": 16}
    assert n_lanes("float64") == LANES


@pytest.mark.parametrize(("place", "name"), list(enumerate(OPERATIONS)))
def test_arithmetic(rows, found, place, name):
    with np.errstate(all="ignore"):
        expected = OPERATIONS[name](rows[:, 0], rows[:, 1])
    assert same_numbers(found[0][:, place], expected)
    assert np.isnan(expected).any()
    assert np.isinf(expected).any()


@pytest.mark.parametrize(("place", "name"), list(enumerate(OPERATIONS)))
def test_arithmetic_with_a_number_on_either_side(rows, scalars, found, place, name):
    """A Python float is rounded to the vector's kind first."""
    with np.errstate(all="ignore"):
        x = scalars.astype(rows.dtype)[:, None]
        right, left = OPERATIONS[name](rows[:, 0], x), OPERATIONS[name](x, rows[:, 0])
    assert same_numbers(found[0][:, 4 + place], right)
    assert same_numbers(found[0][:, 8 + place], left)
    assert np.isnan(x).any()
    assert np.isinf(x).any()


def test_where_above(rows, found):
    a, b, yes, no = rows.transpose(1, 0, 2)
    assert same_numbers(found[0][:, CHOICE], np.where(a > b, yes, no))
    assert 0.2 < (a > b).mean() < 0.8


def test_any_above(rows, found):
    expected = (rows[:, 0] > rows[:, 1]).any(axis=1)
    assert found[1].tolist() == expected.tolist()
    assert 0 < expected.sum() < N_GROUPS


def test_any_above_sees_every_lane(compute, rows, precision):
    tiniest = np.finfo(precision).smallest_subnormal
    for lane in range(rows.shape[2]):
        some = np.zeros((2, 4, rows.shape[2]), dtype=precision)
        some[0, 0, lane], some[1, 1, lane] = tiniest, 1.0
        assert compute(some, np.ones(2))[1].tolist() == [True, False]


def test_rows_of_four(precision, numbers):
    rows = numbers(N_GROUPS, FOUR, FOUR).astype(precision)
    columns, picked = np.empty_like(rows), np.empty_like(rows)
    rows_of_four(rows.ravel(), columns.ravel(), picked.ravel())
    assert same_numbers(columns, rows.transpose(0, 2, 1))
    assert same_numbers(picked, rows[..., [1, 1, 3, 3]])


def test_rows_of_four_move_wherever_they_lie(precision):
    values = np.arange(FOUR + 8, dtype=precision)
    for source in range(9):
        for target in range(9):
            out = np.full(FOUR + 8, -1.0, dtype=precision)
            move_four(values, source, target, out)
            expected = np.full(FOUR + 8, -1.0)
            expected[target : target + FOUR] = values[source : source + FOUR]
            assert out.tolist() == expected.tolist()


def test_rows_move_as_rows_of_a_table(precision):
    """Row and place are those of numpy's (row, lane)."""
    n = n_lanes(precision)
    values = np.arange(5 * n, dtype=precision).reshape(5, n)
    for source in range(5):
        for target in range(5):
            out = np.full((5, n), -1.0, dtype=precision)
            move(values.ravel(), source, target, out.ravel())
            expected = np.full((5, n), -1.0)
            expected[target] = values[source]
            assert out.tolist() == expected.tolist()
        for lane in range(n):
            assert values.ravel()[place_of(source, lane, n)] == values[source, lane]


def test_a_vector_goes_into_an_array_of_its_own_kind_only(precision):
    (other,) = (name for name in PRECISIONS if name != precision)
    values, out = np.zeros(16, dtype=precision), np.full(16, 7.0, dtype=other)
    with pytest.raises(
        TypeError,
        match=f"{precision}x{n_lanes(precision)} is no row of an array of {other}",
    ):
        move(values, 0, 0, out)
    with pytest.raises(
        TypeError, match=f"{precision}x{FOUR} does not fit an array of {other}"
    ):
        move_four(values, 0, 0, out)
    assert (out == 7.0).all()


def test_width(precision):
    assert asked_width(np.empty(0, dtype=precision)) == n_lanes(precision)


@pytest.mark.parametrize("place", range(len(ODD["float64"])))
def test_spread(precision, place):
    value, n = ODD[precision][place], n_lanes(precision)
    out = np.full(n + 2, 7.0, dtype=precision)
    spread_over(value, out)
    assert same_numbers(out, np.array([7.0, *[value] * n, 7.0], dtype=precision))


def test_a_lane_has_no_part_in_its_neighbours(compute, rows, scalars, found):
    """Whatever stands in one lane, the others' bits stay."""
    n = rows.shape[2]
    for lane in range(n):
        others = [k for k in range(n) if k != lane]
        for value in (np.nan, np.inf, 0.0):
            changed = rows.copy()
            changed[:, :, lane] = value
            out, _ = compute(changed, scalars)
            assert out[..., others].tobytes() == found[0][..., others].tobytes()
