"""One life of a plan: the columns of a point of its course."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.life.growth import Course
from gensig.plan.lives import _Life

# the first hour at set-point 1, the second at 0
COURSE = Course(
    clock=np.array([0.0, 3600.0, 7200.0]),
    running=np.array([0.0, 3600.0, 7200.0]),
    turns=np.array([0.0, 100.0, 300.0]),
    size=np.array([1.0, 2.0, 4.0]),
    setpoint=np.array([1, 0, 0]),
    growing=np.array([True, False, False]),
    has_failed=True,
)
# of each set-point, at two meshes of the gear
LOADS = (np.array([30.0, 50.0]), np.array([20.0, 10.0]))


@dataclass
class Law:
    """Growth that notes what it is asked."""

    asked: list = field(default_factory=list)

    def measures(self, size, torque):
        self.asked.append((size, torque))
        return {"depth_mm": size}


@pytest.mark.parametrize(
    ("at", "size", "torque", "clock", "growing"),
    [((0, 0.5), 1.5, 20.0, 0.5, 1), ((1, 0.25), 2.5, 50.0, 1.25, 0)],
)
def test_damage_is_measured_under_the_greatest_load_of_the_set_point(
    at, size, torque, clock, growing
):
    law = Law()
    life = _Life(fault={}, law=law, loads=LOADS, course=COURSE)
    columns = life.columns_at(at)
    assert law.asked == [(size, torque)]
    assert columns["params/fault.depth_mm"] == size
    assert columns["life_growing"] == growing
    assert_allclose(columns["life_time_h"], clock)
    assert_allclose(columns["remaining_life_h"], 2.0 - clock)


def test_a_sound_unit_has_no_measures():
    life = _Life(fault={"kind": "healthy"}, law=None, loads=(), course=COURSE)
    columns = life.columns_at((0, 0.5))
    assert not [name for name in columns if name.startswith("params/")]
    assert life.fault_at((0, 0.5)) == {"kind": "healthy"}
