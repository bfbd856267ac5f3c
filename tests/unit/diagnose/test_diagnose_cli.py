"""The command from data to report, and one line for every mistake."""

import csv
import json
import re
import subprocess
import sys
from html.parser import HTMLParser

import numpy as np
import pytest
from fake_dataset import FakeDataset

import gensig.dataset.reader
from diagnose.cli import main
from diagnose.report.page import result_table, write_report
from gensig.errors import DatasetError

FAST = [
    "window_samples=1200", "stride_samples=1000", "epochs=2", "seeds=[0,1]", "n_bootstrap=100", "n_threads=1",
    "model.widths=[8,16]", "model.kernels=[32,5]", "model.strides=[8,4]",
]  # fmt: skip


def fake(**changes):
    return FakeDataset(
        **{"n_units": 16, "records_per_unit": 4, "duration": 0.5, **changes}
    )


@pytest.fixture
def data(monkeypatch):
    """Data sets by name, opened in place of folders."""
    offered = {"good": fake()}

    def open_dataset(path):
        if str(path) not in offered:
            raise DatasetError(f"{path} is no data set: it has no manifest.json")
        return offered[str(path)]

    monkeypatch.setattr(gensig.dataset.reader, "open_dataset", open_dataset)
    return offered


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gensig.dataset.reader, "open_dataset", lambda path: fake())
        out = tmp_path_factory.mktemp("study") / "out"
        assert main(["train", "data=good", f"out={out}", *FAST]) == 0
    return out


def fails(capsys, words, message):
    """The command exits 2 with one line on stderr."""
    assert main(words) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1, lines
    assert lines[0].startswith("diagnose: ")
    assert message in lines[0]


def test_train_writes_what_it_promises(trained):
    names = {path.name for path in trained.iterdir()}
    assert names == {
        "metrics.json", "predictions.csv", "report.html", "models", "scores.png",
        "reliability.png", "confusion_by_unit.png", "confusion_random_window_leaky.png",
        "detection_by_unit.png", "window_length.png", "scores.csv", "by_severity.csv", "comparisons.csv",
        "confusion_by_unit.csv", "confusion_random_window_leaky.csv",
    }  # fmt: skip
    metrics = json.loads((trained / "metrics.json").read_text())
    assert list(metrics["protocols"]) == ["by_unit", "random_window_leaky"]
    assert metrics["protocols_left_out"] == {
        "cross_specimen": "1 specimen_id in the plan, and at least 4 are needed"
    }
    assert (
        "cross_specimen is left out: 1 specimen"
        in (trained / "report.html").read_text()
    )
    methods = metrics["protocols"]["by_unit"]["methods"]
    assert set(methods) == {
        "cnn", "label_shuffle", "indicators", "indicators_without_level", "rms_threshold", "metadata_probe",
        "result_probe", "chance",
    }  # fmt: skip
    for name in ("cnn", "label_shuffle", "indicators", "rms_threshold"):
        value = methods[name]["balanced_accuracy"]
        assert 0 <= value["low"] <= value["high"] <= 1
        assert np.sum(methods[name]["confusion"]) == 16 * len(methods[name]["seeds"])
    assert methods["chance"]["balanced_accuracy"] == 0.25
    for seed, epoch in enumerate(
        metrics["protocols"]["by_unit"]["last_epoch"]["epoch"]
    ):
        assert metrics["protocols"]["by_unit"]["best_epoch"][seed] <= epoch == 2
        stored = json.loads(
            (trained / "models" / f"by_unit-seed{seed}" / "model.json").read_text()
        )
        assert (
            stored["temperature"]
            == metrics["protocols"]["by_unit"]["calibration"]["temperature"][seed]
        )
    assert not list(trained.rglob("*.pkl")) + list(trained.rglob("*.pt"))


def test_predictions_hold_what_the_scores_are_made_of(trained):
    metrics = json.loads((trained / "metrics.json").read_text())
    with (trained / "predictions.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    mine = [
        row
        for row in rows
        if (row["protocol"], row["method"]) == ("by_unit", "indicators")
    ]
    shares = []
    for name in metrics["class_names"]:
        guesses = [row["predicted"] for row in mine if row["label"] == name]
        shares.append(sum(guess == name for guess in guesses) / len(guesses))
    score = metrics["protocols"]["by_unit"]["methods"]["indicators"][
        "balanced_accuracy"
    ]["mean"]
    assert sum(shares) / len(shares) == pytest.approx(score, abs=1e-12)
    for row in mine:
        largest = max(
            metrics["class_names"],
            key=lambda name: float(row[f"log_probability_{name}"]),
        )
        assert largest == row["predicted"]
    assert {row["method"] for row in rows} >= {"cnn", "indicators", "label_shuffle"}


