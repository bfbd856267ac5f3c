"""A network that learnt from implants does not score what carried them."""

import json
import shutil

import numpy as np
import pytest
from implant_samples import CARRIER_RATE, CARRIER_SPEED, CARRIER_TEETH, carrier
from refusals import refused
from scipy.signal import resample_poly

import gensig
from benchmarks._damaged_models import forge
from diagnose.cli import main
from diagnose.data.windows import subset_segments, task_of
from diagnose.training.carried import Carried, blocks_of, carried_in
from diagnose.training.store import read_description
from gensig.errors import DatasetError
from gensig.implants.blocks import read_blocks

STUDY = (
    "model=cnn", "model.widths=[8,8]", "model.kernels=[32,5]", "model.strides=[8,4]",
    "window_samples=1024", "epochs=1", "seeds=[0]", "baselines=false", "n_threads=1",
    "shuffle_control=false", "metadata_probe=false", "n_bootstrap=20",
    "protocols=[by_unit]",
)  # fmt: skip


@pytest.fixture(scope="module")
def made(tmp_path_factory, pairs_folder):
    """Folder with recordings, two sets of implants in them, and networks of the first."""
    folder = tmp_path_factory.mktemp("carried")
    for seed, name in enumerate(("monday", "tuesday", "other")):
        save(folder / f"{name}.npz", carrier(seed)[0].acceleration)
    implant(folder, pairs_folder, "set", ("monday", "tuesday"), seed=0)
    implant(folder, pairs_folder, "again", ("monday", "tuesday"), seed=1)
    implant(folder, pairs_folder, "others", ("other",), seed=0)
    with np.load(folder / "monday.npz") as file:
        save(folder / "late.npz", -0.1 * file["acceleration"][:, 1000:])
    implant(folder, pairs_folder, "altered", ("late",), seed=2)
    data = [f"data={folder / 'set'}", f"out={folder / 'study'}"]
    assert main(["train", *data, *STUDY]) == 0
    return folder


def save(file, acceleration):
    np.savez(file, acceleration=acceleration, sampling_rate_hz=CARRIER_RATE)
    return str(file)


def implant(folder, pairs, out, names, **options):
    gensig.implant(
        pairs,
        [folder / f"{name}.npz" for name in names],
        out=folder / out,
        teeth=CARRIER_TEETH,
        speed_rpm=CARRIER_SPEED,
        duration_s=0.32,
        n_records=72,
        path="none",
        **options,
    ).close()


def model(made):
    return made / "study" / "models" / "by_unit-seed0"


def predict(made, capsys, *words, status=(0, 3)):
    capsys.readouterr()
    command = ["predict", "--model", str(model(made)), *map(str, words)]
    assert main(command) in status
    return capsys.readouterr()


def command_refused(capsys, *words):
    """The one line that a command refuses with."""
    capsys.readouterr()
    assert main([str(word) for word in words]) == 2
    said = capsys.readouterr()
    (line,) = said.err.strip().splitlines()
    assert said.out == ""
    return line


def stretches(made, name, *, carries):
    blocks = read_description(model(made)).carried.blocks
    return [
        (block.start, block.stop)
        for block in blocks
        if block.file == f"{name}.npz" and block.carries is carries
    ]


def test_the_model_knows_the_blocks_of_its_set_and_those_it_saw(made):
    with gensig.open_dataset(made / "set") as data:
        carried = read_description(model(made)).carried
        assert carried.blocks == read_blocks(data) == blocks_of(data)
        units = data.column("unit_id")
        split = data.split("by_unit")
    names = {block.number: block.name for block in carried.blocks}
    seen = {names[number] for number in carried.seen}
    tested = {units[row[0]] for row in split["test"]}
    trained = {units[row[0]] for part in ("train", "validation") for row in split[part]}
    assert seen == trained
    assert not seen & tested


def test_a_recording_that_carried_is_refused_in_one_line(made, capsys):
    file = made / "monday.npz"
    line = command_refused(capsys, "predict", "--model", model(made), file)
    held = stretches(made, "monday", carries=False)
    n_carried = sum(
        stop - start for start, stop in stretches(made, "monday", carries=True)
    )
    start, stop = held[0][0], held[-1][1]
    assert str(file) in line
    assert f"{n_carried} of its {round(8 * CARRIER_RATE)} samples" in line
    assert f"samples {start} to {stop}" in line
    assert f"{start / CARRIER_RATE:.4g} to {stop / CARRIER_RATE:.4g} s" in line
    assert "--held-out" in line


