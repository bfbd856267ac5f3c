"""The verb forced-response from the command line: what it writes, and what it refuses in one line."""

import json

import numpy as np
import pytest
from engine_cases import option, response_of
from numpy.testing import assert_allclose

from gensig.cli import main

ENGINE = ("system=engine_gear_train", "excitation=engine_v20")
RPM = np.pi / 30.0


def found_by(tmp_path, *words):
    out = tmp_path / "response.json"
    assert main(["forced-response", *ENGINE, *words, "--json", str(out)]) == 0
    return json.loads(out.read_text())


def test_it_writes_the_response_of_every_node(tmp_path, capsys):
    content = found_by(tmp_path, "--nodes", "14", "45")
    own = response_of(option()).fluctuation() / RPM
    assert_allclose(content["speed_fluctuation_rpm"], own, rtol=1e-5)
    assert content["torque_nm"] == 12680
    assert_allclose(content["mean_speed_rpm"][44], 844.0)
    assert np.shape(content["angle_deg"]) == (2, len(content["orders"]))
    assert content["orders"][:3] == [0.5, 1.0, 1.5]
    seen = content["toothed_wheel_fluctuation_rpm"]
    assert own[13] < seen["flywheel"] < 1.3 * own[13]  # teeth out of place add to it
    assert (
        0.5 * own[44] < seen["pump_end"] < 1.1 * own[44]
    )  # a mean over one spacing loses what 120 teeth cannot hold
    drive = content["meshes"].index("21/45")
    assert (
        content["least_tooth_force_n"][drive]
        < 0.0
        < content["mean_tooth_force_n"][drive]
    )
    printed = capsys.readouterr().out
    assert "Flywheel" in printed
    assert "would part" in printed


def test_a_run_of_speeds_and_a_disturbance_are_written_and_drawn(tmp_path):
    figure = tmp_path / "response.png"
    content = found_by(
        tmp_path,
        "excitation.dynamometer.disturbance_share=0.05",
        *(
            "--nodes",
            "14",
            "--run",
            "700",
            "1000",
            "100",
            "--plot",
            str(figure),
            "--speed",
            "1000",
            "--torque",
            "4000",
        ),
    )
    assert content["run_speeds_rpm"] == pytest.approx([700, 800, 900, 1000])
    assert np.shape(content["run_speed_fluctuation_rpm"]) == (1, 4)
    assert np.shape(content["run_angle_deg"])[:2] == (1, 4)
    assert content["disturbance_frequency_hz"] == 5.0
    assert content["disturbance_angle_deg"][0] > 0.0
    assert (content["speed_rpm"], content["torque_nm"]) == (pytest.approx(1000), 4000)
    assert figure.stat().st_size > 50_000


def test_lateral_motion_of_the_gears_is_taken_along(tmp_path):
    flat, lateral = (
        found_by(tmp_path, *words) for words in ((), ("system.lateral=true",))
    )
    flywheel = flat["node_numbers"].index(14)
    assert (
        len(lateral["speed_fluctuation_rpm"])
        == len(flat["speed_fluctuation_rpm"])
        == 67
    )
    assert_allclose(
        lateral["speed_fluctuation_rpm"][flywheel],
        flat["speed_fluctuation_rpm"][flywheel],
        rtol=0.02,
    )  # gears on soft bearings are not what the flywheel feels


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("excitation=engine_v20",), "system.kind = 'spur_pair' is no drive line"),
        (
            ("system=engine_gear_train",),
            "no excitation is chosen; take excitation=engine_v20",
        ),
        (
            (*ENGINE, "--nodes", "99"),
            "--nodes 99: the shaft line has no such node; it has 1 to 67",
        ),
        (
            (*ENGINE, "--run", "900", "700", "10"),
            "--run 900 700 10: give low, high and step",
        ),
        ((*ENGINE, "--torque", "-5"), "the brake torque -5 N m is below the friction"),
        (
            (*ENGINE, "--speed", "0"),
            "the speed of the crank, 0 r/min, must be positive",
        ),
        (
            (*ENGINE, "--speed", "4000"),
            "the follower leaves its cam at 2000 r/min of the camshaft",
        ),
        ((*ENGINE, "--plot", "a.txt"), "--plot a.txt: the name must end in .png"),
        (
            (*ENGINE, "excitation.dynamometer.node=99", "--nodes", "14"),
            "excitation.dynamometer.node: the shaft line has no node 99",
        ),
        (
            (*ENGINE, "excitation.throw_nodes=[99,12,11,10,9,8,7,6,5,4]"),
            "excitation.throw_nodes: the shaft line has no",
        ),
        (
            (*ENGINE, "excitation.pressure.file=none.csv"),
            "excitation.pressure.file = none.csv cannot be read",
        ),
        (
            (*ENGINE, "excitation.pressure.file=none.csv", "--torque", "5"),
            "excitation.pressure.file decides the torque",
        ),
        ((*ENGINE, "excitation=engine_v2"), "no option 'engine_v2' of excitation"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(words, message, capsys):
    assert main(["forced-response", *words]) == 2
    printed = capsys.readouterr().err.strip()
    assert message in printed
    assert "\n" not in printed


def test_a_pair_takes_no_excitation(capsys):
    assert main(["plan", "excitation=engine_v20", "plan.n_records=4"]) == 2
    assert "excitation turns a drive line" in capsys.readouterr().err