def test_the_table_shows_the_leaky_protocol_last_and_says_so(trained):
    metrics = json.loads((trained / "metrics.json").read_text())
    metrics["protocols"] = dict(reversed(metrics["protocols"].items()))
    names = [line.split("|")[1].strip() for line in result_table(metrics)]
    assert names == [
        "protocol",
        "---",
        "**by_unit**",
        "*random_window_leaky* (LEAKY: not a result)",
    ]


def test_the_page_stands_alone_and_says_what_matters(trained):
    page = (trained / "report.html").read_text()
    text = visible_text(page)
    for word in (
        "CNN",
        "indicators",
        "RMS threshold",
        "label shuffle",
        "chance",
        "Caveats",
        "4 test unit(s)",
    ):
        assert word in text
    assert (
        text.index("by_unit")
        < text.index("random_window_leaky (LEAKY)")
        < text.index("Which faults are found")
    )
    assert "1-NN" not in text
    sources = re.findall(r'src="([^"]{0,40})', page)
    assert len(sources) == 6
    assert all(source.startswith("data:image/png;base64,") for source in sources)
    assert "<script" not in page


def test_chosen_baselines_stand_in_the_report(data, tmp_path):
    out = tmp_path / "out"
    few = [
        "protocols=[by_unit]",
        "shuffle_control=false",
        "baselines=[nearest_spectrum,minirocket]",
        "metadata_probe=false",
    ]
    words = [
        "train",
        "data=good",
        f"out={out}",
        *FAST[:2],
        "epochs=1",
        "seeds=[0]",
        *FAST[4:],
        *few,
    ]
    assert main([*words, "minirocket_features=168"]) == 0
    text = visible_text((out / "report.html").read_text())
    assert "protocol CNN 1-NN on spectra MiniRocket chance by_unit" in text
    assert "MiniRocket : ridge regression" in text
    metrics = json.loads((out / "metrics.json").read_text())
    assert list(metrics["protocols"]["by_unit"]["methods"]) == [
        "nearest_spectrum",
        "minirocket",
        "cnn",
        "chance",
    ]


def test_names_from_a_file_stay_text_in_the_page(trained, tmp_path):
    text = (
        (trained / "metrics.json")
        .read_text()
        .replace('"pitting"', '"<img src=x onerror=alert(1)>"')
    )
    page = write_report(tmp_path, json.loads(text)).read_text()
    assert "<img src=x" not in page
    assert "<img src=x onerror=alert(1)>" in visible_text(page)


def visible_text(page):
    """Text of an HTML page, words separated by single spaces."""
    collected = []
    parser = HTMLParser()
    parser.handle_data = collected.append
    parser.feed(page.partition("</style>")[2])
    return " ".join(" ".join(collected).split())


def test_evaluate_repeats_the_test_score_of_its_seed(trained, data, capsys, tmp_path):
    model = trained / "models" / "by_unit-seed1"
    assert (
        main(["evaluate", "data=good", f"model_dir={model}", f"out={tmp_path / 'e'}"])
        == 0
    )
    assert (
        "test part of by_unit (the data set it was trained on)"
        in capsys.readouterr().out
    )
    result = json.loads((tmp_path / "e" / "metrics.json").read_text())
    study = json.loads((trained / "metrics.json").read_text())
    expected = study["protocols"]["by_unit"]["methods"]["cnn"]["balanced_accuracy"][
        "per_seed"
    ][1]
    assert result["balanced_accuracy"]["mean"] == pytest.approx(expected, abs=1e-12)
    calibration = study["protocols"]["by_unit"]["calibration"]
    assert result["calibration"]["temperature"] == calibration["temperature"][1:]
    error = calibration["after"]["expected_calibration_error"][1]
    assert result["calibration"]["after"][
        "expected_calibration_error"
    ] == pytest.approx([error], abs=1e-6)
    assert (tmp_path / "e" / "confusion.png").stat().st_size > 1000


