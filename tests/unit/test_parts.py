"""The time of a run of the tests is told by its parts."""

from types import SimpleNamespace

import pytest
from parts import Parts

TESTS = {
    "tests/unit/text/test_page.py::test_a[x/y]": 1.0,
    "tests/unit/text/deep/test_b.py::test_b": 2.0,
    "tests/pipeline/test_c.py::test_c": 4.0,
}


def test_seconds_are_those_of_the_folders():
    parts, lines = Parts(), []
    for name, duration in TESTS.items():
        parts.pytest_runtest_logstart()
        parts.pytest_runtest_logreport(SimpleNamespace(nodeid=name, duration=duration))
    assert parts.seconds.pop("collection") == pytest.approx(0.0, abs=1.0)
    parts.pytest_terminal_summary(
        SimpleNamespace(section=lines.append, line=lines.append)
    )
    assert [line.split() for line in lines[1:]] == [
        ["4.0", "tests/pipeline"],
        ["3.0", "tests/unit/text"],
    ]