def test_it_is_known_by_its_samples_where_the_file_is_another(made, capsys, tmp_path):
    with np.load(made / "monday.npz") as file:
        np.savez_compressed(tmp_path / "copy.npz", **file)
    copied = tmp_path / "copy.npz"
    assert copied.read_bytes() != (made / "monday.npz").read_bytes()
    assert "copy.npz" in command_refused(
        capsys, "predict", "--model", model(made), copied
    )


def rewritten(made, file, form):
    """Monday's recording in another form, and the share of its samples that were left."""
    with np.load(made / "monday.npz") as content:
        samples = content["acceleration"]
    rate, first = CARRIER_RATE, 0
    if form == "part":
        first = round(2.5 * CARRIER_RATE)
        samples = samples[:, first:]
    if form == "faster":
        samples, rate = resample_poly(samples, 5, 4, axis=1), 1.25 * CARRIER_RATE
    if form == "rounded":
        samples = np.round(-samples * 100.0).astype(np.int16)
    np.savez(file, acceleration=samples, sampling_rate_hz=rate)
    return rate, first / CARRIER_RATE


@pytest.mark.parametrize("form", ["part", "faster", "rounded"])
def test_it_is_known_in_another_form_and_what_was_held_out_is_scored(
    made, capsys, tmp_path, form
):
    file = tmp_path / "form.npz"
    _, first = rewritten(made, file, form)
    line = command_refused(capsys, "predict", "--model", model(made), file)
    assert "carried implants in the training of this model" in line
    said = json.loads(predict(made, capsys, file, "--held-out", "--json").out)
    held = stretches(made, "monday", carries=False)
    for key, sample in (("start_s", held[0][0]), ("stop_s", held[-1][1])):
        expected = min(sample / CARRIER_RATE, 8.0) - first
        assert said["held_out"][key] == pytest.approx(expected, abs=0.003)
    assert said["held_out"]["start_s"] >= held[0][0] / CARRIER_RATE - first


def test_without_fingerprints_the_form_decides(made, capsys, tmp_path):
    """A model of an earlier version says so, and knows the very samples alone."""
    content = described(made, tmp_path)
    del content["carried"]["fingerprints"]
    write(tmp_path, content)
    rewritten(made, tmp_path / "form.npz", "part")
    capsys.readouterr()
    words = ["predict", "--model", str(tmp_path)]
    assert main([*words, str(tmp_path / "form.npz")]) in (0, 3)
    assert "knows the recordings that carried" in capsys.readouterr().err
    assert main([*words, str(made / "monday.npz")]) == 2


def test_held_out_scores_the_held_out_samples_alone(made, capsys, tmp_path):
    """They give what a file of them gives, whatever the samples that carried are."""
    words = ("--held-out", "--json")
    said = json.loads(predict(made, capsys, made / "monday.npz", *words).out)
    held = stretches(made, "monday", carries=False)
    start, stop = held[0][0], held[-1][1]
    assert said["held_out"] == {
        "start_sample": start,
        "stop_sample": stop,
        "start_s": start / CARRIER_RATE,
        "stop_s": stop / CARRIER_RATE,
        "n_samples_recorded": round(8 * CARRIER_RATE),
    }
    with np.load(made / "monday.npz") as file:
        cut = save(tmp_path / "cut.npz", file["acceleration"][:, start:stop])
    alone = json.loads(predict(made, capsys, cut, "--json").out)
    assert alone["held_out"] is None
    assert said["probabilities"] == alone["probabilities"]
    assert said["windows"] == alone["windows"]


def test_the_line_says_what_was_scored(made, capsys):
    files = made / "monday.npz", made / "other.npz"
    monday, other = predict(made, capsys, *files, "--held-out").out.strip().splitlines()
    start = stretches(made, "monday", carries=False)[0][0]
    assert f"held out: only samples {start} to" in monday
    assert "carried nothing in the training, all of it was scored" in other
    assert "held out" not in predict(made, capsys, made / "other.npz").out


def test_held_out_of_a_recording_without_any_is_refused(made, capsys, tmp_path):
    content = described(made, tmp_path)
    for entry in content["carried"]["blocks"]:
        entry["carries"] = True
    write(tmp_path, content)
    file = made / "monday.npz"
    line = command_refused(capsys, "predict", "--model", tmp_path, file, "--held-out")
    assert "none of it was held out: score another recording" in line


