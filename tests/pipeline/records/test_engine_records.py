"""Records of an engine's drive line: a small set through every verb, and what is refused in one line."""

import json

import h5py
import numpy as np
import pytest

from gensig.cli import main
from gensig.dataset.folder.layout import PLAN
from gensig.dataset.plan import PlanRows
from gensig.dynamics.backends.registry import BACKENDS, DEFAULT_BACKEND
from gensig.plan.request import read_request
from gensig.record.simulate import simulate_record

SMALL = (
    "experiment=engine_broken_tooth",
    "operating.duration_s=0.05",
    "plan.n_records=4",
    "plan.n_units=1",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("engine") / "set"
    assert main(["generate", *SMALL, f"out={out}"]) == 0
    return out


def test_a_set_is_whole_and_its_records_come_again(folder, capsys):
    assert main(["verify", str(folder)]) == 0
    assert main(["inspect", str(folder)]) == 0
    assert "flywheel_speed, pump_end_speed" in capsys.readouterr().out
    assert main(["reproduce", str(folder), "--records", "2"]) == 0


def test_simulate_shows_and_writes_a_record_of_the_engine(folder, tmp_path, capsys):
    words = [
        "simulate",
        "--from",
        str(folder),
        "--record",
        "1",
        "--plot",
        str(tmp_path / "one.png"),
    ]
    assert main([*words, "--output", str(tmp_path / "one.csv")]) == 0
    told = capsys.readouterr().out
    assert "flywheel_speed" in told
    assert "rad/s " in told
    with open(tmp_path / "one.csv") as file:
        header = "time_s,flywheel_speed_rad_per_s,pump_end_speed_rad_per_s,pinion_rotation_rad_per_s2"
        assert file.readline().startswith(header)


def test_labels_units_and_columns_tell_gear_tooth_and_shaft(folder):
    with h5py.File(folder / "shards" / "shard-00000.h5") as file:
        units = [value.decode() for value in file.attrs["channel_units"]]
        assert units == ["rad/s", "rad/s", "rad/s^2", "rad/s^2"]
        assert {value.decode() for value in file["status"][:]} == {"ok"}
        assert {value.decode() for value in file["integration_check"][:]} == {"energy"}
        assert np.all(file["integration_error"][:] < 1e-3)
        names = [value.decode() for value in file["label_name"][:]]
        assert sorted(names) == ["broken", "crack", "healthy", "missing_tooth"]
        for name, gear, tooth in zip(
            names, file["fault_gear"][:], file["fault_tooth"][:], strict=True
        ):
            assert (gear.decode(), 0 <= tooth < 54) == (
                ("", False) if name == "healthy" else ("wheel", True)
            )
        # the driving shaft of the mesh is the camshaft, at half the crank's speed
        np.testing.assert_allclose(
            file["speed_set_rpm"][:], 0.5 * file["params/operating.speed_rpm"][:]
        )
        np.testing.assert_allclose(
            file["mesh_frequency_hz"][:], 54 * file["speed_rpm"][:] / 60
        )
        signals = file["acceleration"][:]
        assert np.isfinite(signals).all()
        assert np.all(signals.std(axis=-1) > 0.0)


def test_a_record_depends_on_its_row_alone_and_a_sham_has_no_fault(folder):
    config = read_request([*SMALL]).config
    rows = PlanRows(folder / PLAN).records(0, 4)
    faulty = next(row for row in rows if row["label_name"] == "missing_tooth")
    with h5py.File(folder / "shards" / "shard-00000.h5") as file:
        stored = file["acceleration"][int(faulty["row"])]
    np.testing.assert_array_equal(
        simulate_record(config, faulty).signals["acceleration"], stored
    )
    sham = simulate_record(config.with_keys("plan", sham=True), faulty)
    assert not np.array_equal(sham.signals["acceleration"], stored)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["system.record_mesh=null"], "give its two nodes, one of 3/18, 19/20"),
        (["system.record_mesh=[18,3]"], "no such mesh; there are 3/18, 19/20"),
        (["system.helical_meshes=rigid"], "allowed: sliced, constant"),
        (["system.record_mesh=[3,18]", "mesh.slices_in_phase=true"], "take false"),
        (["sensing.channels=[pinion_x]"], "with system.lateral=true also pinion_x"),
        (
            ["sensing.channels=[crank_speed]"],
            "allowed: pinion_rotation, wheel_rotation, flywheel_speed",
        ),
        (["sensing=housing"], "no channel pinion_x"),
        (["sensing.sensor.low_cutoff_hz=1"], "take sensing=shaft_line"),
        (["mesh.law=paper"], "the meshes of a drive line are one-sided"),
        (["solver.precision=float32"], "integrated in float64"),
        (["solver.backend=euler"], "solver.backend = 'euler'; allowed: runge_kutta"),
        (["dataset.store_mesh_state=true"], "take false"),
        (["heat=chongqing_rated"], "a drive line takes heat=none"),
        (["operating.torque_nm=-5"], "must be positive"),
        (["fault.tooth=60"], "whose teeth are 0..53"),
    ],
)
def test_what_no_record_can_be_made_of_is_refused_in_one_line(
    words, told, tmp_path, capsys
):
    assert main(["generate", *SMALL, *words, f"out={tmp_path / 'set'}"]) != 0
    error = capsys.readouterr().err.strip()
    assert told in error
    assert "\n" not in error
    assert not (tmp_path / "set").exists()


def test_a_backend_of_gear_pairs_is_refused(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(BACKENDS, "other", BACKENDS[DEFAULT_BACKEND])
    assert (
        main(["generate", *SMALL, "solver.backend=other", f"out={tmp_path / 'set'}"])
        != 0
    )
    error = capsys.readouterr().err.strip()
    assert error.endswith(
        "solver.backend = other: a drive line has an integrator of its own; leave it out"
    )
    assert "\n" not in error


@pytest.mark.parametrize("seconds", ["0", "-1", "nan", "1000"])
def test_a_time_that_cannot_be_is_refused(seconds, capsys):
    words = ["forced-response", "system=engine_gear_train", "excitation=engine_v20"]
    assert main([*words, f"--time={seconds}"]) != 0
    assert "give seconds above 0" in capsys.readouterr().err


def test_forced_response_in_time_says_what_parts(tmp_path, capsys):
    out = tmp_path / "found.json"
    words = [
        "forced-response",
        "system=engine_gear_train",
        "excitation=engine_v20",
        "--nodes",
        "14",
        "45",
    ]
    assert main([*words, "--time", "0.3", "--json", str(out)]) == 0
    content = json.loads(out.read_text())
    drive = content["meshes"].index("21/45")
    assert content["time_energy_residual"] < 1e-3
    assert content["time_contact_loss_fraction"][drive] > 0.1
    assert (
        content["time_speed_fluctuation_rpm"][1]
        > 1.5 * content["speed_fluctuation_rpm"][44]
    )
    assert (
        content["time_greatest_tooth_force_n"][drive]
        > content["mean_tooth_force_n"][drive]
    )
    assert "on the back flanks" in capsys.readouterr().out
