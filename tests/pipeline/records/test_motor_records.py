"""Records of a two-stage gearbox that a motor turns: a small set through the verbs, lives, and what is refused."""

import json
import warnings
from dataclasses import replace

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose

from gensig.cli import main
from gensig.commands.figures import engine_figures
from gensig.dataset.folder.layout import PLAN
from gensig.dataset.plan import PlanRows
from gensig.driveline import in_time as line_time
from gensig.driveline import loads as line_loads
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.machines import read_machine
from gensig.record.simulate import simulate_record
from gensig.systems.spur_pair import SpurPair

SMALL = (
    "experiment=two_stage",
    "operating.duration_s=0.1",
    "plan.n_records=8",
    "plan.n_units=2",
    "plan.n_gearboxes=1",
)
MOTOR = ("system=two_stage_gearbox", "excitation=motor_and_load")
SECOND = ("system.record_mesh=[5,6]", "fault.gear=wheel")
LIFE = (
    "experiment=two_stage", "plan.n_records=null", "plan.n_repeats=1", "plan.n_units=2", "plan.n_gearboxes=1",
    "plan.vary={}", "life.snapshot_count=3", "life.n_setpoints=1", "operating.torque_nm=150",
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("two_stage") / "set"
    assert main(["generate", *SMALL, *SECOND, f"out={out}"]) == 0
    return out


def test_a_set_of_the_second_stage_is_whole_and_tells_gear_and_tooth(folder, capsys):
    assert main(["verify", str(folder)]) == 0
    capsys.readouterr()
    assert main(["inspect", str(folder)]) == 0
    assert "of the load, as the motor feels it" in capsys.readouterr().out
    assert (
        "torque of the load, as the motor feels it |"
        in (folder / "README.md").read_text()
    )
    with h5py.File(folder / "shards" / "shard-00000.h5") as file:
        assert {value.decode() for value in file["status"][:]} == {"ok"}
        assert np.all(file["integration_error"][:] < 1e-3)
        assert [value.decode() for value in file.attrs["channel_units"]] == [
            "rad/s^2",
            "rad/s^2",
            "m/s^2",
            "m/s^2",
        ]
        names = [value.decode() for value in file["label_name"][:]]
        assert set(names) == {"healthy", "crack", "broken", "missing_tooth"}
        for name, gear, tooth in zip(
            names, file["fault_gear"][:], file["fault_tooth"][:], strict=True
        ):
            assert (gear.decode(), 0 <= tooth < 80) == (
                ("", False) if name == "healthy" else ("wheel", True)
            )
        assert_allclose(
            file["speed_set_rpm"][:], file["params/operating.speed_rpm"][:] / 3.0
        )
        assert_allclose(file["mesh_frequency_hz"][:], 48 * file["speed_rpm"][:] / 60)
        assert np.isfinite(file["acceleration"][:]).all()


def test_a_record_depends_on_its_row_alone(folder):
    row = PlanRows(folder / PLAN).records(0, 8)[5]
    with h5py.File(folder / "shards" / "shard-00000.h5") as file:
        stored = file["acceleration"][int(row["row"])]
    again = simulate_record(read_request([*SMALL, *SECOND]).config, row)
    np.testing.assert_array_equal(again.signals["acceleration"], stored)


@pytest.mark.parametrize(
    ("life", "kind"), [("crack_growth", "crack"), ("pit_growth", "distributed_pitting")]
)
def test_lives_grow_under_the_steady_loads_of_the_mesh(life, kind, monkeypatch):
    monkeypatch.setattr(line_loads, "SECONDS", 0.1)
    columns = make_plan(
        read_request([*LIFE, f"life={life}", f"plan.classes=[healthy,{kind}]"]).config
    ).columns
    grown = columns["label_name"] == kind
    assert columns["severity"][grown].max() > columns["severity"][grown].min()
    assert (columns["severity"][~grown] == 0.0).all()


def test_loads_of_a_steady_mesh_are_its_static_torque(monkeypatch):
    monkeypatch.setattr(line_loads, "SECONDS", 0.1)
    machine = read_machine(read_request(["experiment=two_stage"]).config)
    loads = machine.mesh_torques(machine.operating.speed, 30.0)
    assert_allclose(loads, 30.0, rtol=0.35)


def test_simulate_shows_writes_and_repeats_records_of_the_line(
    folder, tmp_path, capsys
):
    words = [
        "simulate",
        "experiment=two_stage",
        "operating.duration_s=0.1",
        "fault=missing_tooth",
    ]
    assert (
        main(
            [
                *words,
                "--plot",
                str(tmp_path / "one.png"),
                "--output",
                str(tmp_path / "one.csv"),
            ]
        )
        == 0
    )
    told = capsys.readouterr().out
    assert "class missing_tooth" in told
    assert "speed 174" in told
    with open(tmp_path / "one.csv") as file:
        assert file.readline().startswith(
            "time_s,pinion_rotation_rad_per_s2,wheel_rotation_rad_per_s2,pinion_y_m_per_s2"
        )
    assert (tmp_path / "one.png").stat().st_size > 10000
    rows = PlanRows(folder / PLAN).records(0, 8)
    number = next(
        k for k, row in enumerate(rows) if row["label_name"] == "missing_tooth"
    )
    again = ["simulate", "--from", str(folder), "--record", str(number), "--output"]
    assert main([*again, str(tmp_path / "again.h5")]) == 0
    assert main([*again, str(tmp_path / "twin.h5"), "--twin"]) == 0
    with (
        h5py.File(tmp_path / "again.h5") as own,
        h5py.File(tmp_path / "twin.h5") as twin,
    ):
        with h5py.File(folder / "shards" / "shard-00000.h5") as file:
            stored = file["acceleration"][int(rows[number]["row"])]
        assert_allclose(own["acceleration"][0], stored, rtol=0.0, atol=0.0)
        assert twin["severity"][0] == 0.0
        assert not np.array_equal(twin["acceleration"][0], stored)


def test_gears_that_bear_far_more_than_their_support_is_for_are_named():
    words = ["experiment=two_stage", "operating.torque_nm=60"]
    with pytest.warns(
        UserWarning,
        match="meshes 3/4 1995 N, 5/6 3991 N, but every gear is on a support for .* 500 N",
    ):
        read_machine(read_request(words).config).check()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read_machine(
            read_request([*words, "system.support.force_n=2000"]).config
        ).check()
        torsion = [
            "system.lateral=false",
            "sensing.channels=[pinion_rotation,wheel_rotation]",
        ]
        read_machine(read_request([*words, *torsion]).config).check()


def test_stiffness_is_that_of_the_record_mesh_and_a_helical_one_is_refused(
    tmp_path, capsys
):
    words = [
        "stiffness",
        *MOTOR,
        "system.record_mesh=[5,6]",
        "operating.torque_nm=60",
        "fault=crack",
    ]
    out = tmp_path / "curves.json"
    assert (
        main([*words, "--json", str(out), "--plot", str(tmp_path / "curves.png")]) == 0
    )
    content = json.loads(out.read_text())
    # the same teeth as a pair, under what the first stage makes of the torque
    line = read_machine(
        read_request(
            [*MOTOR, "system.record_mesh=[5,6]", "operating.torque_nm=60"]
        ).config
    )
    alone = SpurPair(
        pair=line.pair, material=line.material, mesh=line.mesh, pinion=line.pinion, wheel=line.wheel,
        operating=replace(line.operating, torque=180.0), sensing=line.sensing, quality=line.quality, solver=line.solver,
    ).stiffness_curves()  # fmt: skip
    assert_allclose(
        line.stiffness_curves().mesh_stiffness, alone.mesh_stiffness, rtol=1e-9
    )
    assert min(content["faulty_pair_stiffness_n_per_m"]) < min(
        content["single_pair_stiffness_n_per_m"]
    )
    capsys.readouterr()
    engine = [
        "system=engine_gear_train",
        "excitation=engine_v20",
        "system.record_mesh=[3,18]",
    ]
    assert main(["stiffness", *engine]) != 0
    error = capsys.readouterr().err.strip()
    assert "system.record_mesh 3/18 is of helical gears" in error
    assert "\n" not in error


def test_an_encoder_and_the_load_s_own_torque_are_stored(tmp_path):
    wheel = "{node: 1, n_teeth: 60, eccentricity_error_deg: 0, tooth_error_deg: 0, clock_frequency_hz: 100000000}"
    words = (
        f"excitation.toothed_wheels={{motor: {wheel}}}", "sensing.channels=[motor_speed, wheel_rotation]",
        "excitation.load.law=quadratic", "operating=ramp", "operating.speed_profile.first_factor=0.5",
        "dataset.store_operating=true", "operating.speed_rpm=1746", "operating.torque_nm=30",
        "operating.duration_s=0.1",
    )  # fmt: skip
    out = tmp_path / "set"
    assert (
        main(
            [
                "generate",
                *SMALL,
                *words,
                "plan.n_records=4",
                "plan.n_units=1",
                f"out={out}",
            ]
        )
        == 0
    )
    with h5py.File(out / "shards" / "shard-00000.h5") as file:
        torque = file["torque_set"][:]
        assert_allclose(torque[:, 0], 0.25 * 30.0, rtol=1e-3)
        assert_allclose(torque[:, -1], 30.0, rtol=0.01)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (
            ["system.motor_node=null"],
            "one of 1, 2, 3, 4, 5, 6, 7, 8; the tables want system.motor_node, system.load_node",
        ),
        (
            ["system.motor_node=99"],
            "system.motor_node = 99: the shaft line has no node 99; it has 1, 2, 3",
        ),
        (["system.motor_node=8"], "turns 0.2 times as fast as the first node"),
        (
            ["system.load_node=null"],
            "system.load_node = null: excitation=motor_and_load needs the node of its load",
        ),
        (
            ["system.load_node=99"],
            "has 1, 2, 3, 4, 5, 6, 7, 8; the tables want system.motor_node, system.load_node and, for records",
        ),
        (
            ["excitation.loads={fan: {node: 99, law: linear, torque_nm: 1}}"],
            "excitation.loads.fan.node: the shaft line",
        ),
        (
            ["excitation.loads={fan: {node: 2, law: cubic, torque_nm: 1}}"],
            "excitation.loads.fan.law = 'cubic'",
        ),
        (["+excitation.cylinder={bore_mm: 100}"], "a line is turned by one of them"),
        (
            ["excitation=engine_v20", "+excitation.motor={slip: 0.1}"],
            "a line is turned by one of them",
        ),
        (["excitation=engine_v20"], "the shaft line has no node 13"),
        (["excitation.kind=turbine"], "allowed: engine, motor_and_load"),
        (
            ["excitation.motor.slip=0"],
            "excitation.motor.slip = 0 must lie between 0 and 1",
        ),
        (
            ["excitation.motor.torque_ripple={share: 2, order: 6}"],
            "excitation.motor.torque_ripple.share = 2 must lie in 0..1",
        ),
        (
            ["excitation.motor.torque_ripple={share: 0.1, order: 0.7}"],
            "a multiple of 0.5 up to 100",
        ),
        (["+excitation.motor.node=1"], "unknown key 'node'"),
        (
            ["excitation.load.law=cubic"],
            "excitation.load.law = 'cubic'; allowed: constant, linear, quadratic",
        ),
        (
            ["excitation.reference.torque_nm=0"],
            "speed_rpm and torque_nm must be positive",
        ),
        (["excitation.motor=3"], "excitation.motor = 3 must be a group of keys"),
    ],
)
def test_what_turns_no_line_is_refused_in_one_line(words, told, capsys):
    assert main(["forced-response", *MOTOR, *words]) != 0
    error = capsys.readouterr().err.strip()
    assert told in error
    assert "\n" not in error


