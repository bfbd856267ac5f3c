"""The command from data to report, and one line for every mistake."""

import json
import re
import subprocess
import sys
from html.parser import HTMLParser

import fake_dataset
import numpy as np
import pytest
from fake_dataset import FakeDataset
from offline_pages import NOTHING, outward, sent_by
from runs import (
    FAST,
    NETWORK_ONLY,
    metrics_of,
    model_of,
    refuses,
    rows_of,
    says,
    serve,
    train,
)
from sklearn.metrics import balanced_accuracy_score

import diagnose.commands.verify
import gensig.dataset.reader
from benchmarks._damaged_models import forge
from diagnose.cli import main
from diagnose.report.page import ClassReport, result_table
from gensig.text.installation import install


def fake(**changes):
    sizes = {"n_units": 16, "records_per_unit": 4, "duration": 0.5}
    return FakeDataset(**{**sizes, **changes})


@pytest.fixture
def data(monkeypatch):
    """Data sets by name, opened in place of folders."""
    offered = {"good": fake()}
    serve(monkeypatch, offered)
    return offered


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    out = tmp_path_factory.mktemp("study") / "out"
    return train(out, fake(), *FAST, "seeds=[0,1]")


@pytest.fixture(scope="module")
def by_unit(trained):
    """Result of by_unit."""
    return metrics_of(trained)["protocols"]["by_unit"]


def test_train_writes_what_it_promises(trained, by_unit):
    names = sorted(path.name for path in trained.iterdir())
    assert " ".join(names) == (
        "comparisons.csv confusion_by_unit.csv confusion_by_unit.png "
        "confusion_random_window_leaky.csv confusion_random_window_leaky.png "
        "metrics.json models predictions.csv reliability.png "
        "report.html report.md scores.csv scores.png study.json window_length.png"
    )
    metrics = metrics_of(trained)
    assert list(metrics["protocols"]) == ["by_unit", "random_window_leaky"]
    reason = "the plan has 1 set of gears, and at least 4 are needed"
    assert metrics["protocols_left_out"] == {"cross_specimen": reason}
    page = (trained / "report.html").read_text()
    assert "cross_specimen is left out: the plan has 1 set of gears" in page
    assert "needs 19 healthy or reference records of validation machines" in page
    methods = by_unit["methods"]
    judged = {"cnn", "label_shuffle", "indicators", "rms_threshold", "tooth_logistic"}
    probes = {
        "indicators_without_level",
        "metadata_probe",
        "result_probe",
        "rotation_probe",
        "chance",
    }
    rivals = (
        "indicators",
        "indicators_without_level",
        "rms_threshold",
        "tooth_logistic",
    )
    judged |= {f"label_shuffle_{name}" for name in rivals}
    assert set(methods) == judged | probes
    for name in judged:
        value = methods[name]["balanced_accuracy"]
        assert 0 <= value["low"] <= value["high"] <= 1
        assert np.sum(methods[name]["confusion"]) == 16 * len(methods[name]["seeds"])
    assert methods["chance"]["balanced_accuracy"] == 0.25
    temperatures = by_unit["calibration"]["temperature"]
    for seed, epoch in enumerate(by_unit["last_epoch"]["epoch"]):
        assert by_unit["best_epoch"][seed] <= epoch == 2
        path = trained / "models" / f"by_unit-seed{seed}" / "model.json"
        assert json.loads(path.read_text())["temperature"] == temperatures[seed]
    assert not list(trained.rglob("*.pkl")) + list(trained.rglob("*.pt"))


def test_predictions_hold_what_the_scores_are_made_of(trained, by_unit):
    names = metrics_of(trained)["class_names"]
    rows = rows_of(trained / "predictions.csv")
    chosen = ("by_unit", "indicators")
    mine = [row for row in rows if (row["protocol"], row["method"]) == chosen]
    label, predicted = ([row[key] for row in mine] for key in ("label", "predicted"))
    score = by_unit["methods"]["indicators"]["balanced_accuracy"]["mean"]
    expected = balanced_accuracy_score(label, predicted)
    assert expected == pytest.approx(score, abs=1e-12)
    for row in mine:
        scores = [float(row[f"log_probability_{name}"]) for name in names]
        assert names[np.argmax(scores)] == row["predicted"]
    assert {row["method"] for row in rows} >= {"cnn", "indicators", "label_shuffle"}


def test_the_table_shows_the_leaky_protocol_last_and_says_so(trained):
    metrics = metrics_of(trained)
    metrics["protocols"] = dict(reversed(metrics["protocols"].items()))
    names = [line.split("|")[1].strip() for line in result_table(metrics)]
    leaky = "*random_window_leaky* (LEAKY: not a result)"
    assert names == ["protocol", "---", "**by_unit**", leaky]


def visible_text(page):
    """Text of an HTML page, words separated by single spaces."""
    collected = []
    parser = HTMLParser()
    parser.handle_data = collected.append
    parser.feed(page.partition("</style>")[2])
    return " ".join(" ".join(collected).split())


