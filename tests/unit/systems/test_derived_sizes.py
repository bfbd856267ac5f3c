"""Sizes that follow from others where a data sheet does not say them."""

import math

import pytest

from gensig.systems.derived_sizes import CLEARANCE, LARGEST_ROUNDING, tip_rounding


@pytest.mark.parametrize("angle", range(10, 32))
def test_the_largest_rounding_of_hundredths_that_the_tip_has_room_for(angle):
    alpha = math.radians(angle)
    rounding = tip_rounding(angle)

    def fits(radius):
        """The arc ends above the working flank, and before the middle of the rack's tip."""
        depth = radius * (1.0 - math.sin(alpha))
        half_width = math.pi / 4.0 - (1.0 + CLEARANCE) * math.tan(alpha)
        return depth <= CLEARANCE and depth / math.cos(alpha) <= half_width

    assert fits(rounding / 1.001)  # 0.38 at 20 degrees, as ISO 53 rounds it
    assert rounding == LARGEST_ROUNDING or not fits(rounding + 0.01)
    assert round(100.0 * rounding, 6).is_integer()


def test_a_pointed_tip_has_the_least_rounding():
    assert tip_rounding(34) == 0.01
