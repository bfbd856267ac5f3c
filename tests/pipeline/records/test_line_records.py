"""Single records, lives and statics of drive lines, and what is refused in one line."""

import json
import warnings
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from record_sets import refused, run, shard
from test_line_sets import ENGINE, TWO_STAGE

from gensig.driveline import in_time as line_time
from gensig.driveline import loads as line_loads
from gensig.dynamics.backends.registry import BACKENDS, EXPLICIT_BACKEND
from gensig.errors import GensigError
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.machines import read_machine
from gensig.systems.pair_machine import GearPairMachine

MOTOR = ("system=two_stage_gearbox", "excitation=motor_and_load")
TRAIN = ("system=engine_gear_train", "excitation=engine_v20")
LIFE = (
    "experiment=two_stage",
    "plan.n_records=null",
    "plan.n_repeats=1",
    "plan.n_units=2",
    "plan.n_gearboxes=1",
    "plan.vary={}",
    "life.snapshot_count=3",
    "life.n_setpoints=1",
    "operating.torque_nm=150",
)


@pytest.mark.parametrize(
    ("life", "kind"), [("crack_growth", "crack"), ("pit_growth", "distributed_pitting")]
)
def test_lives_grow_under_the_steady_loads_of_the_mesh(life, kind, monkeypatch):
    monkeypatch.setattr(line_loads, "SECONDS", 0.1)
    words = [*LIFE, f"life={life}", f"plan.classes=[healthy,{kind}]"]
    columns = make_plan(read_request(words).config).columns
    grown = columns["label_name"] == kind
    assert columns["severity"][grown].max() > columns["severity"][grown].min()
    assert (columns["severity"][~grown] == 0.0).all()


@pytest.mark.filterwarnings("ignore:.*mean tooth forces:UserWarning")
@pytest.mark.parametrize(
    ("life", "kind"), [("crack_growth", "crack"), ("pit_growth", "distributed_pitting")]
)
def test_a_life_is_the_same_whichever_mesh_is_followed(life, kind, monkeypatch):
    """A life of the output gear, followed at the first mesh and at its own, takes as many hours.

    Turns of the driving gear are three times as many where that is the motor's.
    """
    monkeypatch.setattr(line_loads, "SECONDS", 0.1)
    plans = []
    for more in (
        ["fault.gear=output_gear"],
        ["fault.gear=wheel", "system.record_mesh=[5,6]"],
    ):
        words = [
            *LIFE,
            f"life={life}",
            f"plan.classes=[{kind}]",
            "operating.torque_nm=250",
        ]
        config = read_request([*words, "plan.fault_gear=as_given", *more]).config
        plans.append(make_plan(config).columns)
    first, second = plans
    assert np.ptp(first["severity"]) > 0.0
    assert set(first["fault_gear"]) == {"output_gear"}
    for name in ("life_time_h", "remaining_life_h", "severity"):
        assert_allclose(first[name], second[name], rtol=1e-6, atol=1e-9)
    assert_allclose(first["life_cycles"], 3.0 * second["life_cycles"], rtol=1e-6)
    assert set(first["life_failed"]) == set(second["life_failed"])


def test_a_life_of_a_gear_that_is_not_there_names_those_that_are():
    words = [*LIFE, "life=crack_growth", "plan.classes=[crack]", "fault.gear=sun"]
    config = read_request([*words, "plan.fault_gear=as_given"]).config
    with pytest.raises(GensigError, match="output_gear"):
        make_plan(config)


