"""gensig wear-life: lives by depth, transmission error and vibration, maps, worn flanks."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from figure_labels import labels
from numpy.testing import assert_allclose

from gensig.cli import main
from gensig.life.wear.wear_life import wear_life
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader
from gensig.record.simulate import simulate_record
from gensig.record.vibration_limit import ROW, limited_by_vibration
from gensig.systems.wear import read_wear_case, wear_fault

HARBIN = "wear-life gear=harbin_38_55"
FAST = (
    "operating.duration_s=0.1",
    "sensing.channels=[pinion_y,wheel_y]",
    "wear.threshold_um=40",
)


def test_the_pair_of_the_paper(written, capsys):
    content = written(HARBIN)
    complaint = capsys.readouterr().err
    assert "WARNING: the transverse contact ratio 0.9187 is below 1" in complaint
    sliding, pressure = content["sliding_velocity_mm_per_s"], "contact_pressure_mpa"
    assert sliding[0] == pytest.approx(116.6, rel=1e-3)
    assert content[pressure][0] == pytest.approx(602.0, rel=1e-3)
    assert np.degrees(0.280575) == pytest.approx(content["pressure_angle_deg"][0], 1e-3)
    assert (content["rule"], content["threshold_um"]) == ("band", pytest.approx(100.0))
    turns = content["life_hours"] * 120 * 60
    assert turns == pytest.approx(content["life_turns"])
    wear = content["pinion_wear_per_mesh_nm"]
    assert turns * wear[0] * 1e-3 == pytest.approx(100.0)


def test_keys_of_the_rule_of_the_paper(written):
    rule = (
        f"{HARBIN} wear.rule=fixed_intervals wear.load_radius=reference "
        "wear.geometry=unworn"
    )
    content = written(f"{rule} wear.n_intervals=50 wear.criterion=sum")
    assert content["pair_wear_per_mesh_nm"][0] == pytest.approx(0.0560, rel=1e-3)
    assert content["life_hours"] == pytest.approx(100.0 / (17.05 / 50.0), rel=1e-3)
    assert content["torque_exponent"] == pytest.approx(0.5, abs=1e-6)
    assert content["n_intervals"] == 50
    assert content["deepest"]["gear"] == "both"


def test_worn_flanks_are_described_and_drawn(written, drawn, capsys):
    words = "gear.addendum_coefficient=1 wear.threshold_um=5"
    content = written(f"{HARBIN} {words} --plot life.png")
    assert capsys.readouterr().err == ""
    assert content["sharing"] == "mesh"
    assert content["n_intervals"] is None
    assert max(content["pinion_depth_um"]) == pytest.approx(5.0, rel=1e-6)
    assert max(content["wheel_depth_um"]) < 5.0
    history = content["history"]
    assert history["pinion_depth_um"][0] == 0.0
    assert history["hours"][-1] == pytest.approx(content["life_hours"])
    error = history["transmission_error_peak_to_peak_um"]
    assert error[-1] < 0.95 * error[0]  # so little wear is a relief
    new = np.array(content["pinion_curvature_radius_new_mm"])
    worn = np.array(content["pinion_curvature_radius_worn_mm"])
    assert np.abs(worn / new - 1.0).max() > 0.01
    panels = drawn[0]
    pressure = panels["Largest contact pressure"]
    assert labels(pressure) == ["new flanks", "at the end of the life"]
    assert_allclose(pressure.lines[0].get_ydata(), content["contact_pressure_mpa"])
    assert len(panels["Worn off at each quarter of the life"].lines) == 2 * 4 + 1
    assert labels(panels["Deepest point over time"]) == ["pinion", "wheel"]


def test_a_map_and_its_laws(written, drawn, capsys):
    content = written(f"{HARBIN} --torques 50 100 200 --speeds 60 120 --plot map.svg")
    lives = np.array(content["map"]["life_hours"])
    assert content["map"]["torque_nm"] == [50.0, 100.0, 200.0]
    assert content["map"]["speed_rpm"] == pytest.approx([60.0, 120.0])
    assert lives[:, 0] / lives[:, 1] == pytest.approx([2.0, 2.0, 2.0])
    assert lives[2, 1] == pytest.approx(content["life_hours"])
    power, logarithm, exponential = content["laws"]
    assert power["coefficients"]["b"] == pytest.approx(1.0)
    assert power["torque_nm"] == [50.0, 200.0]
    forms = (power["form"], logarithm["form"], exponential["form"])
    assert forms == ("power", "logarithm", "exponential")
    limit = logarithm["no_life_from_torque_nm"]
    assert f"no life from {limit:.4g} N m on" in capsys.readouterr().out
    assert limit > 200.0
    assert drawn[0]["Life"].get_xscale() == "log"


def test_other_commands_take_the_worn_flanks(gensig, written, tmp_path, capsys):
    target = tmp_path / "mine" / "fault" / "worn.yaml"
    target.parent.mkdir(parents=True)
    line = "wear-life wear.threshold_um=20 --out mine/fault/worn.yaml"
    said, warned = gensig(line)
    assert "fault=worn --config-dir" in said
    assert "above 0.6 of the hardness" in warned
    assert main(line.split()) == 2
    assert "add --force to replace it" in capsys.readouterr().err
    parts = yaml.safe_load(target.read_text())["parts"]
    assert [part["gear"] for part in parts] == ["pinion", "wheel"]
    worn = "fault=worn --config-dir mine operating.duration_s=0.1"
    assert "severity 1.0" in gensig(f"simulate {worn}")[0]
    gap = max(written(f"stiffness {worn}")["faulty_pair_gap_um"])
    assert 15.0 < gap < 40.0


def test_a_helical_pair_wears_slice_by_slice(written):
    words = "system=helical_pair mesh.n_slices=6 wear.threshold_um=5"
    content = written(f"wear-life {words}")
    n_points = len(content["position_mm"])
    assert np.shape(content["wheel_depth_by_slice_um"]) == (6, n_points)
    assert max(content["pinion_depth_um"]) == pytest.approx(5.0, rel=1e-6)


def config_of(*words):
    return read_request([*FAST, *words]).config


def limited(*words):
    config = config_of(*words)
    return limited_by_vibration(read_wear_case(config), InputReader(config))


@pytest.fixture(scope="module")
def by_rise():
    """The case and its vibration, whose limit is a rise by 4 dB."""
    return limited("wear.vibration_rise_db=4")


def recorded_rms(depth, case):
    """RMS of the noiseless record that a data set holds of flanks worn so far."""
    config = config_of("dataset.store_clean=true", "sensing.snr_db=null")
    counts = {"n_records": 1, "n_units": 1, "n_gearboxes": 1, "classes": ["worn"]}
    config = config.with_keys("plan", **counts)
    config = config.with_entries(classes={"worn": wear_fault(case, depth)})
    start = {key: value for key, value in ROW.items() if key.startswith("start")}
    row = {**make_plan(config).record(0), **start}
    clean = simulate_record(InputReader(config), row).signals["acceleration_clean"]
    return np.std(clean.astype(np.float64), axis=1)


def test_the_depth_found_is_where_records_reach_the_limit(by_rise):
    case, vibration = by_rise
    assert 3e-6 < vibration.limit_depth < 39e-6
    assert case.options.threshold == vibration.limit_depth
    life = wear_life(case)
    assert life.threshold == pytest.approx(vibration.limit_depth, rel=1e-6)
    new = recorded_rms(0.0 * life.depth[-1] + 1e-12, case)
    worn = recorded_rms(life.depth[-1], case)
    assert_allclose(new, vibration.rms[0], rtol=1e-4)
    assert 20.0 * np.log10((worn / new).max()) == pytest.approx(4.0, abs=0.1)
    before = vibration.depth < 0.999 * vibration.limit_depth
    assert vibration.rise[before].max() < 4.0


def test_a_limit_in_m_per_s2_is_of_the_loudest_sensor_and_the_first_of_both_counts(
    by_rise,
):
    _, rise = by_rise
    assert rise.rms[0, 0] > rise.rms[0, 1]
    level = rise.rms[0, 0] * 10.0 ** (2.0 / 20.0)
    assert level < rise.rms[:, 0].max()
    limit = f"wear.vibration_limit_m_per_s2={level}"
    _, by_level = limited(limit)
    end = int(np.argmin(np.abs(by_level.depth - by_level.limit_depth)))
    assert by_level.rms[end].max() == pytest.approx(level, rel=0.02)
    _, both = limited(limit, "wear.vibration_rise_db=4")
    first = min(by_level.limit_depth, rise.limit_depth)
    assert both.limit_depth == pytest.approx(first, rel=0.02)


def test_a_limit_that_is_not_reached_leaves_the_life_as_it_was():
    config = config_of("wear.vibration_rise_db=80")
    case = read_wear_case(config)
    same, vibration = limited_by_vibration(case, InputReader(config))
    assert same is case
    assert vibration.limit_depth is None
    assert vibration.depth[-1] == pytest.approx(case.options.threshold, rel=1e-6)
    without = replace(case, options=replace(case.options, vibration_rise=None))
    assert limited_by_vibration(without, InputReader(config)) == (without, None)


def test_vibration_ends_a_life_and_its_flanks_are_an_option(
    written, drawn, by_rise, tmp_path, capsys
):
    target = tmp_path / "mine" / "fault" / "loud.yaml"
    target.parent.mkdir(parents=True)
    line = f"wear-life {' '.join(FAST)} wear.vibration_rise_db"
    content = written(f"{line}=4 --plot life.png --out", target)
    text, vibration = capsys.readouterr().out, content["vibration"]
    assert "ended by                   vibration, " in text
    assert "limit of 4 dB reached" in text
    assert content["ended_by"] == "vibration"
    assert vibration["is_reached"] is True
    assert vibration["sensors"] == ["pinion_y", "wheel_y"]
    threshold = content["threshold_um"]
    assert max(content["pinion_depth_um"]) == pytest.approx(threshold, rel=1e-6)
    assert np.shape(vibration["rms_m_per_s2"]) == (len(vibration["hours"]), 2)
    end = int(np.argmin(np.abs(np.array(vibration["depth_um"]) - threshold)))
    assert vibration["hours"][end] == pytest.approx(content["life_hours"], rel=0.01)
    loudest = drawn[0][""]  # the second ordinate of the history
    assert loudest.get_ylabel().startswith("RMS of the loudest sensor")
    part = yaml.safe_load(target.read_text())["parts"][0]
    limit = by_rise[1].limit_depth * 1e6
    assert part["limit_um"] == pytest.approx(limit, rel=1e-3)
    content = written(f"{line}=80 wear.transmission_error_limit_um=1000")
    text = capsys.readouterr().out
    assert "ended by                   depth, 40 um" in text
    assert "limit of 80 dB not reached" in text
    assert "limit of 1000 um not reached" in text
    assert content["vibration"]["is_reached"] is False


def test_lives_of_a_data_set_end_at_the_depth_found():
    words = (
        "experiment=run_to_failure plan.classes=[wear] plan.n_units=2 "
        "life.snapshot_count=3 operating.duration_s=0.1 life.horizon_h=5000 "
        "wear.vibration_rise_db=4"
    )
    config = read_request(words.split()).config
    sound = config.with_entries(fault={"kind": "healthy"})
    _, vibration = limited_by_vibration(read_wear_case(sound), InputReader(config))
    assert 0.0 < vibration.limit_depth < 99e-6
    plan = make_plan(config)
    assert plan.columns["life_failed"].tolist() == [1] * 6
    for last in (2, 5):
        row = plan.record(last)
        parts = yaml.safe_load(row["faults_json"])
        depths = [part["wear_depth_um"] * max(part["wear_profile"]) for part in parts]
        assert max(depths) == pytest.approx(vibration.limit_depth * 1e6, rel=0.01)
        assert row["severity"] == pytest.approx(1.0, abs=0.01)
