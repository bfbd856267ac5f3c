"""``python -m benchmarks.realism``: laws on made-up signals and tables, and a tiny run."""

import json
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose

from benchmarks import _realism_recording as recording
from benchmarks import _realism_sets as sets
from benchmarks import _realism_values as values
from benchmarks import realism
from gensig.errors import ConfigError, DatasetError
from gensig.plan.make import count_records
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader
from gensig.report.realism import read_ranges

BASE = ["experiment=quickstart", "executor.n_workers=1"]
TINY = sets.Size(
    n_units=2,
    n_gearboxes=1,
    speeds=(0.5, 1.0),
    torques=(1.0,),
    n_turns=3.2,
    recording_duration=0.16,
)
RATE, TEETH, SPEED = 25600.0, 23, 2000.0 / 60.0
TIME = np.arange(32768) / RATE


def healthy(seed=0, *, teeth=TEETH, depth=0.3, noise=0.3):
    """Two channels of a modulated mesh under noise."""
    turn = 2 * np.pi * 1.003 * SPEED * TIME
    mesh = sum(a * np.cos(k * teeth * turn) for k, a in ((1, 1.0), (2, 0.5), (3, 0.25)))
    x = (1 + depth * np.cos(turn)) * mesh
    hiss = np.random.default_rng(seed).standard_normal((2, TIME.size))
    return np.stack([x, 3.0 * x]) + noise * hiss


class TestValues:
    @pytest.mark.parametrize("frequency", [1000.0, 3000.0, 6000.0, 20000.0])
    def test_resampling_keeps_what_fits_and_nothing_else(self, frequency):
        signal = 5.0 + np.sin(2 * np.pi * frequency * np.arange(51200) / 51200.0)
        x = values.to_rate(signal, 51200.0, 5000.0)
        assert x.shape == (5000,)
        amplitude = np.sqrt(2) * np.std(x[500:-500])
        assert_allclose(amplitude, float(frequency < 2500.0), atol=5e-3)

    def test_a_record_whose_speed_varies(self):
        turned = 30.0 * TIME + 0.2 / (2 * np.pi * 2.0) * np.sin(2 * np.pi * 2.0 * TIME)
        mesh = 2.0 * np.cos(2 * np.pi * TEETH * turned)
        hiss = np.random.default_rng(0).standard_normal(TIME.size)
        x = np.stack([mesh, hiss])
        result = values.record_values(x, 2 * np.pi * turned, RATE, 30.0, TEETH)
        assert_allclose(result["mesh"][0], [2.0, 0.0, 0.0], atol=0.02)
        assert_allclose(result["nonsynchronous_share"], [0.0, 1.0], atol=0.02)
        assert_allclose(result["rms"], [np.sqrt(2), np.sqrt(5000 / RATE)], rtol=0.05)
        assert_allclose(result["rms_full_band"], [np.sqrt(2), 1.0], rtol=0.01)
        assert result["n_turns"][0] == np.floor(turned[-1])

    def test_harmonic_decades(self):
        mesh = np.array(
            [[[1.0, 0.1, 1.0], [1.0, 10.0, 1.0]], [[2.0, 2.0, np.nan], [5.0, 5.0, 5.0]]]
        )
        assert values.harmonic_decades(mesh) == pytest.approx(2.0)

    @staticmethod
    def table():
        """Two gearboxes, two specimens each, two speeds, healthy and with a missing tooth."""
        rows = product(("healthy", "missing_tooth"), "ab", "xy", (600.0, 1800.0))
        labels, gearboxes, specimens, speeds = map(np.array, zip(*rows, strict=True))
        size = speeds * np.where(labels == "healthy", 1.0, 3.0)
        size *= np.where(specimens == "x", 1.0, 10.0)
        # other gearboxes or speeds would show at once
        size *= np.where(gearboxes == "a", 1.0, 1e6)
        names = (
            "rms",
            "kurtosis",
            "rms_full_band",
            "kurtosis_full_band",
            "fm4",
            "nonsynchronous_share",
            "impacts_per_turn",
            "peak_over_residual",
            "impact_decay",
        )
        both = np.stack([size, 2 * size], axis=1)
        mesh = np.stack([both] * 3, axis=-1)
        columns = {
            "label_name": labels,
            "gearbox_id": gearboxes,
            "specimen_id": specimens,
            "speed_set_rpm": speeds,
            "torque_nm": np.full(16, 2.0),
            "unit_id": np.char.add(gearboxes, specimens),
        }
        indicators = dict.fromkeys(names, both) | {"mesh": mesh}
        return values.Table(columns=columns, indicators=indicators, n_failed=0)

    def test_pairs_are_of_one_gearbox_and_set_point_and_of_another_specimen(self):
        result = values.quantities(self.table())

        def ratios(name):
            return np.sort(result[name, values.ALL])

        # 2 gearboxes x 2 speeds x 2 channels, each way
        assert_allclose(ratios("missing_tooth.rms_ratio"), np.repeat([0.3, 30.0], 8))
        assert_allclose(ratios("missing_tooth.rms_ratio_same_unit"), 3.0)
        mesh = np.unique(ratios("healthy.mesh_amplitude_ratio").round(9))
        assert_allclose(mesh, [0.1, 10.0])

    def test_the_slow_and_light_corner_stands_apart(self):
        result = values.quantities(self.table())
        slow, rest = (
            result["missing_tooth.kurtosis", where]
            for where in (values.SLOW, values.ELSEWHERE)
        )
        assert len(slow) == len(rest) == 8
        assert_allclose(sorted(rest), 3.0 * np.sort(slow))
        assert len(result["missing_tooth.kurtosis", values.ALL]) == 16


