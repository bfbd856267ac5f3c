"""Controls: an oracle that sees the twin, a sham without faults, a probe without a signal, the level beside."""

import json
from pathlib import Path

import numpy as np
import pytest
from fake_dataset import CLASSES, FakeDataset

import gensig.dataset.reader
from diagnose.baselines.base import Source
from diagnose.baselines.oracle import oracle_table, oracle_windows
from diagnose.baselines.probe import (
    EXCLUDED,
    LABELS,
    probe_values,
    probed_columns,
)
from diagnose.cli import main
from diagnose.data.window_input import Windows
from diagnose.data.windows import load_windows, subset_segments, task_of
from diagnose.report.control_sections import controls_section, oracle_verdict, verdict
from diagnose.scoring.metrics import ratio_with_interval
from diagnose.scoring.predictions import Prediction, Rows
from diagnose.settings import settings_from
from diagnose.studies.baseline_runs import baseline_predictions
from diagnose.studies.controls import chosen_oracle, control_jobs
from diagnose.studies.study import task_from
from gensig.dataset.columns import COLUMNS
from gensig.dataset.schema import SIGNALS
from gensig.errors import ConfigError
from gensig.options.compose import compose

FAST = [
    "protocols=[by_unit]", "window_samples=1200", "stride_samples=1000", "epochs=2", "seeds=[0]", "n_bootstrap=200",
    "n_threads=1", "model.widths=[8,16]", "model.kernels=[32,5]", "model.strides=[8,4]", "baselines=[rms_threshold]",
]  # fmt: skip
SMALL = {"n_units": 16, "records_per_unit": 4, "duration": 0.5}
HOWTO = Path(__file__).parents[3] / "docs" / "howto" / "controls.md"


def make_task(dataset, **changes):
    return task_of(
        dataset,
        **{
            "window_samples": 1200,
            "stride_samples": 1000,
            "normalise": "rms",
            **changes,
        },
    )


def make_settings(*overrides):
    return settings_from(compose("train", ["data=x", "out=y", *FAST, *overrides]))


# --- the oracle ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("normalise", ["rms", "none"])
def test_record_and_difference_have_one_divisor_which_is_the_twins(normalise):
    dataset = FakeDataset(**SMALL, n_channels=2, twins=True)
    task = make_task(dataset, normalise=normalise)
    windows = oracle_windows(task, subset_segments(task, "by_unit", "test"), Windows())
    plain = load_windows(task, subset_segments(task, "by_unit", "test"))
    cut = windows.cut(np.array([0]))[0]
    record, start = int(windows.record[0]), int(windows.start[0])
    signal, twin = (
        dataset.signals(record, name=name).astype(float)
        for name in ("acceleration", "healthy_twin")
    )
    level = (
        np.std(twin, axis=1, keepdims=True) if normalise == "rms" else np.ones((2, 1))
    )
    wanted = (np.concatenate([signal, signal - twin]) / np.tile(level, (2, 1)))[
        :, start : start + 1200
    ]
    np.testing.assert_allclose(
        cut, wanted - wanted.mean(axis=1, keepdims=True), rtol=0, atol=1e-4
    )
    np.testing.assert_array_equal(windows.label, plain.label)
    np.testing.assert_array_equal(windows.start, plain.start)


def test_what_the_oracle_sees_of_a_healthy_record_is_noise():
    """Law: twice the noise is left of a healthy record, more of a faulty one."""
    dataset = FakeDataset(**SMALL, twins=True, noise=0.5)
    task = make_task(dataset, normalise="none")
    windows = oracle_windows(task, subset_segments(task, "by_unit", "train"), Windows())
    power = windows.cut(np.arange(len(windows)))[:, 1].var(axis=1)
    np.testing.assert_allclose(
        power[windows.label == 0].mean(), 2 * 0.5**2, rtol=0.05, atol=0
    )
    assert power[windows.label == 3].mean() > 0.55


