"""A wear life that ends where the machine shakes too much: the depth is that of its own records."""

import json
from dataclasses import replace

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose

from gensig.cli import main
from gensig.life.wear.wear_life import wear_life
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.simulate import simulate_record
from gensig.record.vibration_limit import ROW, limited_by_vibration
from gensig.systems.wear import read_wear_case, wear_fault

FAST = (
    "operating.duration_s=0.1",
    "sensing.channels=[pinion_y,wheel_y]",
    "wear.threshold_um=40",
)


def config_of(*words):
    return read_request([*FAST, *words]).config


def limited(*words):
    config = config_of(*words)
    return limited_by_vibration(read_wear_case(config), config)


def recorded_rms(depth, case):
    """RMS of the noiseless record that a data set holds of flanks worn so far."""
    config = config_of("dataset.store_clean=true", "sensing.snr_db=null")
    fault = wear_fault(case, depth)
    config = config.with_keys(
        "plan", n_records=1, n_units=1, n_gearboxes=1, classes=["worn"]
    )
    config = config.with_entries(classes={"worn": fault})
    row = {
        **make_plan(config).record(0),
        **{key: value for key, value in ROW.items() if key.startswith("start")},
    }
    clean = simulate_record(config, row).signals["acceleration_clean"]
    return np.std(clean.astype(np.float64), axis=1)


def test_the_depth_found_is_where_records_reach_the_limit():
    case, vibration = limited("wear.vibration_rise_db=4")
    assert 3e-6 < vibration.limit_depth < 39e-6
    assert case.options.threshold == vibration.limit_depth
    life = wear_life(case)
    assert life.threshold == pytest.approx(vibration.limit_depth, rel=1e-6)
    new, worn = (
        recorded_rms(0.0 * life.depth[-1] + 1e-12, case),
        recorded_rms(life.depth[-1], case),
    )
    assert_allclose(new, vibration.rms[0], rtol=1e-4)
    assert 20.0 * np.log10((worn / new).max()) == pytest.approx(4.0, abs=0.1)
    before = vibration.depth < 0.999 * vibration.limit_depth
    assert vibration.rise[before].max() < 4.0


def test_a_limit_in_m_per_s2_is_of_the_loudest_sensor_and_the_first_of_both_counts():
    _, by_rise = limited("wear.vibration_rise_db=4")
    loudest = by_rise.rms[:, 0].max()
    assert by_rise.rms[0, 0] > by_rise.rms[0, 1]
    level = by_rise.rms[0, 0] * 10.0 ** (2.0 / 20.0)
    assert level < loudest
    _, by_level = limited(f"wear.vibration_limit_m_per_s2={level}")
    end = int(np.argmin(np.abs(by_level.depth - by_level.limit_depth)))
    assert by_level.rms[end].max() == pytest.approx(level, rel=0.02)
    _, both = limited(
        f"wear.vibration_limit_m_per_s2={level}", "wear.vibration_rise_db=4"
    )
    assert both.limit_depth == pytest.approx(
        min(by_level.limit_depth, by_rise.limit_depth), rel=0.02
    )


def test_a_limit_that_is_not_reached_leaves_the_life_as_it_was():
    config = config_of("wear.vibration_rise_db=80")
    case = read_wear_case(config)
    same, vibration = limited_by_vibration(case, config)
    assert same is case
    assert vibration.limit_depth is None
    assert vibration.depth[-1] == pytest.approx(case.options.threshold, rel=1e-6)
    without = replace(case, options=replace(case.options, vibration_rise=None))
    assert limited_by_vibration(without, config) == (without, None)


def test_the_command_tells_what_ended_the_life(tmp_path, capsys):
    out, figure = tmp_path / "life.json", tmp_path / "life.png"
    words = [*FAST, "--json", str(out), "--plot", str(figure)]
    assert main(["wear-life", *words, "wear.vibration_rise_db=4"]) == 0
    text = capsys.readouterr().out
    assert "ended by                   vibration, " in text
    assert "limit of 4 dB reached" in text
    content = json.loads(out.read_text())
    told = content["vibration"]
    assert content["ended_by"] == "vibration"
    assert told["is_reached"] is True
    assert told["sensors"] == ["pinion_y", "wheel_y"]
    assert max(content["pinion_depth_um"]) == pytest.approx(
        content["threshold_um"], rel=1e-6
    )
    assert np.shape(told["rms_m_per_s2"]) == (len(told["hours"]), 2)
    end = int(np.argmin(np.abs(np.array(told["depth_um"]) - content["threshold_um"])))
    assert told["hours"][end] == pytest.approx(content["life_hours"], rel=0.01)
    assert figure.stat().st_size > 1000
    assert (
        main(
            [
                "wear-life",
                *words,
                "wear.vibration_rise_db=80",
                "wear.transmission_error_limit_um=1000",
            ]
        )
        == 0
    )
    text = capsys.readouterr().out
    assert "ended by                   depth, 40 um" in text
    assert "limit of 80 dB not reached" in text
    assert "limit of 1000 um not reached" in text
    assert json.loads(out.read_text())["vibration"]["is_reached"] is False


def test_lives_of_a_data_set_end_at_the_depth_found():
    words = (
        "experiment=run_to_failure", "plan.classes=[wear]", "plan.n_units=2", "life.snapshot_count=3",
        "operating.duration_s=0.1", "life.horizon_h=5000", "wear.vibration_rise_db=4",
    )  # fmt: skip
    config = read_request(words).config
    _, vibration = limited_by_vibration(
        read_wear_case(config.with_entries(fault={"kind": "healthy"})), config
    )
    assert 0.0 < vibration.limit_depth < 99e-6
    plan = make_plan(config)
    assert plan.columns["life_failed"].tolist() == [1] * 6
    for last in (2, 5):
        parts = json.loads(plan.record(last)["faults_json"])
        deepest = max(
            part["wear_depth_um"] * max(part["wear_profile"]) for part in parts
        )
        assert deepest == pytest.approx(vibration.limit_depth * 1e6, rel=0.01)
        assert plan.record(last)["severity"] == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["wear.vibration_limit_m_per_s2=1"], "is reached by new flanks already"),
        (
            ["wear.vibration_limit_m_per_s2=-1"],
            "wear.vibration_limit_m_per_s2 = -1 must be positive",
        ),
        (["wear.vibration_rise_db=0"], "wear.vibration_rise_db = 0 must be positive"),
        (
            ["wear.vibration_rise_db=loud"],
            "wear.vibration_rise_db = 'loud' is not a number or null",
        ),
        (["wear.vibration_rise=3"], "did you mean 'wear.vibration_rise_db'"),
        (
            ["wear.vibration_rise_db=3", "sensing.channels=[pinion_rotation]"],
            "name an acceleration",
        ),
    ],
)
def test_mistakes_are_one_line(words, message, capsys):
    assert main(["wear-life", *FAST, *words]) == 2
    text = capsys.readouterr().err
    assert message in text
    assert len(text.strip().splitlines()) == 1


def test_worn_flanks_at_the_limit_are_an_option_for_records(tmp_path):
    target = tmp_path / "mine" / "fault" / "loud.yaml"
    target.parent.mkdir(parents=True)
    assert (
        main(["wear-life", *FAST, "wear.vibration_rise_db=4", "--out", str(target)])
        == 0
    )
    option = yaml.safe_load(target.read_text())
    _, vibration = limited("wear.vibration_rise_db=4")
    assert option["parts"][0]["limit_um"] == pytest.approx(
        vibration.limit_depth * 1e6, rel=1e-3
    )