class TestSets:
    def test_the_grid_runs_every_unit_at_every_set_point_with_every_class(self):
        config = read_request(sets.yardstick_words(BASE, sets.Size())).config
        counts = count_records(InputReader(config))
        assert (counts.n_units, counts.n_conditions, counts.n_records) == (40, 240, 960)
        vary = config["plan"]["vary"]
        assert vary["operating.speed_rpm"]["values"] == [600, 1200, 1800]
        assert vary["operating.torque_nm"]["values"] == [2, 20]
        assert vary["sensing.snr_db"]["levels"] is None
        assert config["operating"]["duration_s"] * 600 / 60 >= 10

    def test_added_grids_have_their_own_fault_and_no_crack(self):
        for grid in sets.GRIDS[1:]:
            config = read_request(sets.yardstick_words(BASE, TINY, grid)).config
            assert tuple(config["plan"]["classes"]) == grid.classes
        assert config["quality"]["run_in_share"] == sets.RUN_IN_SHARE

    def test_cracks_are_a_quarter_to_half_of_the_chord(self):
        config = read_request(sets.yardstick_words(BASE, TINY)).config
        spec = config["classes"]["crack"]["vary"]["crack_depth_mm"]
        assert spec["high"] == pytest.approx(2 * spec["low"], rel=1e-3)
        assert spec["low"] == pytest.approx(
            0.25 * 1e3 * sets.root_chord(BASE), rel=1e-3
        )

    def test_the_machine_of_the_recording_and_what_is_wrong_on_purpose(self):
        configs = [
            read_request(sets.recording_words(BASE, TINY, control)).config
            for control in sets.CONTROLS
        ]
        right, teeth, finer, rougher = configs
        for config, counts in ((right, [23, 46]), (teeth, [27, 42])):
            gear = config["gear"]
            assert [gear[side]["n_teeth"] for side in ("pinion", "wheel")] == counts
        ordered = (finer, right, rougher)
        grades = [config["quality"]["iso1328_grade"] for config in ordered]
        assert_allclose(np.sqrt(2.0) ** np.diff(grades), 3.0, rtol=1e-3)
        assert right["plan"]["classes"] == ["healthy"]
        assert "operating.speed_rpm" not in right["plan"]["vary"]

    def test_too_few_specimens_perfect_gears_and_a_choice_are_refused(self):
        with pytest.raises(ConfigError, match="3 units in 2 gearboxes"):
            sets.Size(n_units=3, n_gearboxes=2)
        with pytest.raises(ConfigError, match="perfect gears"):
            sets.recording_words([*BASE, "quality.iso1328_grade=null"], TINY, "right")
        noise = "{sensing.snr_db: {distribution: choice, values: [10, 20]}}"
        with pytest.raises(ConfigError, match="would be crossed"):
            sets.yardstick_words([*BASE, f"plan.vary={noise}"], TINY)


