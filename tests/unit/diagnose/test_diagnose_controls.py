"""Controls: an oracle that sees the twin, a sham without faults, probes, the level kept."""

from pathlib import Path

import numpy as np
import pytest
from fake_dataset import CLASSES, FakeDataset
from runs import FAST as QUICK
from runs import by_unit, refuses, rows_of, serve, settings_of
from small_studies import task_on

from diagnose.baselines.base import Source
from diagnose.baselines.oracle import oracle_table, oracle_windows
from diagnose.baselines.probe import (
    EXCLUDED,
    LABELS,
    probe_values,
    probed_columns,
    rotation_values,
)
from diagnose.cli import main
from diagnose.data.window_input import Windows
from diagnose.data.windows import load_windows, subset_segments
from diagnose.report.control_sections import controls_section, oracle_verdict, verdict
from diagnose.scoring.intervals import side_of
from diagnose.scoring.metrics import ratio_with_interval
from diagnose.scoring.predictions import Prediction, Rows
from diagnose.studies.baseline_runs import baseline_predictions
from diagnose.studies.controls import chosen_oracle, control_jobs
from diagnose.studies.study import task_from
from diagnose.training.sham import check_references
from gensig.dataset.columns import COLUMNS
from gensig.dataset.schema import SIGNALS
from gensig.errors import ConfigError

FAST = (*QUICK, "protocols=[by_unit]", "baselines=[rms_threshold]")
HOWTO = Path(__file__).parents[3] / "docs" / "howto" / "report.md"


def small(**changes):
    sizes = {"n_units": 16, "records_per_unit": 4, "duration": 0.5}
    return FakeDataset(**{**sizes, **changes})


# ---- the oracle


@pytest.mark.parametrize("normalise", ["rms", "none"])
def test_record_and_difference_have_one_divisor_which_is_the_twins(normalise):
    dataset = small(n_channels=2, twins=True)
    task = task_on(dataset, normalise=normalise)
    segments = subset_segments(task, "by_unit", "test")
    windows = oracle_windows(task, segments, Windows())
    plain = load_windows(task, segments)
    cut = windows.cut(np.array([0]))[0]
    record, start = int(windows.record[0]), int(windows.start[0])
    signal, twin = (
        dataset.signals(record, name=name).astype(float)
        for name in ("acceleration", "healthy_twin")
    )
    level = np.ones((4, 1))
    if normalise == "rms":
        level = np.tile(np.std(twin, axis=1, keepdims=True), (2, 1))
    expected = np.concatenate([signal, signal - twin]) / level
    expected = expected[:, start : start + 1200]
    expected = expected - expected.mean(axis=1, keepdims=True)
    np.testing.assert_allclose(cut, expected, rtol=0, atol=1e-4)
    np.testing.assert_array_equal(windows.label, plain.label)
    np.testing.assert_array_equal(windows.start, plain.start)


def test_what_the_oracle_sees_of_a_healthy_record_is_noise():
    """Twice the noise is left of a healthy record, more of a faulty one."""
    task = task_on(small(twins=True, noise=0.5), normalise="none")
    windows = oracle_windows(task, subset_segments(task, "by_unit", "train"), Windows())
    power = windows.cut(np.arange(len(windows)))[:, 1].var(axis=1)
    healthy, missing = (power[windows.label == label].mean() for label in (0, 3))
    assert healthy == pytest.approx(2 * 0.5**2, rel=0.05)
    assert missing > 0.55


def test_the_table_has_named_columns_and_shares_its_cache():
    task = task_on(small(n_channels=2, twins=True))
    segments, cache = subset_segments(task, "by_unit", "test"), {}
    table = oracle_table(task, segments, cache)
    assert table.values.shape == (16, len(table.names)) == (16, len(set(table.names)))
    assert len(cache) == 16
    cached = oracle_table(task, segments, cache)
    np.testing.assert_array_equal(table.values, cached.values)
    assert sum(name.endswith("difference/log_rms") for name in table.names) == 2