def test_the_table_has_finite_named_columns_and_shares_its_cache():
    task = make_task(FakeDataset(**SMALL, n_channels=2, twins=True))
    cache: dict = {}
    table = oracle_table(task, subset_segments(task, "by_unit", "test"), cache)
    assert table.values.shape == (16, len(table.names)) == (16, len(set(table.names)))
    assert len(cache) == 16
    again = oracle_table(task, subset_segments(task, "by_unit", "test"), cache)
    np.testing.assert_array_equal(table.values, again.values)
    difference = [
        index
        for index, name in enumerate(table.names)
        if name.endswith("difference/log_rms")
    ]
    assert len(difference) == 2
    assert (
        table.values[table.label == 3][:, difference].mean()
        > table.values[table.label == 0][:, difference].mean()
    )


def test_the_better_one_on_validation_units_is_the_oracle():
    task = make_task(FakeDataset(**SMALL))
    labels = task.labels()

    def run(method, n_right, seed=0):
        guess = np.where(np.arange(8) < n_right, labels[:8], (labels[:8] + 1) % 4)
        validation = Rows(record=np.arange(8), log_probability=np.eye(4)[guess])
        return Prediction(
            protocol="by_unit", method=method, seed=seed, record=np.arange(2), log_probability=np.zeros((2, 4)),
            detail="", validation=validation,
        )  # fmt: skip

    assert chosen_oracle(task, [run("cnn", 8)]) is None
    assert (
        chosen_oracle(task, [run("oracle_network", 5), run("oracle_indicators", 6)])
        == "oracle_indicators"
    )
    two = [
        run("oracle_network", 8),
        run("oracle_network", 5, 1),
        run("oracle_indicators", 6),
    ]
    assert chosen_oracle(task, two) == "oracle_network"


def test_a_method_over_itself_is_one_and_the_interval_grows_with_the_units_spread():
    rng = np.random.default_rng(0)
    counts = np.zeros((2, 12, 2, 2), dtype=np.int64)
    hits = rng.integers(0, 11, (2, 12, 2))
    counts[:, :, 0, 0], counts[:, :, 0, 1] = hits[..., 0], 10 - hits[..., 0]
    counts[:, :, 1, 1], counts[:, :, 1, 0] = hits[..., 1], 10 - hits[..., 1]

    def ratio(one, other):
        return ratio_with_interval(
            "balanced_accuracy",
            one,
            other,
            n_bootstrap=500,
            rng=np.random.default_rng(1),
        )

    same = ratio(counts[:1], counts[:1])
    assert same == {"mean": 1.0, "low": 1.0, "high": 1.0}
    perfect = np.zeros_like(counts)
    perfect[:, :, 0, 0] = perfect[:, :, 1, 1] = 10
    found = ratio(counts, perfect)
    assert found["low"] < found["mean"] < found["high"] < 1
    assert found["mean"] == pytest.approx(hits.mean() / 10)
    assert oracle_verdict(
        {"over_oracle": {"balanced_accuracy": ratio(perfect, counts)}}
    ).endswith("no bound here")


# --- the probe ----------------------------------------------------------------------------------------------------


def test_nothing_that_is_a_label_is_probed():
    dataset = FakeDataset(**SMALL)
    dataset.columns |= {
        name: np.zeros(dataset.n_records)
        for name in (*COLUMNS, *EXCLUDED, "params/fault.depth_mm")
    }
    for results in (False, True):
        probed = probed_columns(dataset, results=results)
        assert not {
            "label",
            "label_name",
            "faults_json",
            "severity",
            "fault_gear",
            "fault_tooth",
            "detectability",
        } & {*probed}
        assert not set(EXCLUDED) & set(probed)
        assert "params/fault.depth_mm" not in probed
        assert {"speed_rpm", "snr_db", "unit_id", "start_phase", "torque_nm"} <= set(
            probed
        )
        assert ("integration_error" in probed) == ("clipped" in probed) == results
    known = {**COLUMNS, **SIGNALS}
    assert all(name in known for name in EXCLUDED)
    assert {known[name].role for name in EXCLUDED} & set(LABELS) == set()


def test_the_howto_names_what_is_left_out_and_why():
    text = " ".join(HOWTO.read_text(encoding="utf-8").split())
    for name, reason in {**EXCLUDED, **LABELS}.items():
        assert f"`{name}`" in text
        assert reason in text