def test_gears_that_bear_far_more_than_their_support_is_for_are_named():
    words = ["experiment=two_stage", "operating.torque_nm=60"]
    light = "system.support.force_n=500"
    with pytest.warns(UserWarning, match="3/4 1995 N for 500 N, 5/6 3991 N for 500 N"):
        read_machine(read_request([*words, light]).config).check()
    heavy = ["experiment=two_stage", "operating.torque_nm=240"]
    with pytest.warns(UserWarning, match="3/4 7981 N for 1995 N"):
        read_machine(read_request(heavy).config).check()
    torsion = (
        "system.lateral=false",
        "sensing.channels=[pinion_rotation,wheel_rotation]",
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for more in ([], ["system.support.force_n=2000"], [light, *torsion]):
            read_machine(read_request([*words, *more]).config).check()


def test_stiffness_is_that_of_the_record_mesh(tmp_path):
    words = (*MOTOR, "system.record_mesh=[5,6]", "operating.torque_nm=60")
    out = tmp_path / "curves.json"
    run("stiffness", *words, "fault=crack", "--json", out)
    content = json.loads(out.read_text())
    # the same teeth as a pair, under what the first stage makes of the torque
    line = read_machine(read_request(list(words)).config)
    alone = GearPairMachine(
        slices=line.slices,
        has_whole_teeth=True,
        pair=line.pair,
        material=line.material,
        mesh=line.mesh,
        pinion=line.bodies["pinion"],
        wheel=line.bodies["wheel"],
        operating=replace(line.operating, torque=180.0),
        sensing=line.sensing,
        quality=line.quality,
        solver=line.solver,
    ).stiffness_curves()
    stiffness = line.stiffness_curves().mesh_stiffness
    assert_allclose(stiffness, alone.mesh_stiffness, rtol=1e-9)
    faulty, sound = (
        min(content[f"{kind}_pair_stiffness_n_per_m"]) for kind in ("faulty", "single")
    )
    assert faulty < sound


def test_a_toothed_wheel_and_the_torque_of_the_load_are_stored(tmp_path):
    errors = (
        "eccentricity_error_deg: 0, tooth_error_deg: 0, clock_frequency_hz: 100000000"
    )
    words = (
        f"excitation.toothed_wheels={{motor: {{node: 1, n_teeth: 60, {errors}}}}}",
        "sensing.channels=[motor_speed, wheel_rotation]",
        "excitation.load.law=quadratic",
        "operating=ramp",
        "operating.speed_profile.first_factor=0.5",
        "dataset.store_operating=true",
        "operating.speed_rpm=1746",
        "operating.torque_nm=30",
        "operating.duration_s=0.1",
        "plan.n_records=5",
        "plan.n_units=1",
    )
    out = tmp_path / "set"
    run("generate", *TWO_STAGE, *words, f"out={out}")
    with shard(out) as file:
        torque = file["torque_set"][:]
    assert_allclose(torque[:, 0], 0.25 * 30.0, rtol=1e-3)
    assert_allclose(torque[:, -1], 30.0, rtol=0.01)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["system.record_mesh=[18,3]"], "no such mesh; there are 3/18, 19/20"),
        (["system.helical_meshes=rigid"], "allowed: sliced, constant"),
        (["sensing.channels=[crank_speed]"], "allowed: pinion_rotation, wheel_rot"),
        (
            ["solver.backend=euler"],
            "solver.backend = 'euler'; allowed: nystroem, other, newmark",
        ),
        (["solver.backend=other"], "take solver.backend=nystroem or newmark"),
        (["operating.torque_nm=-5"], "must be positive"),
        (["fault.tooth=60"], "whose teeth are 0..53"),
    ],
)
def test_refused_sets_of_an_engine(words, text, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(BACKENDS, "other", BACKENDS[EXPLICIT_BACKEND])
    out = tmp_path / "set"
    few = (*ENGINE, "plan.classes=[crack]")
    assert text in refused(capsys, "generate", *few, *words, f"out={out}")
    assert not out.exists()


MOTOR_KEY = "excitation.motor"
BRANCHED = [
    "system.shafting_csv=engine_shafting.csv",
    "system.gears_csv=engine_gears.csv",
    "system.load_node=null",
]
FAN = "excitation.loads={{fan: {{node: {}, law: {}, torque_nm: 1}}}}"


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (
            ["system.motor_node=99"],
            "= 99: the shaft line has no node 99; it has 1, 2, 3",
        ),
        (
            BRANCHED,
            "needs the node of its load, and two_stage_gearbox has branches: give one of 67 nodes",
        ),
        (["system.motor_node=8"], "turns 0.2 times as fast as the first node"),
        (
            ["system.load_node=99"],
            "system.motor_node, system.load_node and, for records",
        ),
        (
            ["system.load_node=1"],
            "system.motor_node and system.load_node are both 1: the load would take",
        ),
        ([FAN.format(99, "linear")], "excitation.loads.fan.node: the shaft line"),
        ([FAN.format(2, "cubic")], "excitation.loads.fan.law = 'cubic'"),
        (["+excitation.cylinder={bore_mm: 100}"], "a line is turned by one of them"),
        (
            ["excitation=engine_v20", f"+{MOTOR_KEY}={{slip: 0.1}}"],
            "a line is turned by one",
        ),
        (["excitation.kind=turbine"], "allowed: engine, motor_and_load"),
        ([f"{MOTOR_KEY}.slip=0"], f"{MOTOR_KEY}.slip = 0 must lie between 0 and 1"),
        (
            [f"{MOTOR_KEY}.torque_ripple={{share: 2, order: 6}}"],
            "share = 2 must lie in 0..1",
        ),
        (
            [f"{MOTOR_KEY}.torque_ripple={{share: 0.1, order: 0.7}}"],
            "a multiple of 0.5 up to 100",
        ),
        ([f"+{MOTOR_KEY}.node=1"], "unknown key 'node'"),
        (["excitation.load.law=cubic"], "allowed: constant, linear, quadratic"),
        (
            ["excitation.reference.torque_nm=0"],
            "excitation.reference.torque_nm unless given, must be positive",
        ),
        ([f"{MOTOR_KEY}=3"], f"{MOTOR_KEY} = 3 must be a group of keys"),
        (
            ["--run", "500", "1000", "100"],
            f"turns evenly without {MOTOR_KEY}.torque_ripple",
        ),
        (["--time=0"], "give seconds above 0"),
        (["--time=nan"], "give seconds above 0"),
        (["--time=1000"], "give seconds above 0"),
    ],
)
def test_refused_responses_of_a_motor_line(words, text, capsys):
    assert text in refused(capsys, "forced-response", *MOTOR, *words)


