"""Data sets that run to failure of a drive line and of helical gears."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from gensig.cli import main
from gensig.driveline import loads as line_loads
from gensig.plan.make import make_plan
from gensig.plan.request import read_request

FEW = (
    "plan.n_records=null",
    "plan.n_units=2",
    "plan.n_gearboxes=1",
    "life.snapshot_count=3",
    "operating.duration_s=0.02",
)
LINE = (
    "experiment=engine_broken_tooth",
    "life=crack_growth",
    "plan.classes=[healthy,crack]",
    "plan.vary={}",
    "life.n_setpoints=1",
    "life.crack.rate_scatter=0",
    "life.crack.start_scatter=0",
    *FEW,
)
HELICAL = (
    "experiment=helical",
    "life=mixed",
    "plan.classes=[crack,distributed_pitting]",
    "plan.vary={operating.torque_nm: {distribution: uniform, low: 150, high: 250}}",
    "mesh.n_slices=12",
    *FEW,
)


def planned(*overrides):
    return make_plan(read_request(list(overrides)).config)


@pytest.fixture(scope="module")
def line():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(line_loads, "SECONDS", 0.1)
        return planned(*LINE)


def test_a_crack_of_a_drive_line_grows_by_the_impacts_of_its_mesh(line):
    columns = line.columns
    crack = columns["label_name"] == "crack"
    assert columns["life_failed"][crack].all()
    assert_allclose(columns["severity"][crack][[0, -1]], [0.1, 0.7], rtol=1e-6)
    assert (columns["severity"][~crack] == 0.0).all()
    # the mean load of the pump drive would leave it below the threshold
    assert columns["params/fault.stress_intensity_range_mpa_sqrt_m"][crack].min() > 5.0
    # turns of the driving gear, whose shaft has half the crank's speed
    turns_per_hour = 60.0 * 0.5 * columns["speed_set_rpm"][crack][1] * 2.0
    running = columns["life_cycles"][crack][1] / turns_per_hour
    assert running <= columns["life_time_h"][crack][1] * (1.0 + 1e-9)
    assert_allclose(columns["speed_set_rpm"], 844.0, rtol=1e-9)
    assert_array_equal(columns["torque_nm"], 12680.0)


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (("life=mixed", "plan.classes=[wear]"), "wear is not followed on a drive line"),
        (("operating=ramp",), "set-points are steady"),
    ],
)
def test_unknown_lives_of_a_drive_line_are_refused(overrides, message, capsys):
    assert main(["plan", *LINE, *overrides]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert message in line


def test_cracks_and_pits_of_helical_pairs_make_lives():
    plan = planned(*HELICAL)
    columns = plan.columns
    crack = columns["label_name"] == "crack"
    assert columns["life_failed"][crack].all()
    assert math.isclose(columns["severity"][crack][-1], 0.7, rel_tol=1e-6)
    assert (np.diff(columns["severity"][crack]) > 0.0).all()
    assert columns["life_growing"].all()
    assert (np.diff(columns["params/fault.pitting_damage"][~crack]) > 0.0).all()