def test_evaluate_on_another_data_set_takes_all_records(trained, data, capsys):
    data["other"] = fake(seed=9)
    assert (
        main(
            [
                "evaluate",
                "data=other",
                f"model_dir={trained / 'models' / 'by_unit-seed0'}",
            ]
        )
        == 0
    )
    assert capsys.readouterr().out.startswith("64 records of 16 unit(s): all records")


@pytest.mark.parametrize(
    ("changes", "attributes", "message"),
    [
        ({"sampling_rate": 6400.0}, {}, "sampled at 6400 Hz, trained at 12800 Hz"),
        (
            {"classes": ("healthy", "crack", "pitting", "broken")},
            {},
            "its classes are healthy, crack, pitting, broken",
        ),
        (
            {"classes": ("healthy", "crack")},
            {},
            "its classes are healthy, crack, the model knows",
        ),
        ({}, {"schema_version": 2}, "data schema 2, trained on schema 1"),
    ],
)
def test_evaluate_refuses_what_does_not_fit(
    trained, data, capsys, monkeypatch, changes, attributes, message
):
    if "broken" in changes.get("classes", ()):
        monkeypatch.setitem(sys.modules["fake_dataset"].IMPULSE, "broken", 1.0)
        monkeypatch.setitem(sys.modules["fake_dataset"].CARRIER_HZ, "broken", 1.0)
    data["other"] = fake(**changes)
    data["other"].attributes.update(attributes)
    fails(
        capsys,
        ["evaluate", "data=other", f"model_dir={trained / 'models' / 'by_unit-seed0'}"],
        message,
    )


def test_evaluate_refuses_other_channels(trained, data, capsys):
    data["other"] = fake()
    data["other"].channel_names = ("housing",)
    words = [
        "evaluate",
        "data=other",
        f"model_dir={trained / 'models' / 'by_unit-seed0'}",
    ]
    fails(capsys, words, "no channel channel_0 (it has housing)")


def damaged(trained, tmp_path, **files):
    for name in ("model.json", "model.safetensors"):
        content = files.get(
            name.replace(".", "_"),
            (trained / "models" / "by_unit-seed0" / name).read_bytes(),
        )
        (tmp_path / name).write_bytes(content)
    return f"model_dir={tmp_path}"


def test_evaluate_refuses_damaged_models(trained, data, capsys, tmp_path):
    fails(
        capsys,
        ["evaluate", "data=good", f"model_dir={trained}"],
        "choose one of its models, for instance",
    )
    fails(
        capsys,
        ["evaluate", "data=good", f"model_dir={tmp_path}"],
        "holds no model.json",
    )
    import pickle

    for content in (pickle.dumps({"weights": [1.0]}), b"", b"PK\x03\x04" + bytes(400)):
        words = [
            "evaluate",
            "data=good",
            damaged(trained, tmp_path, model_safetensors=content),
        ]
        fails(capsys, words, "is not a safetensors file")
    words = ["evaluate", "data=good", damaged(trained, tmp_path, model_json=b"{}")]
    fails(capsys, words, "does not describe a model")
    text = (trained / "models" / "by_unit-seed0" / "model.json").read_text()
    later = text.replace(
        '"model_schema_version": 2', '"model_schema_version": 9'
    ).encode()
    fails(
        capsys,
        ["evaluate", "data=good", damaged(trained, tmp_path, model_json=later)],
        "model schema 9",
    )
    wider = json.loads(text)
    wider["model"]["widths"] = [8, 32]
    words = [
        "evaluate",
        "data=good",
        damaged(trained, tmp_path, model_json=json.dumps(wider).encode()),
    ]
    fails(capsys, words, "does not fit model.json")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["train", "data=good"], "out is required"),
        (["train", "data=none", "out=OUT"], "none is no data set"),
        (
            ["train", "data=good", "out=OUT", "protocols=[by_unitt]"],
            "no protocol 'by_unitt'; did you mean by_unit",
        ),
        (
            ["train", "data=good", "out=OUT", "protocols=[cross_specimen]"],
            "cross_specimen: 1 specimen_id in the plan",
        ),
        (
            ["train", "data=good", "out=OUT", "protocols=[open_set]"],
            "no protocol 'open_set'",
        ),
        (
            ["train", "data=good", "out=OUT", "protocols=[cross_sensor]"],
            "cross_sensor: the data set has 1 channel",
        ),
        (
            ["train", "data=good", "out=OUT", "test_channels=[channel_0]"],
            "test_channels needs channels beside it",
        ),
        (
            ["train", "data=good", "out=OUT", "classes=[healthy,crak]"],
            "no class 'crak'; did you mean crack",
        ),
        (
            ["train", "data=good", "out=OUT", "classes=[crack]"],
            "one class only (crack)",
        ),
        (["train", "data=good", "out=OUT", "epoch=3"], "epochs"),
        (["train", "data=good", "out=OUT", "model=cnnn"], "cnn"),
        (["train", "data=good", "out=OUT", "normalise=rms,none"], "-m"),
        (
            ["train", "data=good", "out=OUT", "features=al"],
            "features must be basic or all, not 'al'",
        ),
        (["train", "data=good", "out=OUT", "window_samples=100000"], "longest stretch"),
        (["train", "--fast"], "no flag '--fast'"),
        (["evaluate", "data=good"], "model_dir is required"),
        (["evaluate", "data=good", "modeldir=x"], "did you mean model_dir"),
        (["evaluate", "data=good", "x"], "not of the form key=value"),
        (["learn"], "no command 'learn'"),
    ],
)
def test_mistakes_are_one_line_and_leave_nothing(
    words, message, data, capsys, tmp_path
):
    fails(
        capsys, [word.replace("OUT", str(tmp_path / "out")) for word in words], message
    )
    assert list(tmp_path.iterdir()) == []


