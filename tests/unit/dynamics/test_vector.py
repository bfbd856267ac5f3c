"""Vector values against numpy, lane by lane: also infinities, not-a-numbers, zeros of both signs, and tiny numbers."""

import operator

import numpy as np
import pytest
from numba import njit

from gensig.dynamics._vector import LANES, any_above, load, spread, store, transpose, where_above

N_GROUPS = 400
ODD = np.array([np.inf, -np.inf, np.nan, 0.0, -0.0, 5e-324, -1e-310, 1.7e308, -1.7e308, 1.0])
OPERATIONS = {"add": operator.add, "sub": operator.sub, "mul": operator.mul, "truediv": operator.truediv}
COMPILED = njit(error_model="numpy")


@COMPILED
def every_operation(rows, out, above):
    """``rows`` holds groups of four vectors; ``out`` takes nine results of each, ``above`` whether a > b anywhere."""
    for n in range(len(above)):
        here, there = n * 4 * LANES, n * 9 * LANES
        a, b = load(rows, here), load(rows, here + LANES)
        c, d = load(rows, here + 2 * LANES), load(rows, here + 3 * LANES)
        store(out, there, a + b)
        store(out, there + LANES, a - b)
        store(out, there + 2 * LANES, a * b)
        store(out, there + 3 * LANES, a / b)
        store(out, there + 4 * LANES, where_above(a, b, c, d))
        first, second, third, fourth = transpose(a, b, c, d)
        store(out, there + 5 * LANES, first)
        store(out, there + 6 * LANES, second)
        store(out, there + 7 * LANES, third)
        store(out, there + 8 * LANES, fourth)
        above[n] = any_above(a, b)


@COMPILED
def move(values, source, target, out):
    store(out, target, load(values, source))


@COMPILED
def spread_over(value, out):
    store(out, 1, spread(value))


@pytest.fixture(scope="module")
def rows():
    """(group, a to d, lane); a third of the numbers odd, some of a equal to b."""
    rng = np.random.default_rng(4)
    values = rng.standard_normal((N_GROUPS, 4, LANES)) * 10.0 ** rng.integers(-200, 200, (N_GROUPS, 4, LANES))
    values = np.where(rng.random(values.shape) < 0.3, rng.choice(ODD, values.shape), values)
    values[::5, 1] = values[::5, 0]
    return values


@pytest.fixture(scope="module")
def found(rows):
    out, above = np.empty((N_GROUPS, 9, LANES)), np.empty(N_GROUPS, dtype=np.bool_)
    every_operation(rows.ravel(), out.ravel(), above)
    return out, above


def same_numbers(one, two):
    """Equal, zeros of the same sign; one not-a-number is as good as another."""
    return np.array_equal(one, two, equal_nan=True) and np.array_equal(
        np.signbit(one)[~np.isnan(one)], np.signbit(two)[~np.isnan(two)]
    )


@pytest.mark.parametrize(("place", "name"), list(enumerate(OPERATIONS)))
def test_arithmetic(rows, found, place, name):
    with np.errstate(all="ignore"):
        expected = OPERATIONS[name](rows[:, 0], rows[:, 1])
    assert same_numbers(found[0][:, place], expected)
    assert np.isnan(expected).any()
    assert np.isinf(expected).any()


def test_where_above(rows, found):
    a, b, yes, no = rows.transpose(1, 0, 2)
    assert same_numbers(found[0][:, 4], np.where(a > b, yes, no))
    assert 0.2 < (a > b).mean() < 0.8


def test_any_above(rows, found):
    expected = (rows[:, 0] > rows[:, 1]).any(axis=1)
    assert found[1].tolist() == expected.tolist()
    assert 0 < expected.sum() < N_GROUPS


@pytest.mark.parametrize("lane", range(LANES))
def test_any_above_sees_every_lane(lane):
    rows = np.zeros((2, 4, LANES))
    rows[0, 0, lane], rows[1, 1, lane] = 5e-324, 1.0
    above = np.empty(2, dtype=np.bool_)
    every_operation(rows.ravel(), np.empty(2 * 9 * LANES), above)
    assert above.tolist() == [True, False]


def test_transpose(rows, found):
    assert same_numbers(found[0][:, 5:], rows.transpose(0, 2, 1))


def test_load_and_store_move_four_numbers_wherever_they_lie():
    values = np.arange(12.0)
    for source in range(9):
        for target in range(9):
            out = np.full(12, -1.0)
            move(values, source, target, out)
            expected = np.full(12, -1.0)
            expected[target : target + LANES] = values[source : source + LANES]
            assert out.tolist() == expected.tolist()


@pytest.mark.parametrize("value", ODD)
def test_spread(value):
    out = np.full(6, 7.0)
    spread_over(value, out)
    assert same_numbers(out, np.array([7.0, *[value] * LANES, 7.0]))


def test_a_lane_has_no_part_in_its_neighbours(rows, found):
    """Whatever stands in one lane, the others' bits stay."""
    for lane in range(LANES):
        others = [k for k in range(LANES) if k != lane]
        for value in (np.nan, np.inf, 0.0):
            changed, out = rows.copy(), np.empty_like(found[0])
            changed[:, :, lane] = value
            every_operation(changed.ravel(), out.ravel(), np.empty(N_GROUPS, dtype=np.bool_))
            assert out[:, :5][..., others].tobytes() == found[0][:, :5][..., others].tobytes()