def test_the_better_one_on_validation_units_is_the_oracle():
    task = task_on(small())
    record, label = np.arange(8), task.labels()[:8]

    def run(method, n_right, seed=0):
        guess = np.where(record < n_right, label, (label + 1) % 4)
        return Prediction(
            protocol="by_unit",
            method=method,
            seed=seed,
            record=record[:2],
            answers=np.zeros((2, 4)),
            detail="",
            parts={"validation": Rows(record=record, answers=np.eye(4)[guess])},
        )

    network, indicators = run("oracle_network", 5, 1), run("oracle_indicators", 6)
    assert chosen_oracle(task, [run("cnn", 8)]) is None
    assert chosen_oracle(task, [network, indicators]) == "oracle_indicators"
    two = [run("oracle_network", 8), network, indicators]
    assert chosen_oracle(task, two) == "oracle_network"


def test_a_method_over_itself_is_one_and_the_interval_grows_with_the_units_spread():
    hits = np.random.default_rng(0).integers(0, 11, (2, 12, 2))
    both = np.eye(2, dtype=np.int64)
    counts = hits[..., None] * both + (10 - hits)[..., None] * (1 - both)
    perfect = np.broadcast_to(10 * both, counts.shape)

    def ratio(one, other):
        resampling = {"n_bootstrap": 500, "rng": np.random.default_rng(1)}
        return ratio_with_interval("balanced_accuracy", one, other, **resampling)

    same = ratio(counts[:1], counts[:1])
    assert same == {"mean": 1.0, "low": 1.0, "high": 1.0, "too_few": None}
    result = ratio(counts, perfect)
    assert result["low"] < result["mean"] < result["high"] < 1
    assert result["mean"] == pytest.approx(hits.mean() / 10)
    above = {"over_oracle": {"balanced_accuracy": ratio(perfect, counts)}}
    assert oracle_verdict(above).endswith("no bound here")


# ---- the probe


@pytest.mark.parametrize("results", [False, True])
def test_nothing_that_is_a_label_is_probed(results):
    dataset = small()
    names = (*COLUMNS, *EXCLUDED, "params/fault.depth_mm")
    dataset.columns |= dict.fromkeys(names, np.zeros(dataset.n_records))
    probed = set(probed_columns(dataset, results=results))
    labels = {"label", "label_name", "faults_json", "severity", "fault_gear"}
    hidden = {"fault_tooth", "detectability", "params/fault.depth_mm", *EXCLUDED}
    assert not probed & (labels | hidden)
    assert {"speed_set_rpm", "snr_db", "unit_id", "start_phase", "torque_nm"} <= probed
    for name in ("integration_error", "clipped", "speed_rpm", "mesh_frequency_hz"):
        assert (name in probed) == results


def test_what_is_left_out_has_a_role_of_its_own():
    roles = {name: entry.role for name, entry in {**COLUMNS, **SIGNALS}.items()}
    assert not {roles[name] for name in EXCLUDED} & set(LABELS)


def test_the_howto_names_what_is_left_out_and_why():
    text = " ".join(HOWTO.read_text(encoding="utf-8").split())
    for name, reason in {**EXCLUDED, **LABELS}.items():
        assert f"`{name}`" in text
        assert reason in text


