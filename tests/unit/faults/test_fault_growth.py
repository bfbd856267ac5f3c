"""Every fault says whether it grows; a law and its parameters stand ready for each that does."""

from typing import get_type_hints

import numpy as np
import pytest
from fault_cases import KINDS, one

from gensig.faults.base import Growth
from gensig.faults.registry import FAULTS
from gensig.life.life_options import OPTIONS
from gensig.plan.growth_table import LAWS, LifeGears

GROWING = [kind for kind in KINDS if FAULTS[kind].growth is not Growth.NONE]


@pytest.mark.parametrize("kind", KINDS)
def test_every_fault_says_it_itself(kind):
    assert isinstance(vars(FAULTS[kind])["growth"], Growth)


def test_three_kinds_grow():
    assert GROWING == ["crack", "distributed_pitting", "wear"]


def test_every_law_has_parameters_and_a_builder():
    laws = set(Growth) - {Growth.NONE}
    assert set(LAWS) == set(OPTIONS) == laws


@pytest.mark.parametrize("kind", GROWING)
def test_the_builder_takes_the_fault_and_its_parameters(kind):
    fault = FAULTS[kind]
    hints = get_type_hints(LAWS[fault.growth])
    assert issubclass(fault, hints["fault"])
    assert issubclass(OPTIONS[fault.growth], hints["options"])


def test_the_seed_of_a_crack_keeps_what_its_law_depends_on():
    kept = {"gear": "wheel", "crack_start": "gamma_mid", "crack_angle_deg": 60}
    kept["crack_side"] = "compression"
    crack = one("crack", tooth=5, crack_width_mm=3, crack_front="linear", **kept)
    assert crack.seed() == one("crack", tooth=0, crack_depth_mm=0.0, **kept)


class PairOfKnownLoads:
    """Machine whose teeth meet the set torque and its half, at any speed."""

    ratio = 1.0

    def mesh_torques(self, speed, torque):
        return np.array([0.5, 1.0]) * torque


def test_laws_reach_from_the_least_to_the_greatest_load_of_the_corners():
    corners = [(100.0, 30.0), (200.0, 10.0), (300.0, 20.0)]
    gears = LifeGears(None, PairOfKnownLoads(), corners)
    assert gears.torques == (10.0, 30.0)