class TestRecording:
    def test_indicators_do_not_know_the_gain(self):
        x = healthy()
        result = recording.indicators(x, RATE, TEETH, SPEED)
        quiet = recording.indicators(1e-3 * x, RATE, TEETH, SPEED)
        for name in result:
            assert_allclose(quiet[name], result[name], rtol=1e-6, err_msg=name)

    def test_indicators_of_a_modulated_mesh(self):
        result = recording.indicators(healthy(noise=0.05), RATE, TEETH, SPEED)
        assert_allclose(result["harmonic_2_over_1"], -6.02, atol=0.2)
        assert_allclose(result["harmonic_3_over_1"], -12.04, atol=0.4)
        assert_allclose(result["sideband_ratio"], 20 * np.log10(0.3), atol=0.6)
        carrier_share = 1.0 / (1.0 + 0.3**2 / 2)
        assert_allclose(result["mesh_share"], 10 * np.log10(carrier_share), atol=0.1)

    def test_other_teeth_and_sidebands_are_told_apart_and_the_same_machine_is_not(self):
        def simulated(**changes):
            rows = [
                recording.indicators(healthy(seed, **changes), RATE, TEETH, SPEED)
                for seed in range(10, 22)
            ]
            return {name: np.array([row[name] for row in rows]) for name in rows[0]}

        right = simulated()
        made = (right, simulated(teeth=27), simulated(depth=0.1), right)
        controls = dict(zip(sets.CONTROLS, made, strict=True))
        real = recording.indicators(healthy(1), RATE, TEETH, SPEED)
        result = recording.recording_comparisons(controls, real)
        verdicts = {row.key: row.verdict for row in result}
        assert verdicts["recording.mesh_share", "wrong teeth"] == "told apart"
        assert verdicts["recording.sideband_ratio", "errors / 3"] == "told apart"
        assert verdicts["recording.sideband_ratio", "errors x 3"] == "not told apart"

        def columns(rows):
            return [row.at for row in rows if row.id == "recording.fm4"]

        names = ["channels", "width", "wrong teeth", "errors / 3", "errors x 3"]
        assert columns(result) == names
        without = recording.recording_comparisons(controls, None)
        assert columns(without)[0] == "simulated"

    def test_nothing_is_looked_for_without_the_variable(self, monkeypatch, tmp_path):
        monkeypatch.delenv(recording.VARIABLE, raising=False)
        assert recording.find_recording() is None
        monkeypatch.setenv(recording.VARIABLE, str(tmp_path))
        assert recording.find_recording() is None
        np.savez(tmp_path / "healthy_x.npz", other=np.zeros(3))
        with pytest.raises(DatasetError, match="holds no array 'acceleration'"):
            recording.find_recording()

    def test_the_real_recording_shows_its_mesh(self):
        x = recording.find_recording()
        if x is None:
            pytest.skip(f"${recording.VARIABLE} names no folder with the recording")
        result = recording.recording_indicators(x)
        assert all(np.isfinite(one).all() for one in result.values())
        assert recording.find_mesh_frequency(x, RATE, TEETH, SPEED) == pytest.approx(
            TEETH * SPEED, rel=2e-3
        )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--stored", "--frozen COMMIT"),
        ("--stored --quick --frozen 0123abc", "too few units"),
        ("--added", "it needs --stored"),
    ],
)
def test_storing_needs_the_commit_and_all_units(words, message, capsys):
    assert realism.main(words.split()) == 2
    assert message in capsys.readouterr().err


def test_from_nothing_to_table_and_figures(tmp_path, monkeypatch, capsys):
    monkeypatch.delenv(recording.VARIABLE, raising=False)
    monkeypatch.setattr(realism, "QUICK", TINY)
    monkeypatch.chdir(tmp_path)
    words = ["--quick", "--data", "data", "--base", " ".join(BASE)]
    outputs = ["--json", "found.json", "--figures", "figures"]
    assert realism.main([*words, *outputs]) == 0
    said = capsys.readouterr().out
    assert "real recording is left out" in said
    assert "16 records, 0 failed, at least 3 turns" in said
    assert "ranges frozen in commit (none named)" in said
    result = json.loads((tmp_path / "found.json").read_text())["rows"]
    rows = {(row["id"], row["at"]): row for row in result}
    assert set(read_ranges()) < set(rows)
    # 2 specimens each way x 2 set-points x 4 channels
    assert rows["crack.rms_ratio", "all conditions"]["n"] == 16
    assert rows["missing_tooth.kurtosis", "slow and light"]["n"] == 8
    assert rows["recording.kurtosis", "simulated"]["n"] == 8
    for name in ("yardstick", "recording"):
        picture = tmp_path / "figures" / f"realism_{name}.png"
        assert picture.read_bytes().startswith(b"\x89PNG")
    plan = tmp_path / "data" / "yardstick" / "plan.csv"
    made = plan.stat().st_mtime_ns
    assert realism.main(words) == 0  # what is there is read, not made again
    assert plan.stat().st_mtime_ns == made
    capsys.readouterr()
    assert realism.main([*words, "--base", " ".join([*BASE, "seed=1"])]) == 1
    assert "holds a data set of other overrides" in capsys.readouterr().err
