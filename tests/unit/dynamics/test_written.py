"""Written functions give what the same Python gives, and refuse what is not known yet."""

from typing import Any, NamedTuple

import numpy as np
import pytest
from numba import njit
from numba.core.errors import NumbaError

from gensig.dynamics._vector import (
    LANES,
    any_above,
    compiled,
    get_row,
    set_row,
    spread,
)
from gensig.dynamics._written import (
    any_of,
    call,
    choose,
    either,
    fold,
    loop,
    repeat,
    traced,
    when,
    written,
)


class Parts(NamedTuple):
    """Rows and a number of them."""

    rows: Any
    n: int


@written
def powers(parts, base, step):
    """First powers of a row, in a tuple, and where they end."""
    value = get_row(parts.rows, base)
    found = [value]
    for _ in range(2):
        found.append(found[-1] * value + step * (1.0 - step))
    return tuple(found), base + 2 * parts.n - 1


@written
def store(rows, found, at):
    for k, value in enumerate(found):
        set_row(rows, at + k, value)


@compiled
def run(parts, step):
    for base in range(parts.n):
        found, end = powers(parts, base, step)
        store(parts.rows, found, end)
    found, end = powers(parts, 0, 0.5)
    store(parts.rows, found, 8)
    return end


def test_written_functions_calculate_as_python() -> None:
    rows = np.zeros(12 * LANES)
    rows[:LANES] = np.arange(LANES)
    assert run(Parts(rows, 1), 0.25) == 1
    x, rows = np.arange(LANES), rows.reshape(-1, LANES)
    for first, added in ((1, 0.1875), (8, 0.25)):
        square = x * x + added
        expected = [x, square, square * x + added]
        np.testing.assert_array_equal(rows[first : first + 3], expected)


def refused(number):
    if number > 1.0:
        return 2.0
    return number


def compared(number):
    return 1.0 if number == 1.0 else number


def decided(number):
    return number if number else 1.0


@pytest.mark.parametrize("function", [refused, compared, decided])
def test_nothing_depends_on_what_is_not_known(function) -> None:
    called = written(function)

    @compiled
    def calling(number):
        return called(number)

    with pytest.raises((TypeError, NumbaError)):
        calling(3.0)


@compiled
def mark(rows, at):
    """Set a row to 7 in its first lane."""
    rows[at * LANES] = 7.0


@traced
def branches(rows, n, flags):
    """Sum n rows behind row 1 into row 0, and let branches change others."""
    zero, one = spread(rows, 0.0), spread(rows, 1.0)
    bodies.append("run")

    def add(k):
        set_row(rows, 0, get_row(rows, 0) + get_row(rows, 2 + k))

    loop(n, add)
    loop(1, lambda k: set_row(rows, 1, one))
    is_set = any_above(flags, zero)
    when(is_set, lambda: call(mark, rows, n))
    is_low = any_above(zero, flags)
    first, second = either(any_of(is_set, is_low), lambda: (one, zero), (zero, one))
    set_row(rows, 8, first)
    set_row(rows, 9, second)


bodies: list[str] = []


@compiled
def run_branches(rows, n, flag):
    branches(rows, n, spread(rows, flag))


@pytest.mark.parametrize("flag", [-1.0, 0.0, 1.0])
def test_loops_and_branches_of_the_compiled_code(flag) -> None:
    """The body of a loop is written once, whatever its count; a branch is taken where it holds."""
    rows = np.zeros((10, LANES))
    rows[2:6] = np.arange(4 * LANES).reshape(4, LANES)
    expected = rows[2:6].sum(axis=0)
    run_branches(rows.ravel(), 4, flag)
    np.testing.assert_array_equal(rows[0], expected)
    assert (rows[1] == 1.0).all()
    assert rows[4, 0] == (7.0 if flag > 0.0 else 2 * LANES)
    assert (rows[8] == (flag != 0.0)).all()
    assert (rows[9] == (flag == 0.0)).all()


def test_traced_functions_are_run_once() -> None:
    bodies.clear()

    @njit  # without a cache, from which a second run of the tests would read it
    def calling(rows, n, flag):
        branches(rows, n, spread(rows, flag))

    calling(np.zeros(10 * LANES), 2, 0.0)
    assert bodies == ["run"]


@traced
def carried(rows, first, last, flags):
    """Write sums of rows, doublings up to a bound and one of two values to rows 0 to 3."""
    zero, one = spread(rows, 0.0), spread(rows, 1.0)

    def add(k, total, count):
        return total + get_row(rows, 4 + k), count + one

    def double(value, rounds):
        value = value + value
        return any_above(spread(rows, 10.0), value), value, rounds + one

    total, count = fold(first, last, add, (zero, zero))
    doubled, rounds = repeat(3, double, (flags, zero))
    is_set = any_above(flags, zero)
    (either_one,) = choose(is_set, lambda: (total,), lambda: (count,))
    for row, value in enumerate((count, doubled, rounds, either_one)):
        set_row(rows, row, value)


@compiled
def run_carried(rows, first, last, flag):
    carried(rows, first, last, spread(rows, flag))


@pytest.mark.parametrize(
    ("first", "last", "flag", "doubled", "rounds"),
    [(1, 4, 1.0, 8.0, 3), (0, 2, 6.0, 12.0, 1), (2, 2, 0.0, 0.0, 3)],
)
def test_loops_carry_values(first, last, flag, doubled, rounds) -> None:
    """A range without places gives what it was given; rounds end with the first that says so."""
    rows = np.zeros((8, LANES))
    rows[4:] = np.arange(4 * LANES).reshape(4, LANES)
    total = rows[4 + first : 4 + last].sum(axis=0)
    run_carried(rows.ravel(), first, last, flag)
    assert (rows[0] == last - first).all()
    assert (rows[1] == doubled).all()
    assert (rows[2] == rounds).all()
    expected = total if flag > 0.0 else np.full(LANES, last - first)
    np.testing.assert_array_equal(rows[3], expected)
