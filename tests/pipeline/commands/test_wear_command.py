"""gensig wear-life from the command line: what it writes, what it warns of, what it refuses in one line."""

import json

import numpy as np
import pytest
import yaml

from gensig.cli import main

HARBIN = "gear=harbin_38_55"
FAST = ["gear.addendum_coefficient=1", HARBIN, "wear.threshold_um=5"]


def life(tmp_path, *words):
    out = tmp_path / "life.json"
    assert main(["wear-life", *words, "--json", str(out)]) == 0
    return json.loads(out.read_text())


def test_the_papers_pair_from_the_command_line(tmp_path, capsys):
    content = life(tmp_path, HARBIN)
    complaint = capsys.readouterr().err
    assert "WARNING: the transverse contact ratio 0.9187 is below 1" in complaint
    assert content["transverse_contact_ratio"] == pytest.approx(0.9187, abs=1e-4)
    pitch = int(np.argmin(np.abs(content["sliding_velocity_mm_per_s"])))
    for key, values in (
        ("pressure_angle_deg", np.degrees([0.280575, 0.35, 0.414578])),
        ("sliding_velocity_mm_per_s", [116.6, 0.0, -113.9]),
        ("contact_pressure_mpa", [602.0, 572.0, 563.0]),
    ):
        found = [content[key][place] for place in (0, pitch, -1)]
        assert found == pytest.approx(values, rel=1e-3, abs=1e-6)
    assert content["pinion_wear_per_mesh_nm"][pitch] == pytest.approx(0.0, abs=1e-9)
    assert content["rule"] == "band"
    assert content["threshold_um"] == pytest.approx(100.0)
    turns = content["life_hours"] * 120 * 60
    assert turns == pytest.approx(content["life_turns"])
    assert turns * content["pinion_wear_per_mesh_nm"][0] * 1e-3 == pytest.approx(100.0)


def test_keys_of_the_papers_rule(tmp_path):
    words = [
        HARBIN,
        "wear.rule=fixed_intervals",
        "wear.load_radius=reference",
        "wear.geometry=unworn",
    ]
    content = life(tmp_path, *words, "wear.n_intervals=50", "wear.criterion=sum")
    assert content["pair_wear_per_mesh_nm"][0] == pytest.approx(0.0560, rel=1e-3)
    assert content["pinion_wear_per_mesh_nm"][0] == pytest.approx(0.0280, rel=1e-3)
    assert content["contact_pressure_mpa"][0] == pytest.approx(583.0, rel=1e-3)
    assert content["life_hours"] == pytest.approx(100.0 / (17.05 / 50.0), rel=1e-3)
    assert content["torque_exponent"] == pytest.approx(0.5, abs=1e-6)
    assert content["n_intervals"] == 50
    assert content["deepest"]["gear"] == "both"
    harder = life(tmp_path, *words, "wear.hardness_hbs=374")
    assert harder["life_hours"] / life(tmp_path, *words)["life_hours"] == pytest.approx(
        2.0
    )


def test_worn_flanks_are_told_and_drawn(tmp_path, capsys):
    figure = tmp_path / "life.png"
    content = life(tmp_path, *FAST, "--plot", str(figure))
    assert figure.read_bytes().startswith(b"\x89PNG")
    assert capsys.readouterr().err == ""
    assert content["sharing"] == "mesh"
    assert max(content["pinion_depth_um"]) == pytest.approx(5.0, rel=1e-6)
    assert max(content["wheel_depth_um"]) < 5.0
    history = content["history"]
    assert history["pinion_depth_um"][0] == 0.0
    assert history["hours"][-1] == pytest.approx(content["life_hours"])
    error = history["transmission_error_peak_to_peak_um"]
    assert error[-1] < 0.95 * error[0]  # so little wear is a relief
    new, worn = (
        np.array(content[f"pinion_curvature_radius_{key}_mm"])
        for key in ("new", "worn")
    )
    assert np.abs(worn / new - 1.0).max() > 0.01
    assert content["n_intervals"] is None