def test_the_page_stands_alone_and_says_what_matters(trained):
    page = (trained / "report.html").read_text()
    text = visible_text(page)
    methods = ("cnn network", "indicators", "RMS threshold", "label shuffle", "chance")
    for word in (*methods, "Caveats", "only 4 machines in the test part"):
        assert word in text
    order = ("by_unit", "random_window_leaky (LEAKY)", "Which faults are found")
    assert sorted(order, key=text.index) == [*order]
    assert "1-NN" not in text
    sources = re.findall(r'src="([^"]{0,40})', page)
    assert len(sources) == 5
    assert all(source.startswith("data:image/png;base64,") for source in sources)
    assert "<script" not in page
    assert outward(page) == []


def test_the_page_fetches_nothing(browser, trained):
    assert sent_by(browser, trained / "report.html") == NOTHING


def test_names_from_a_file_stay_text_in_the_page(trained, tmp_path):
    name = "<img src=x onerror=alert(1)>"
    text = json.dumps(metrics_of(trained)).replace('"pitting"', f'"{name}"')
    page = ClassReport(metrics=json.loads(text)).write(tmp_path).read_text()
    assert "<img src=x" not in page
    assert name in visible_text(page)


def test_evaluate_repeats_the_test_score_of_its_seed(
    trained, by_unit, data, capsys, tmp_path
):
    out = tmp_path / "e"
    model = model_of(trained, "by_unit-seed1")
    words = ["--model", str(model), "data=good", f"out={out}"]
    shown = says(capsys, "evaluate", *words)
    assert "test part of by_unit (the data set it was trained on)" in shown
    result, calibration = metrics_of(out), by_unit["calibration"]
    accuracy = by_unit["methods"]["cnn"]["balanced_accuracy"]["per_seed"][1]
    assert result["balanced_accuracy"]["mean"] == pytest.approx(accuracy, abs=1e-12)
    assert result["calibration"]["temperature"] == calibration["temperature"][1:]
    found, expected = (
        each["after"]["expected_calibration_error"]
        for each in (result["calibration"], calibration)
    )
    assert found == pytest.approx(expected[1:], abs=1e-6)
    assert (out / "confusion.png").read_bytes().startswith(b"\x89PNG")


def evaluating(trained, name="other"):
    return ["evaluate", f"data={name}", "--model", str(model_of(trained))]


def test_evaluate_on_another_data_set_takes_all_records(trained, data, capsys):
    data["other"] = fake(seed=9)
    shown = says(capsys, *evaluating(trained))
    assert shown.startswith("64 records of 16 machine(s): all records")


OTHER_CLASSES = ("healthy", "crack", "pitting", "broken")


@pytest.mark.parametrize(
    ("changes", "attributes", "message"),
    [
        ({"sampling_rate": 6400.0}, {}, "sampled at 6400 Hz, trained at 12800 Hz"),
        ({"classes": OTHER_CLASSES}, {}, "are healthy, crack, pitting, broken"),
        ({"classes": OTHER_CLASSES[:2]}, {}, "are healthy, crack, the model knows"),
        (
            {},
            {"schema_version": 3},
            "data schema 3, trained on schema 1, and this version reads",
        ),
    ],
)
def test_evaluate_refuses_what_does_not_fit(
    trained, data, capsys, monkeypatch, changes, attributes, message
):
    for table in (fake_dataset.IMPULSE, fake_dataset.CARRIER_HZ):
        monkeypatch.setitem(table, "broken", 1.0)
    data["other"] = fake(**changes)
    data["other"].attributes.update(attributes)
    refuses(capsys, evaluating(trained), message)


def test_evaluate_reads_every_readable_format(trained, data, capsys):
    data["other"] = fake()
    data["other"].attributes["schema_version"] = 2
    says(capsys, *evaluating(trained))


def test_evaluate_refuses_other_channels(trained, data, capsys):
    data["other"] = fake()
    data["other"].channel_names = ("housing",)
    refuses(capsys, evaluating(trained), "no channel channel_0 (it has housing)")


@pytest.mark.parametrize("weights", [b"\x80\x04\x95.", b"", b"PK\x03\x04" + bytes(400)])
def test_evaluate_refuses_weights_of_another_format(
    trained, data, capsys, tmp_path, weights
):
    """A pickle, nothing and a zip file."""
    description = (trained / "models" / "by_unit-seed0" / "model.json").read_bytes()
    (tmp_path / "model.json").write_bytes(description)
    (tmp_path / "model.safetensors").write_bytes(weights)
    words = ["evaluate", "data=good", "--model", str(tmp_path)]
    refuses(capsys, words, "model.safetensors was altered")
    forge(tmp_path)
    refuses(capsys, words, "is not a safetensors file")


