"""Options of lives: every time of a file is in hours, every time inside in seconds."""

from dataclasses import asdict

import pytest
from numpy.testing import assert_allclose

from gensig.life.life_options import read_life
from gensig.plan.request import read_request

HOUR = 3600.0
DRAWN = {
    "block_low_h": 2.0,
    "block_high_h": 5.0,
    "gap_chance": 0.25,
    "gap_low_h": 0.5,
    "gap_high_h": 7.0,
}


@pytest.fixture(scope="module")
def life():
    return read_request(["life=mixed", "fault=crack"]).config["life"]


def test_lengths_of_drawn_blocks_are_hours_and_a_chance_is_a_chance(life):
    drawn = asdict(read_life({**life, **DRAWN}).drawn)
    expected = {
        "shortest": 2.0 * HOUR,
        "longest": 5.0 * HOUR,
        "gap_chance": 0.25,
        "gap_shortest": 0.5 * HOUR,
        "gap_longest": 7.0 * HOUR,
    }
    assert drawn.keys() == expected.keys()
    for name, value in expected.items():
        assert_allclose(drawn[name], value, rtol=1e-12, err_msg=name)


def test_given_blocks_and_the_horizon_are_in_si(life):
    options = read_life({**life, "blocks": [[1, 2, 600, 50]], "horizon_h": 3})
    assert_allclose(options.blocks, [[HOUR, 2 * HOUR, 62.83185307179586, 50.0]])
    assert_allclose(options.horizon, 3 * HOUR)