def test_a_map_and_its_laws(tmp_path, capsys):
    figure = tmp_path / "map.svg"
    words = [
        "--torques",
        "50",
        "100",
        "200",
        "--speeds",
        "60",
        "120",
        "--plot",
        str(figure),
    ]
    content = life(tmp_path, HARBIN, *words)
    lives = np.array(content["map"]["life_hours"])
    assert content["map"]["torque_nm"] == [50.0, 100.0, 200.0]
    assert content["map"]["speed_rpm"] == pytest.approx([60.0, 120.0])
    assert lives[:, 0] / lives[:, 1] == pytest.approx([2.0, 2.0, 2.0])
    assert lives[2, 1] == pytest.approx(content["life_hours"])
    power = content["laws"][0]
    assert (power["form"], power["coefficients"]["b"]) == ("power", pytest.approx(1.0))
    assert power["torque_nm"] == [50.0, 200.0]
    assert [law["form"] for law in content["laws"]] == [
        "power",
        "logarithm",
        "exponential",
    ]
    logarithm = content["laws"][1]
    assert (
        f"no life from {logarithm['no_life_from_torque_nm']:.4g} N m on"
        in capsys.readouterr().out
    )
    assert logarithm["no_life_from_torque_nm"] > 200.0
    assert figure.stat().st_size > 1000


def test_worn_flanks_as_an_option_that_other_commands_take(tmp_path, capsys):
    target = tmp_path / "mine" / "fault" / "worn.yaml"
    target.parent.mkdir(parents=True)
    assert main(["wear-life", "wear.threshold_um=20", "--out", str(target)]) == 0
    assert "fault=worn --config-dir" in capsys.readouterr().out
    assert main(["wear-life", "wear.threshold_um=20", "--out", str(target)]) == 2
    assert "add --force to replace it" in capsys.readouterr().err
    option = yaml.safe_load(target.read_text())
    assert [part["gear"] for part in option["parts"]] == ["pinion", "wheel"]
    words = [
        "fault=worn",
        "--config-dir",
        str(tmp_path / "mine"),
        "operating.duration_s=0.1",
    ]
    assert main(["simulate", *words]) == 0
    assert "severity 1.0" in capsys.readouterr().out
    out = tmp_path / "s.json"
    assert main(["stiffness", *words, "--json", str(out)]) == 0
    gap = json.loads(out.read_text())["faulty_pair_gap_um"]
    assert 15.0 < max(gap) < 40.0


def test_a_helical_pair_wears_slice_by_slice(tmp_path):
    content = life(
        tmp_path, "system=helical_pair", "mesh.n_slices=6", "wear.threshold_um=5"
    )
    assert np.shape(content["wheel_depth_by_slice_um"]) == (
        6,
        len(content["position_mm"]),
    )
    assert content["overlap_ratio"] > 0.9
    assert max(content["pinion_depth_um"]) == pytest.approx(5.0, rel=1e-6)


def test_what_would_yield_before_it_wears_is_said(capsys):
    assert main(["wear-life"]) == 0
    assert "above 0.6 of the hardness" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["wear.threshold_um=9000"], "is deeper than the tooth"),
        (
            ["wear.threshold=50"],
            "unknown key 'wear.threshold'; did you mean 'wear.threshold_um'",
        ),
        (["wear.hardness_hbs=0"], "wear.hardness_hbs = 0 must be positive"),
        (["wear.coefficient=-1"], "wear.coefficient = -1 must be positive"),
        (["wear.wheel.coefficient=3"], "wear.wheel.coefficient = 3 must be at most 1"),
        (
            ["wear.transmission_error_limit_um=1.3", "--map"],
            "at 30 N m of the map: wear.transmission_error_limit_um",
        ),
        (["wear=rust"], "no option 'rust' of wear; there is archard"),
        (["fault=wear"], "a life begins with sound flanks"),
        (["operating.speed_rpm=0"], "speed"),
        (["--plot", "life.txt"], "the name must end in .png"),
        (["--out", "mine/worn wheel.yaml"], "NAME without spaces"),
        (["--torques", "50"], "a map needs two torques or more"),
        (["--speeds", "-5", "5"], "all positive"),
    ],
)
def test_mistakes_are_one_line(words, message, capsys):
    assert main(["wear-life", *words]) == 2
    text = capsys.readouterr().err
    assert message in text
    assert len(text.strip().splitlines()) == 1


def test_records_refuse_the_papers_pair_and_plans_its_keys(tmp_path, capsys):
    assert main(["simulate", HARBIN, "operating.duration_s=0.1"]) == 2
    assert "contact ratio 0.9187 is below 1" in capsys.readouterr().err
    vary = "plan.vary={wear.threshold_um: {distribution: uniform, low: 10, high: 20}}"
    assert main(["plan", vary]) == 2
    assert "one value for a whole data set" in capsys.readouterr().err
    assert main(["plan", "wear.rule=rust"]) == 2
    assert (
        "wear.rule = 'rust'; allowed: band, fixed_intervals" in capsys.readouterr().err
    )