def test_the_place_in_the_file_is_probed():
    dataset = FakeDataset(**SMALL)
    dataset.columns["condition_id"] = np.array(
        [f"c{index // 4}" for index in range(dataset.n_records)]
    )
    values, names = probe_values(dataset, 4, results=False)
    np.testing.assert_array_equal(values[:, names.index("place")], np.arange(64))
    np.testing.assert_array_equal(
        values[:, names.index("place_in_condition")], np.arange(64) % 4
    )


def test_a_leak_is_found_and_where_there_is_none_the_probe_is_at_chance():
    """The fake set deals its classes in turn, so that the place tells all; dealt at random it tells nothing."""
    dataset = FakeDataset(**{**SMALL, "n_units": 24, "records_per_unit": 8})
    task = make_task(dataset)

    source = Source(
        task=task,
        protocol="by_unit",
        features="basic",
        minirocket_features=84,
        windows=dict,
        caches={},
    )

    def share(name):
        (found,) = baseline_predictions(source, [name])
        assert found.method == name
        return np.mean(found.predicted == task.labels()[found.record])

    assert share("metadata_probe") == 1.0
    dataset.columns["label"] = np.random.default_rng(3).permutation(
        dataset.columns["label"]
    )
    assert 0.1 < share("metadata_probe") < 0.45
    dataset.columns["integration_error"] = 1e-4 + 1e-4 * dataset.columns["label"]
    assert share("metadata_probe") < 0.45
    assert share("result_probe") == 1.0


# --- the jobs -----------------------------------------------------------------------------------------------------


def test_every_control_has_its_jobs_and_only_on_clean_protocols():
    settings = make_settings("normalise=both", "seeds=[3,4]", "protocols=null")
    task = task_from(FakeDataset(**SMALL, twins=True), settings)
    jobs = control_jobs(task, settings, ["by_unit"])
    assert [(job.control, job.seed) for job in jobs] == [
        ("probe", None), ("oracle", None), ("level_kept", 3), ("level_kept", 4), ("oracle", 3),
    ]  # fmt: skip
    assert control_jobs(task, settings, []) == []
    off = make_settings("oracle=false", "metadata_probe=false")
    assert control_jobs(task, off, ["by_unit"]) == []
    without = task_from(FakeDataset(**SMALL), settings)
    assert all(
        job.control != "oracle" for job in control_jobs(without, settings, ["by_unit"])
    )


@pytest.fixture
def opened(monkeypatch):
    """Data sets by name, opened in place of folders."""
    offered = {
        "good": FakeDataset(**SMALL, twins=True),
        "sham": FakeDataset(**SMALL, sham=True, seed=5),
    }
    for name, dataset in offered.items():
        dataset.folder = Path(name)
    monkeypatch.setattr(
        gensig.dataset.reader, "open_dataset", lambda path: offered[str(path)]
    )
    return offered


def test_a_study_with_all_of_them(opened, tmp_path):
    out = tmp_path / "out"
    assert (
        main(["train", "data=good", f"out={out}", *FAST, "sham=sham", "normalise=both"])
        == 0
    )
    result = json.loads((out / "metrics.json").read_text())["protocols"]["by_unit"]
    methods = result["methods"]
    assert set(methods) == {
        "cnn", "label_shuffle", "rms_threshold", "metadata_probe", "result_probe", "oracle_network",
        "oracle_indicators", "oracle", "level_kept", "sham", "sham_rms_threshold", "chance",
    }  # fmt: skip
    assert methods["oracle"]["chosen"] in ("oracle_network", "oracle_indicators")
    assert (
        methods["oracle"]["balanced_accuracy"]
        == methods[methods["oracle"]["chosen"]]["balanced_accuracy"]
    )
    share = result["over_oracle"]["balanced_accuracy"]
    mean = (
        methods["cnn"]["balanced_accuracy"]["mean"]
        / methods["oracle"]["balanced_accuracy"]["mean"]
    )
    assert share["mean"] == pytest.approx(mean)
    assert share["low"] <= share["mean"] <= share["high"]
    assert [path.name for path in (out / "models").iterdir()] == ["by_unit-seed0"]
    assert "sham" not in {
        line.split(",")[1]
        for line in (out / "predictions.csv").read_text().splitlines()
    }
    page = (out / "report.html").read_text()
    for words in (
        "metadata probe",
        "sham, network",
        "sham, RMS threshold",
        "cnn over oracle",
        "of the oracle",
    ):
        assert words in page