def test_a_real_folder_that_is_no_data_set(capsys, tmp_path):
    (tmp_path / "data").mkdir()
    fails(
        capsys,
        ["train", f"data={tmp_path / 'data'}", f"out={tmp_path / 'out'}"],
        str(tmp_path / "data"),
    )
    assert not (tmp_path / "out").exists()


def test_existing_out_is_refused_before_the_data_is_read(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(
        gensig.dataset.reader, "open_dataset", lambda path: pytest.fail("read")
    )
    (tmp_path / "precious").write_text("x")
    fails(
        capsys,
        ["train", "data=good", f"out={tmp_path}"],
        "exists and is not an empty folder",
    )
    fails(
        capsys,
        ["train", "-m", "data=good", f"out={tmp_path}", "normalise=rms,none"],
        "exists and is not an empty",
    )
    fails(
        capsys,
        ["evaluate", "data=good", "model_dir=x", f"out={tmp_path}"],
        "exists and is not an empty folder",
    )
    assert (tmp_path / "precious").read_text() == "x"


def test_multirun_writes_one_folder_for_each_value(data, tmp_path):
    out = tmp_path / "runs"
    few = [
        "protocols=[by_unit]",
        "seeds=[0]",
        "epochs=1",
        "shuffle_control=false",
        "baselines=false",
    ]
    words = [
        "train",
        "data=good",
        "-m",
        f"out={out}",
        *FAST[:2],
        *FAST[4:],
        *few,
        "normalise=rms,none",
    ]
    assert main(words) == 0
    assert sorted(path.name for path in out.iterdir()) == [
        "0-normalise=rms",
        "1-normalise=none",
    ]
    assert (
        json.loads((out / "1-normalise=none" / "metrics.json").read_text())["settings"][
            "normalise"
        ]
        == "none"
    )


def test_help_loads_nothing_heavy():
    code = (
        "import sys, diagnose.cli\n"
        "try:\n    diagnose.cli.main(['train', '--help'])\nexcept SystemExit as end:\n    assert end.code == 0\n"
        "heavy = {'torch', 'sklearn', 'matplotlib', 'hydra', 'scipy', 'numpy'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    shown = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert shown.returncode == 0, shown.stderr
    assert "diagnose train data=" in shown.stdout


def test_diagnose_loads_neither_numba_nor_the_physics():
    code = (
        "import sys, diagnose.studies.study, diagnose.report.page, diagnose.recordings.evaluate\n"
        "import diagnose.cli, gensig.dataset.reader\n"
        "bad = [n for n in sys.modules if n == 'numba' or n.startswith(('gensig.mesh', 'gensig.geometry', "
        "'gensig.faults', 'gensig.dynamics', 'gensig.systems', 'gensig.sensing'))]\n"
        "assert not bad, bad"
    )
    assert (
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, check=False
        ).returncode
        == 0
    )
