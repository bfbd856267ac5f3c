"""Data sets that run to failure of a drive line and of helical gears."""

import json
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from gensig.cli import main
from gensig.driveline import loads as line_loads
from gensig.options.compose import compose
from gensig.plan.growth_table import worn_together
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.machines import read_machine
from gensig.systems.base import MachineMesh

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


def test_lives_of_a_drive_line_under_a_ramp_are_refused(capsys):
    assert main(["plan", *LINE, "operating=ramp"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "set-points are steady" in line


BOX = (
    "system=two_stage_gearbox",
    "life=wear",
    "plan.classes=[wear]",
    "plan.vary={}",
    "life.n_setpoints=1",
    "life.wear.rate_scatter=0",
    *FEW,
)


def worn_gears(plan):
    """Depths in um by gear of the last record of a plan."""
    parts = json.loads(plan.columns["faults_json"][-1])
    return {part["gear"]: part["wear_depth_um"] for part in parts}


@pytest.fixture(scope="module")
def worn_box():
    return planned(*BOX)


def test_flanks_of_a_gearbox_wear_to_their_threshold(worn_box):
    depths = worn_gears(worn_box)
    assert set(depths) == {"pinion", "wheel"}
    assert worn_box.columns["life_failed"].all()
    assert math.isclose(max(depths.values()), 100.0, rel_tol=1e-3)


def test_gears_wear_in_their_own_mesh_and_keep_their_names(worn_box):
    followed = planned(*BOX, "fault.gear=output_gear")
    depths = worn_gears(followed)
    assert set(depths) == {"idler_gear_2", "output_gear"}
    at_home = planned(*BOX, "system.record_mesh=[5,6]")
    assert set(worn_gears(at_home)) == {"pinion", "wheel"}
    hours = [plan.columns["life_time_h"][-1] for plan in (followed, at_home)]
    assert math.isclose(*hours, rel_tol=1e-3)


def test_wear_goes_with_the_mean_torque_of_the_mesh():
    machine = read_machine(compose("generate", ["system=two_stage_gearbox"]))
    speed, torque = machine.operating.speed, machine.operating.torque
    mean = machine.mean_torque(speed, torque)
    at_rest = machine.mesh_force * machine.pair.pinion.base_radius
    assert math.isclose(mean, at_rest, rel_tol=0.01)
    assert machine.mesh_torques(speed, torque).max() > mean


def test_cracks_grow_in_a_helical_gearbox():
    plan = planned(
        "system=phm09_helical_two_stage",
        "life=crack_growth",
        "plan.classes=[crack]",
        "plan.vary={operating.torque_nm: {distribution: uniform, low: 100, high: 150}}",
        "mesh.n_slices=8",
        *FEW,
    )
    crack = plan.columns["severity"]
    assert crack.max() > 0.0


def test_a_gear_that_meets_its_other_flank_elsewhere_is_not_worn_there():
    gear = read_machine(compose("generate", ["system=two_stage_gearbox"])).pair

    def mesh(driving, driven):
        return MachineMesh(
            driving=driving, driven=driven, pair=gear, followed=driving == "pinion"
        )

    # the wheel is an idler: driven by the pinion, it drives the gear c and, so, the gear d
    meshes = [mesh("pinion", "wheel"), mesh("wheel", "c"), mesh("pinion", "d")]
    assert worn_together(meshes, 0) == {"pinion": "pinion", "wheel": "wheel"}
    assert worn_together(meshes, 1) == {"wheel": "c"}
    assert worn_together(meshes, 2) == {"pinion": "pinion", "wheel": "d"}


def test_cracks_and_pits_of_helical_pairs_make_lives():
    plan = planned(*HELICAL)
    columns = plan.columns
    crack = columns["label_name"] == "crack"
    assert columns["life_failed"][crack].all()
    assert math.isclose(columns["severity"][crack][-1], 0.7, rel_tol=1e-6)
    assert (np.diff(columns["severity"][crack]) > 0.0).all()
    assert columns["life_growing"].all()
    assert (np.diff(columns["params/fault.pitting_damage"][~crack]) > 0.0).all()
