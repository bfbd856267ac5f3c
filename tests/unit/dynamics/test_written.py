"""Written functions give what the same Python gives, and refuse what is not known yet."""

from typing import Any, NamedTuple

import numpy as np
import pytest
from numba.core.errors import NumbaError

from gensig.dynamics._vector import LANES, compiled, get_row, set_row
from gensig.dynamics._written import written


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