def test_evaluate_refuses_folders_that_are_no_model(trained, data, capsys, tmp_path):
    words = ["evaluate", "data=good"]
    models = sorted(map(str, (trained / "models").iterdir()))
    message = f"choose one of its models: {', '.join(models)}"
    for folder in (trained, trained / "models"):
        refuses(capsys, [*words, "--model", str(folder)], message)
    refuses(capsys, [*words, "--model", str(tmp_path)], "holds no model.json")
    refuses(capsys, [*words, "--model", str(tmp_path / "x")], "does not exist")


TRAIN = "train data=good out=OUT"


@pytest.mark.parametrize(
    ("typed", "message"),
    [
        ("train data=good", "out is required"),
        (f"{TRAIN} protocols=[by_unitt]", "'by_unitt'; did you mean by_unit"),
        (f"{TRAIN} protocols=[cross_specimen]", "the plan has 1 set of gears"),
        (f"{TRAIN} protocols=[cross_sensor]", "has 1 channel, and 2 are needed"),
        (f"{TRAIN} epoch=3", "epochs"),
        (f"{TRAIN} model=cnnn", "cnn"),
        (f"{TRAIN} normalise=rms,none", "-m"),
        (f"{TRAIN} model=cnn window_samples=100000", "longest stretch"),
        ("train --fast", "no flag '--fast'"),
        ("evaluate out=good", "data is required"),
        ("evaluate data=good modeldir=x", "--model"),
        ("evaluate data=good x", "not of the form key=value"),
        ("learn", "no command 'learn'"),
    ],
)
def test_mistakes_are_one_line_and_leave_nothing(
    typed, message, data, capsys, tmp_path
):
    out = str(tmp_path / "out")
    refuses(capsys, [word.replace("OUT", out) for word in typed.split()], message)
    assert list(tmp_path.iterdir()) == []


def test_a_real_folder_that_is_no_data_set(capsys, tmp_path):
    (tmp_path / "data").mkdir()
    words = ["train", f"data={tmp_path / 'data'}", f"out={tmp_path / 'out'}"]
    refuses(capsys, words, str(tmp_path / "data"))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "typed",
    [
        "train data=good",
        "train -m data=good normalise=rms,none",
        "evaluate data=x --model=y",
    ],
)
def test_existing_out_is_refused_before_the_data_is_read(
    typed, capsys, tmp_path, monkeypatch
):
    monkeypatch.setattr(
        gensig.dataset.reader, "open_dataset", lambda path: pytest.fail("read")
    )
    (tmp_path / "precious").write_text("x")
    words = [*typed.split(), f"out={tmp_path}"]
    refuses(capsys, words, "exists and is not an empty folder")
    assert (tmp_path / "precious").read_text() == "x"


def test_multirun_writes_one_folder_for_each_value(data, tmp_path):
    out = tmp_path / "runs"
    words = ["data=good", "-m", f"out={out}", *FAST, *NETWORK_ONLY, "epochs=1"]
    assert main(["train", *words, "normalise=rms,none"]) == 0
    folders = sorted(out.iterdir())
    assert [path.name for path in folders] == ["0-normalise=rms", "1-normalise=none"]
    assert metrics_of(folders[1])["settings"]["normalise"] == "none"


def test_diagnose_loads_neither_numba_nor_the_physics():
    modules = "cli studies.study report.page recordings.evaluate recordings.predict"
    imports = "".join(f"import diagnose.{name}\n" for name in modules.split())
    physics = r"numba$|gensig\.(mesh|geometry|faults|dynamics|systems|sensing|twin)"
    code = (
        f"import re, sys, gensig.dataset.reader, diagnose.recordings.registry\n{imports}"
        f"print([name for name in sys.modules if re.match({physics!r}, name)])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.stdout.strip(), done.stderr) == ("[]", "")


@pytest.mark.parametrize(("left_with", "status"), [(None, 0), (0, 0), (3, 3)])
def test_a_verb_that_leaves_with_a_status_is_the_command_s(
    left_with, status, monkeypatch
):
    def leave(_):
        sys.exit(left_with)

    monkeypatch.setattr(diagnose.commands.verify, "run", leave)
    assert main(["verify", "anything"]) == status


@pytest.mark.parametrize("missing", ["torch", "sklearn", "safetensors"])
def test_without_its_packages_it_says_what_to_install(missing, tmp_path):
    def run(*words):
        code = (
            f"import sys; sys.modules[{missing!r}] = None; "
            f"from diagnose.cli import main; sys.exit(main({list(words)!r}))"
        )
        command = [sys.executable, "-c", code]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)

    for words in (
        ("train", "data=nothere", "out=report"),
        ("predict", "nothere.csv", "--speed-rpm", "1800"),
        ("evaluate", "data=nothere"),
    ):
        done = run(*words)
        assert done.returncode == 2
        name = missing.replace("sklearn", "scikit-learn")
        expected = f"diagnose: diagnose needs {name}: {install('diagnose')}\n"
        assert done.stderr == expected
    assert run("--help").returncode == run("train", "--help").returncode == 0
