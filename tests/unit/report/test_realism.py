"""Measured ranges and stored results.

How they are judged, kept and shown. All numbers here are made up.
"""

import csv
import math
from dataclasses import replace

import pytest
from refusals import refused

from benchmarks._realism_results import read_results, write_results
from gensig.report import realism
from gensig.report.realism import compare, judge, read_ranges

NAN = math.nan


@pytest.mark.parametrize(
    ("low", "high", "p5", "p95", "verdict"),
    [
        (1, 2, 1.1, 1.9, "inside"),
        (1, 2, 1, 2, "inside"),
        (1, 2, 0.9, 1.9, "overlaps"),
        (1, 2, 0.5, 3, "overlaps"),
        (1, 2, 2, 3, "overlaps"),
        (1, 2, 2.1, 3, "misses"),
        (1, 2, 0.1, 0.9, "misses"),
        (None, 2, -9, 1, "inside"),
        (None, 2, 3, 4, "misses"),
        (1, None, 3, 400, "inside"),
        (None, None, 3, 4, "no range"),
        (1, 2, NAN, NAN, "no value"),
        (None, None, NAN, NAN, "no value"),
    ],
)
def test_verdicts(low, high, p5, p95, verdict):
    assert judge(low, high, p5, p95) == verdict


def test_values_that_are_unknown_do_not_count(measured):
    result = compare(measured(), [NAN, 1.0, 1.5, 2.0, NAN])
    assert (result.median, result.n, result.verdict) == (1.5, 3, "inside")
    assert (result.p5, result.p95) == pytest.approx((1.05, 1.95))
    assert compare(measured(), [NAN]).verdict == "no value"


def test_every_published_range_is_read_once_and_makes_sense():
    result = read_ranges()
    with realism.RANGES.open(encoding="utf-8") as file:
        assert len(result) == len(list(csv.DictReader(file))) > 20
    bounded = [
        one for one in result.values() if one.low is not None or one.high is not None
    ]
    assert all(one.source for one in bounded)
    assert result["missing_tooth.kurtosis", "slow and light"].low == 20.0
    assert result["missing_tooth.rms_ratio", "all conditions"].low is None


def test_a_range_upside_down_and_a_verdict_there_is_not_are_refused(measured):
    with refused("low = 3 lies above high = 2"):
        measured(low=3.0)
    with refused("verdict = 'fine'; allowed: inside"):
        replace(compare(measured(), [1.0]), verdict="fine")


def test_results_come_back_and_reasons_stay(measured, tmp_path):
    path = tmp_path / "results.csv"
    result = [
        compare(measured(), [1.5, 1.6]),
        compare(measured(id="recording.x", low=None), [NAN]),
    ]
    write_results(path, "base, gensig 0,\nfrozen", result)
    heading, back = read_results(path)
    assert heading == "base, gensig 0, frozen"
    assert back[0] == result[0]
    assert (back[1].n, back[1].verdict, back[1].low) == (0, "no value", None)
    path.write_text(path.read_text().replace("inside,", "inside,because"))
    write_results(path, "again", [compare(measured(), [9.0])])
    heading, (one,) = read_results(path)
    assert (heading, one.verdict, one.reason) == ("again", "misses", "because")


def test_a_file_without_its_heading_is_refused(tmp_path):
    path = tmp_path / "results.csv"
    path.write_text("id,at\n")
    with refused("must begin with a line '# '"):
        read_results(path)
