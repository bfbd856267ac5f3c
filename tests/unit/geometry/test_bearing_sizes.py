"""Usual bearings of a shaft: ISO 15 series 02, and the clearance of ISO 5753-1 group N."""

import pytest
from refusals import refused

from gensig.geometry.bearing_sizes import SERIES_02, bearing_for

BORES = [size[0] for size in SERIES_02]


@pytest.mark.parametrize("number", range(len(BORES)))
def test_the_largest_that_goes_on_the_shaft(number):
    bore, outside, width = SERIES_02[number]
    following = [*BORES, BORES[-1] + 100][number + 1]
    for shaft in (bore, 0.5 * (bore + following), following - 1e-3):
        size = bearing_for(shaft)
        assert (size.bore, size.outside, size.width) == (bore, outside, width)
        assert bore < size.pitch_diameter - size.ball_diameter
        assert size.pitch_diameter + size.ball_diameter < outside
        # the balls of a makers' bearing fill most, and not all, of the circle
        filled = size.n_balls * size.ball_diameter / (3.14159 * size.pitch_diameter)
        assert 0.5 < filled < 0.7


# a row of the standard holds "over 10 up to and including 18 mm"
@pytest.mark.parametrize(
    ("bore", "clearance_um"),
    [(10, 2), (12, 3), (17, 3), (20, 5), (30, 5), (35, 6), (50, 6), (80, 10), (85, 12)],
)
def test_the_bore_at_the_end_of_a_row_belongs_to_it(bore, clearance_um):
    assert bearing_for(bore).clearance_um == clearance_um


def test_a_shaft_thinner_than_any_bearing():
    with refused("a shaft of 2.5 mm is thinner than any"):
        bearing_for(2.5)
