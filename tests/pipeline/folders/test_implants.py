"""Implants in recordings of another simulated machine, from the command to a trained network."""

import json
import os
import shutil

import numpy as np
import pytest
from small_sets import contents, resume

import gensig
from diagnose.cli import main as diagnose
from gensig.cli import main
from gensig.dataset.folder.verify import verify
from gensig.errors import DatasetError
from gensig.implants.blocks import read_blocks, refuse_carried
from gensig.signals.recording import read_file, recording_of

SETS = (
    "sensing.sampling_rate_hz=12800",
    "sensing.channels=[pinion_y]",
    "executor.n_workers=1",
)
FAULTS = (
    *SETS,
    "plan.classes=[healthy,missing_tooth,wear]",
    "plan.n_records=18",
    "plan.n_units=6",
    "plan.machines=separate",
    "operating.duration_s=0.4",
    "sensing.snr_db=null",
    "dataset.store_healthy_twin=true",
)
MINE = (
    *SETS,
    "gear.pinion.n_teeth=20",
    "gear.wheel.n_teeth=33",
    "operating.speed_rpm=1500",
    "operating.torque_nm=20",
    "plan.classes=[healthy]",
    "plan.n_records=2",
    "operating.duration_s=3",
    "seed=5",
)
WORDS = ("--teeth", "20", "33", "--speed-rpm", "1500", "--records", "54", "--quiet")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Folder with the simulated set, two healthy recordings, and the implants."""
    folder = tmp_path_factory.mktemp("implants")
    for name, words in (("faults", FAULTS), ("mine", MINE)):
        assert main(["generate", "--quiet", *words, f"out={folder / name}"]) == 0
    with gensig.open_dataset(folder / "mine") as mine:
        for index in range(2):
            np.savez(
                folder / f"day{index}.npz",
                acceleration=mine.signals(index),
                sampling_rate_hz=mine.sampling_rate,
            )
    assert main(command(folder, "set")) == 0
    return folder


def command(folder, out, *words):
    files = [str(folder / f"day{index}.npz") for index in range(2)]
    named = [str(folder / "faults"), f"out={folder / out}", *WORDS, *words]
    return ["implant", *named, "--healthy", *files]


def test_the_set_is_whole_and_opens(made):
    assert main(["verify", str(made / "set")]) == 0
    with gensig.open_dataset(made / "set", check="full") as data:
        assert data.class_names == ["healthy", "one_tooth", "many_teeth"]
        assert "by_unit" in data.protocols
        assert "new_machine" in data.protocols
        speeds = data.column("speed_rpm")
        np.testing.assert_allclose(speeds, 1500.0, rtol=0.01)
        one = data.where(fault="one_tooth", carrier_file="day0.npz")
        assert 0 < len(one) < 18  # of both days
        gains = data.column("params/implant_gain_db")
        assert -10 <= np.nanmin(gains) < np.nanmax(gains) <= 10
        is_plain = np.isnan(gains)
        assert set(data.column("label_name")[is_plain]) == {"healthy"}
        assert 0 < is_plain.sum() < (data.column("label_name") == "healthy").sum()
        blocks = read_blocks(data)
    recording = recording_of(read_file(str(made / "day0.npz")))
    with pytest.raises(DatasetError, match=r"carried implants"):
        refuse_carried(blocks, recording, name="day0.npz")


def test_the_same_command_gives_the_same_bytes(made, capsys):
    loud = [word for word in command(made, "again") if word != "--quiet"]
    assert main(loud) == 0
    said = capsys.readouterr()
    assert "2 healthy recording(s) at 1" in said.err
    assert "held out, for scores: " in said.out
    assert contents(made / "again") == contents(made / "set")
    assert main(command(made, "other", "--seed", "1")) == 0
    assert contents(made / "other") != contents(made / "set")


def test_python_makes_the_same_records(made):
    files = [made / f"day{index}.npz" for index in range(2)]
    with (
        gensig.implant(
            made / "faults",
            files,
            out=made / "python",
            teeth=(20, 33),
            speed_rpm=1500,
            n_records=54,
        ) as data,
        gensig.open_dataset(made / "set") as typed,
    ):
        np.testing.assert_array_equal(data.signals(7), typed.signals(7))


def test_its_card_claims_neither_simulation_nor_a_licence(made):
    card = (made / "set" / "README.md").read_text()
    assert "Healthy recordings that carry" in card
    assert "CC BY" not in card
    assert "records are simulated" not in card


def test_its_page_and_an_export_are_made(made):
    assert main(["report", str(made / "set"), "--out", str(made / "page.html")]) == 0
    assert "one_tooth" in (made / "page.html").read_text()
    words = ["--to", "npz", "--out", str(made / "set.npz")]
    assert main(["export", str(made / "set"), *words]) == 0


def test_a_network_trains_on_it(made):
    words = [
        f"data={made / 'set'}", f"out={made / 'trained'}", "model=cnn", "epochs=1",
        "seeds=[0]", "protocols=[by_unit]", "baselines=false", "shuffle_control=false",
        "metadata_probe=false", "n_bootstrap=20",
    ]  # fmt: skip
    assert diagnose(["train", *words]) == 0
    assert (made / "trained" / "report.html").is_file()


@pytest.mark.parametrize("verb", ["resume", "reproduce"])
def test_nothing_simulates_it_again(made, capsys, verb):
    status = main([verb, str(made / "set")])
    said = capsys.readouterr()
    if verb == "resume":  # nothing is missing
        assert status == 0
        return
    assert status == 2
    assert said.err.count("\n") == 1
    assert "made of recordings" in said.err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--speed-rpm", "1270"], "mesh"),
        (["--teeth", "20"], "--teeth 20"),
        (["--gain-db", "5", "-5"], "lower end first"),
        (["out=else"], "out is required, once"),
        (["--channels", "lid"], "no channel lid"),
    ],
)
def test_bad_input_gets_one_line(made, capsys, words, said):
    assert main(command(made, "refused", *words)) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert said in error
    assert not (made / "refused").exists()


def test_out_that_holds_a_set_is_refused(made, capsys):
    assert main(command(made, "set")) == 2
    assert "is not empty: a complete data set" in capsys.readouterr().err
    assert main([*command(made, "x")[:2], *WORDS, "--healthy", "a.npz"]) == 2
    assert "out is required" in capsys.readouterr().err


def test_a_set_without_twins_is_refused(made, capsys):
    words = command(made, "refused")
    words[1] = str(made / "mine")
    assert main(words) == 2
    assert "stores no healthy twins" in capsys.readouterr().err


@pytest.fixture
def place(made):
    """A name beside the set, so that its sources are where its words say."""
    yield made / "torn"
    shutil.rmtree(made / "torn", ignore_errors=True)


@pytest.fixture
def torn(made, place):
    """The set as a run leaves it that was killed in its shard."""
    shutil.copytree(made / "set", place)
    content = json.loads((place / "manifest.json").read_text())
    content["state"] = "incomplete"
    del content["files"]["index.h5"]
    for entry in content["shards"]:
        entry.update(state="planned", sha256="", bytes=0)
        (place / "shards" / entry["name"]).unlink()
    (place / "manifest.json").write_text(json.dumps(content))
    for name in ("index.h5", "README.md", "SHA256SUMS"):
        (place / name).unlink()
    return place


def test_resume_finishes_a_killed_run_with_the_bytes_of_an_undisturbed_one(made, torn):
    assert not verify(torn).complete
    assert resume(torn) == 0
    assert contents(torn) == contents(made / "set")
    assert verify(torn).complete


@pytest.mark.parametrize(
    ("parts", "needs_sources"),
    [
        (["splits"], False),
        (["splits/by_unit.csv", "index.h5"], False),
        (["plan.csv"], True),
        (["shards/shard-00000.h5"], True),
    ],
)
def test_lost_parts_are_made_again(made, place, parts, needs_sources, capsys):
    shutil.copytree(made / "set", place)
    for part in parts:
        lost = place / part
        shutil.rmtree(lost) if lost.is_dir() else lost.unlink()
    hidden = (made / "day1.npz").rename(made / "hidden.npz")
    try:
        assert resume(place) == (2 if needs_sources else 0)
    finally:
        hidden.rename(made / "day1.npz")
    assert ("day1.npz is gone" in capsys.readouterr().err) == needs_sources
    assert resume(place) == 0
    assert contents(place) == contents(made / "set")
    assert verify(place).complete


def alter(path):
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    path.write_bytes(content)


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        ("day0.npz", lambda path: path.unlink(), "is gone, a recording"),
        ("day0.npz", alter, "was altered since"),
        ("day0.npz", lambda path: (path.unlink(), os.mkfifo(path)), "is gone"),
        ("faults", shutil.rmtree, "is gone, the simulated set"),
        (
            "faults",
            lambda path: (
                shutil.rmtree(path),
                shutil.copytree(path.with_name("mine"), path),
            ),
            "another simulated set",
        ),
        ("torn/overrides.yaml", alter, "was altered"),
    ],
)
def test_a_source_that_is_gone_or_altered_is_named(
    made, torn, name, change, said, capsys
):
    path, kept = made / name, made / "kept"
    copied = shutil.copytree if path.is_dir() else shutil.copy
    copied(path, kept)
    before = contents(torn), (torn / "manifest.json").read_bytes()
    try:
        change(path)
        assert resume(torn) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert said in line
        assert str(path) in line
    finally:
        if path.exists():
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        kept.rename(path)
    assert (contents(torn), (torn / "manifest.json").read_bytes()) == before


def test_recordings_in_memory_are_told_of(made, place, capsys):
    recordings = [
        recording_of(read_file(str(made / f"day{day}.npz"))) for day in range(2)
    ]
    gensig.implant(
        made / "faults",
        recordings,
        out=place,
        teeth=(20, 33),
        speed_rpm=1500,
        n_records=54,
    ).close()
    (place / "shards" / "shard-00000.h5").unlink()
    assert resume(place) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "recordings that were in memory" in line