def test_evaluation_takes_its_own_test_part_and_other_recordings(made, capsys):
    for words in ((), ("protocol=by_unit",), ("protocol=by_unit", "subset=test")):
        command = ["evaluate", "--model", str(model(made)), f"data={made / 'set'}"]
        assert main([*command, *words]) == 0
        assert "test part of by_unit" in capsys.readouterr().out
    command = ["evaluate", "--model", str(model(made)), f"data={made / 'others'}"]
    assert main(command) == 0
    assert "all records" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ("set", ["protocol=by_unit", "subset=train"]),
        ("set", ["protocol=by_unit", "subset=validation"]),
        ("set", ["protocol=random_window_leaky"]),
        ("again", []),  # other records of the same recordings
        ("again", ["protocol=random_window_leaky", "subset=test"]),
        ("altered", []),  # implants in a part of a recording, in another unit
    ],
)
def test_evaluation_refuses_stretches_of_the_training(made, capsys, data, words):
    command = ["evaluate", "--model", model(made), f"data={made / data}"]
    line = command_refused(capsys, *command, *words)
    assert "carried implants in the training of this model" in line
    assert any(f"{name}.npz" in line for name in ("monday", "tuesday", "late"))


def test_records_of_a_second_set_are_refused_if_and_only_if_they_overlap(made):
    """The blocks of the test part were not seen: a second set of them is no memory."""
    from diagnose.training.carried import refuse_seen

    carried = read_description(model(made)).carried
    with gensig.open_dataset(made / "again") as data:
        task = task_of(data, window_samples=64, stride_samples=64, normalise="rms")
        segments = subset_segments(task, "random_window_leaky", "test")
        numbers = {block.name: block.number for block in blocks_of(data)}
        unit = data.column("unit_id")[segments.record]
        is_seen = np.array([numbers[name] in carried.seen for name in unit])
        assert 0 < is_seen.sum() < is_seen.size
        refuse_seen(carried, data, segments.of(~is_seen))
        refuse_seen(None, data, segments)
        first = np.flatnonzero(is_seen)[0]
        is_seen[first] = False
        n_records = len(set(segments.record[~is_seen].tolist()))
        with refused(f": 1 of {n_records} records", DatasetError):
            refuse_seen(carried, data, segments.of(~is_seen))


def described(made, folder):
    """Content of the description of a copy of the model."""
    shutil.copytree(model(made), folder, dirs_exist_ok=True)
    return json.loads((folder / "model.json").read_text())


def write(folder, content):
    forge(folder, content)


def test_a_model_of_an_earlier_version_is_read_and_refuses_nothing(
    made, capsys, tmp_path
):
    content = described(made, tmp_path)
    del content["carried"]
    write(tmp_path, content)
    assert read_description(tmp_path).carried is None
    file = made / "monday.npz"
    assert main(["predict", "--model", str(tmp_path), str(file)]) in (0, 3)
    line = command_refused(capsys, "predict", "--model", tmp_path, file, "--held-out")
    assert "knows of no implants" in line


@pytest.mark.parametrize(
    ("where", "value"),
    [
        (("blocks", 0, "carries"), "no"),
        (("blocks", 0, "stop_sample"), -1),
        (("blocks", 0, "start_sample"), None),
        (("blocks", 0, "sha256"), "abc"),
        (("blocks", 1, "number"), 0),
        (("blocks", 0), 7),
        (("blocks",), None),
        (("seen",), [999]),
        (("seen",), None),
        (("fingerprints", 0, "pieces"), "no"),
        (("fingerprints",), 7),
        ((), [1]),
    ],
)
def test_damaged_blocks_are_refused_in_one_line(made, capsys, tmp_path, where, value):
    content = described(made, tmp_path)
    target, (*path, last) = content, ("carried", *where)
    for key in path:
        target = target[key]
    target[last] = value
    write(tmp_path, content)
    line = command_refused(capsys, "predict", "--model", tmp_path, made / "other.npz")
    assert "model.json does not describe a model" in line


def test_no_implants_no_blocks(pairs):
    task = task_of(pairs, window_samples=64, stride_samples=64, normalise="rms")
    assert carried_in(task, "by_unit") is None
    none = Carried(blocks=(), seen=())
    assert none.of_recording(frozenset({"a"}), carrier(0)[0]) == ()