def test_the_figure_shows_the_forces_of_every_mesh(monkeypatch, tmp_path):
    monkeypatch.setattr(line_time, "SETTLING", 0.02)
    drawn = []
    monkeypatch.setattr(
        engine_figures,
        "save",
        lambda figure, path: drawn.append(figure) or path.write_bytes(b"0"),
    )
    assert (
        main(
            [
                "forced-response",
                *MOTOR,
                "--time",
                "0.1",
                "--plot",
                str(tmp_path / "found.png"),
            ]
        )
        == 0
    )
    panels = {axes.get_title(): axes for axes in drawn[0].axes}
    assert len(panels) == 6
    low, high = panels["Tooth force of the meshes, least to greatest"].get_ylim()
    assert low <= 0.0
    assert high > 3.991
    assert {"angle of the motor, degrees"} == {
        axes.get_xlabel() for axes in panels.values() if "angle" in axes.get_xlabel()
    }


def test_forced_response_says_torque_and_meshes_and_draws(tmp_path, capsys):
    assert main(["forced-response", *MOTOR, "--plot", str(tmp_path / "found.png")]) == 0
    told = capsys.readouterr().out
    assert "60 N m of the load at the motor" in told
    assert "mean 1995 N" in told
    assert (tmp_path / "found.png").stat().st_size > 10000
    assert main(["forced-response", *MOTOR, "--run", "500", "1000", "100"]) != 0
    assert (
        "turns evenly without excitation.motor.torque_ripple" in capsys.readouterr().err
    )
    ripple = "excitation.motor.torque_ripple={share: 0.02, order: 12}"
    words = [
        ripple,
        "--run",
        "500",
        "1000",
        "100",
        "--run-torque",
        "30",
        "--plot",
        str(tmp_path / "run.png"),
    ]
    assert main(["forced-response", *MOTOR, *words]) == 0