def test_a_helical_mesh_has_no_stiffness_command(capsys):
    words = (*TRAIN, "system.record_mesh=[3,18]")
    error = refused(capsys, "stiffness", *words)
    assert "system.record_mesh 3/18 is of helical gears" in error


def test_the_figure_shows_the_forces_of_every_mesh(monkeypatch, drawn, tmp_path):
    monkeypatch.setattr(line_time, "SETTLING", 0.02)
    figure = tmp_path / "response.png"
    run("forced-response", *MOTOR, "--time", 0.1, "--plot", figure)
    panels = drawn[0]
    assert len(panels) == 6
    low, high = panels["Tooth force of the meshes, least to greatest"].get_ylim()
    assert low <= 0.0
    assert high > 3.991
    labels = {axes.get_xlabel() for axes in panels.values()}
    assert {label for label in labels if "angle" in label} == {
        "angle of the motor, degrees"
    }


def test_forced_response_prints_torque_and_meshes(drawn, tmp_path, capsys):
    figure = ("--plot", tmp_path / "response.png")
    run("forced-response", *MOTOR, *figure)
    printed = capsys.readouterr().out
    assert "60 N m of the load at the motor" in printed
    assert "mean 1995 N" in printed
    ripple = f"{MOTOR_KEY}.torque_ripple={{share: 0.02, order: 12}}"
    run_up = ("--run", 500, 1000, 100, "--run-torque", 30)
    run("forced-response", *MOTOR, ripple, *run_up, *figure)
    assert len(drawn) == 2