def test_the_controls_change_no_bit_of_the_rest(opened, tmp_path):
    plain = ["metadata_probe=false", "oracle=false"]
    results = []
    for name, words in (("with", ["sham=sham", "normalise=both"]), ("without", plain)):
        assert (
            main(["train", "data=good", f"out={tmp_path / name}", *FAST, *words]) == 0
        )
        results.append(
            json.loads((tmp_path / name / "metrics.json").read_text())["protocols"][
                "by_unit"
            ]
        )
    for method in ("cnn", "rms_threshold", "label_shuffle"):
        assert results[0]["methods"][method] == results[1]["methods"][method]
    weights = [
        (tmp_path / name / "models" / "by_unit-seed0" / "model.safetensors")
        for name in ("with", "without")
    ]
    assert weights[0].read_bytes() == weights[1].read_bytes()
    assert results[1]["over_oracle"] == {}


def test_a_sham_set_scores_chance_where_the_faults_score_above(opened, tmp_path):
    few = [
        "baselines=[indicators_without_level]",
        "epochs=4",
        "metadata_probe=false",
        "oracle=false",
    ]
    assert (
        main(
            [
                "train",
                "data=good",
                f"out={tmp_path / 'out'}",
                *FAST[:3],
                *FAST[4:10],
                *few,
                "sham=sham",
            ]
        )
        == 0
    )
    methods = json.loads((tmp_path / "out" / "metrics.json").read_text())["protocols"][
        "by_unit"
    ]["methods"]
    for name in ("sham", "sham_indicators_without_level"):
        assert (
            verdict(methods[name], 1 / len(CLASSES)) != "ABOVE chance: look for a leak"
        )
    assert methods["indicators_without_level"]["balanced_accuracy"]["low"] > 0.4


def test_the_section_is_empty_without_controls():
    result = {
        "leaky": False,
        "methods": {"cnn": {}, "chance": {"balanced_accuracy": 0.25}},
    }
    metrics = {
        "protocols": {"by_unit": result},
        "model": "cnn",
        "settings": {"oracle": "auto"},
    }
    assert controls_section(metrics).table is None


@pytest.mark.parametrize(
    ("low", "high", "says"),
    [(0.2, 0.3, "at chance"), (0.3, 0.4, "ABOVE chance"), (0.1, 0.2, "below chance")],
)
def test_verdicts(low, high, says):
    assert verdict({"balanced_accuracy": {"low": low, "high": high}}, 0.25).startswith(
        says
    )


# --- mistakes -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (
            {"sham": False},
            "sham=other has faults; make one of the same command with plan.sham=true",
        ),
        (
            {"classes": CLASSES[:3]},
            "sham=other: its classes are healthy, crack, pitting, those of data= healthy",
        ),
        (
            {"n_channels": 2},
            "sham=other: its channels are channel_0, channel_1, those of data= channel_0",
        ),
        (
            {"sampling_rate": 25600.0},
            "sham=other is sampled at 25600 Hz, data= at 12800 Hz",
        ),
    ],
)
def test_a_sham_set_that_does_not_fit_is_refused(
    opened, capsys, tmp_path, other, message
):
    opened["other"] = FakeDataset(**{**SMALL, "sham": True, **other})
    opened["other"].folder = Path("other")
    assert (
        main(["train", "data=good", f"out={tmp_path / 'out'}", *FAST, "sham=other"])
        == 2
    )
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_sham_set_without_the_protocol_is_refused(opened, capsys, tmp_path):
    opened["sham"].protocols = ("cross_speed",)
    assert (
        main(["train", "data=good", f"out={tmp_path / 'out'}", *FAST, "sham=sham"]) == 2
    )
    assert "sham=sham has none of the protocols by_unit" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("oracle=true", "oracle must be auto or false, not True"),
        (
            "sham=3",
            "sham must be the folder of a data set made with plan.sham=true, not 3",
        ),
        ("metadata_probe=1", "metadata_probe must be true or false, not 1"),
        ("normalise=all", "no normalisation 'all'; there is rms, none, both"),
    ],
)
def test_mistakes_in_settings(word, message):
    with pytest.raises(ConfigError, match=message):
        task_from(FakeDataset(**SMALL), make_settings(word))