def test_the_place_in_the_file_is_probed():
    dataset, place = small(), np.arange(64)
    dataset.columns["condition_id"] = np.char.add("c", (place // 4).astype(str))
    values, names = probe_values(dataset, 4, results=False)
    np.testing.assert_array_equal(values[:, names.index("place")], place)
    in_condition = values[:, names.index("place_in_condition")]
    np.testing.assert_array_equal(in_condition, place % 4)


def share_right(dataset, name):
    """Share of the test records that a probe recognises."""
    task = task_on(dataset)
    source = Source(
        task=task,
        protocol="by_unit",
        features="basic",
        windows=dict,
        caches={},
    )
    (result,) = baseline_predictions(source, [name])
    assert result.method == name
    return np.mean(result.predicted == task.labels()[result.record])


def test_a_leak_is_found_and_where_there_is_none_the_probe_is_at_chance():
    """Classes come in turn: the index gives the class; shuffled, it does not."""
    dataset = small(n_units=24, records_per_unit=8)

    def share(name):
        return share_right(dataset, name)

    assert share("metadata_probe") == 1.0
    label = np.random.default_rng(3).permutation(dataset.columns["label"])
    dataset.columns["label"] = label
    assert 0.1 < share("metadata_probe") < 0.45
    dataset.columns["integration_error"] = 1e-4 + 1e-4 * label
    assert share("metadata_probe") < 0.45
    assert share("result_probe") == 1.0


def test_a_speed_that_follows_the_fault_is_read_by_the_rotation_probe_alone():
    """Set-points vary by far more than what a fault takes of the actual speed."""
    dataset = small(n_units=24, records_per_unit=8)
    rng, n = np.random.default_rng(3), dataset.n_records
    label = rng.permutation(dataset.columns["label"])
    set_speed = rng.uniform(1200, 2400, n)
    dataset.columns |= {"label": label, "speed_set_rpm": set_speed}
    dataset.columns["speed_rpm"] = set_speed
    assert share_right(dataset, "rotation_probe") < 0.45
    dataset.columns["speed_rpm"] = set_speed * (1 - 1e-4 * label)
    assert share_right(dataset, "rotation_probe") > 0.9
    assert share_right(dataset, "metadata_probe") < 0.45


def test_the_rotation_probe_names_what_it_misses():
    dataset = small()
    del dataset.columns["speed_rpm"]
    with pytest.raises(ConfigError, match=r"no column speed_rpm.*metadata_probe=false"):
        rotation_values(dataset)


# ---- the jobs


def test_every_control_has_its_jobs_and_only_on_clean_protocols():
    settings = settings_of(
        *FAST, "reference=none", "normalise=both", "seeds=[3,4]", "protocols=null"
    )
    task = task_from(small(twins=True), settings)
    jobs = control_jobs(task, settings, ["by_unit"])
    networks = [("level_kept", 3), ("level_kept", 4), ("oracle", 3), ("level_kept", 3)]
    expected = [("probe", None), ("oracle", None), *networks]
    assert [(job.control, job.seed) for job in jobs] == expected
    assert [job.shuffled for job in jobs] == [False] * (len(jobs) - 1) + [True]
    assert control_jobs(task, settings, []) == []
    off = settings_of(*FAST, "reference=none", "oracle=false", "metadata_probe=false")
    assert control_jobs(task, off, ["by_unit"]) == []
    without = task_from(small(), settings)
    jobs = control_jobs(without, settings, ["by_unit"])
    assert all(job.control != "oracle" for job in jobs)


def offered():
    """Data sets by name, opened in place of folders."""
    datasets = {"good": small(twins=True), "sham": small(sham=True, seed=5)}
    for name, dataset in datasets.items():
        dataset.folder = Path(name)
    return datasets


@pytest.fixture
def opened(monkeypatch):
    datasets = offered()
    serve(monkeypatch, datasets)
    return datasets


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Function that trains on the data set and returns the folder."""

    def run(*words):
        out = tmp_path_factory.mktemp("study") / "out"
        with pytest.MonkeyPatch.context() as patch:
            serve(patch, offered())
            assert main(["train", "data=good", f"out={out}", *words]) == 0
        return out

    return run


@pytest.fixture(scope="module")
def complete(study):
    """Study with every control."""
    return study(*FAST, "sham=sham", "normalise=both")


def test_a_study_with_all_of_them(complete):
    result = by_unit(complete)
    methods = result["methods"]
    oracles = {"oracle_network", "oracle_indicators", "oracle_teeth"}
    others = {"label_shuffle", "metadata_probe", "level_kept"}
    others |= {"rotation_probe", "result_probe"}
    others |= {"label_shuffle_rms_threshold", "label_shuffle_level_kept"}
    shams = {"sham", "sham_level_kept", "sham_rms_threshold"}
    assert "sham" in result["controls"]["level_kept"]["ran"]
    rest = {"cnn", "rms_threshold", "oracle", "chance"}
    assert set(methods) == oracles | others | shams | rest
    chosen = methods["oracle"]["chosen"]
    assert chosen in oracles
    names = ("cnn", "oracle", chosen)
    network, *oracle = (methods[name]["balanced_accuracy"] for name in names)
    assert oracle[0] == oracle[1]
    share = result["over_oracle"]["balanced_accuracy"]
    assert share["mean"] == pytest.approx(network["mean"] / oracle[0]["mean"])
    assert share["low"] <= share["mean"] <= share["high"]
    assert [path.name for path in (complete / "models").iterdir()] == ["by_unit-seed0"]
    rows = rows_of(complete / "predictions.csv")
    assert not shams & {row["method"] for row in rows}
    page = (complete / "report.html").read_text()
    for words in (
        "metadata probe",
        "sham, network",
        "sham, network with RMS",
        "cnn over oracle",
    ):
        assert words in page


def test_the_controls_change_no_bit_of_the_rest(complete, study):
    plain = study(*FAST, "metadata_probe=false", "oracle=false")
    with_controls, without = by_unit(complete), by_unit(plain)
    for method in ("cnn", "rms_threshold", "label_shuffle"):
        assert with_controls["methods"][method] == without["methods"][method]
    weights = "models/by_unit-seed0/model.safetensors"
    assert (complete / weights).read_bytes() == (plain / weights).read_bytes()
    assert without["over_oracle"] == {}


def test_a_sham_set_scores_chance_where_the_faults_score_above(study):
    few = ("epochs=1", "metadata_probe=false", "oracle=false", "n_bootstrap=200")
    chosen = ("baselines=[indicators_without_level]", "sham=sham")
    methods = by_unit(study(*FAST, *few, *chosen))["methods"]
    for name in ("sham", "sham_indicators_without_level"):
        result = verdict(methods[name], 1 / len(CLASSES))
        assert result != "ABOVE chance: look for a leak"
    assert methods["indicators_without_level"]["balanced_accuracy"]["low"] > 0.4


def test_every_shown_network_has_its_sham():
    settings = settings_of(
        *FAST, "sham=sham", "normalise=both", "reference=same_condition", "oracle=false"
    )
    with pytest.MonkeyPatch.context() as patch:
        serve(patch, offered())
        patch.setattr("diagnose.training.sham.check_references", lambda *_: None)
        jobs = control_jobs(task_from(small(), settings), settings, ["by_unit"])
    on_sham = [(job.control, job.seed) for job in jobs if job.sham]
    assert on_sham == [("", None), ("", 0), ("level_kept", 0), ("with_reference", 0)]


def test_the_section_is_empty_without_controls():
    methods = {"cnn": {}, "chance": {"balanced_accuracy": 0.25}}
    metrics = {
        "protocols": {"by_unit": {"leaky": False, "methods": methods}},
        "model": "cnn",
        "settings": {"oracle": "auto"},
    }
    assert controls_section(metrics).table is None


@pytest.mark.parametrize(
    ("low", "high", "side", "says"),
    [
        (0.2, 0.3, "neither", "at chance"),
        (0.25, 0.3, "neither", "at chance"),
        (0.3, 0.4, "above", "ABOVE chance"),
        (0.1, 0.2, "below", "below chance"),
        (None, None, None, "no verdict: too few machines"),
    ],
)
def test_verdicts(low, high, side, says):
    score = {"low": low, "high": high}
    assert side_of(score, 0.25) == side
    assert verdict({"balanced_accuracy": score}, 0.25).startswith(says)


# ---- mistakes


def test_a_sham_set_without_the_references_of_the_network_is_refused():
    dataset = small(sham=True)
    dataset.folder = Path("other")
    with pytest.raises(
        ConfigError, match=r"^sham=other: the data set does not say condition_id"
    ):
        check_references(task_on(dataset), "same_condition")


@pytest.mark.parametrize(
    ("other", "message"),
    [
        ({"sham": False}, " has faults; make one of the same command with plan.sham="),
        (
            {"classes": CLASSES[:3]},
            ": its classes are healthy, crack, pitting, those of",
        ),
        (
            {"n_channels": 2},
            ": its channels are channel_0, channel_1, those of data= ch",
        ),
        ({"protocols": ("cross_speed",)}, " has none of the protocols by_unit"),
        ({"sampling_rate": 25600.0}, " is sampled at 25600 Hz, data= at 12800 Hz"),
    ],
)
def test_a_sham_set_that_does_not_fit_is_refused(
    opened, capsys, tmp_path, other, message
):
    changes = {"sham": True, **other}
    protocols = changes.pop("protocols", ("by_unit",))
    opened["other"] = small(**changes)
    opened["other"].folder, opened["other"].protocols = Path("other"), protocols
    words = ["train", "data=good", f"out={tmp_path / 'out'}", *FAST, "sham=other"]
    refuses(capsys, words, f"sham=other{message}")
    assert not (tmp_path / "out").exists()
