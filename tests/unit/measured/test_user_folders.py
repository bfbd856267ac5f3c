"""Folders of a user's recordings with a YAML: forms of files, labels, and every mistake."""

import os
import re
from pathlib import Path

import h5py
import numpy as np
import pytest
from refusals import refusals, refused
from scipy import io
from scipy.io import wavfile

from gensig.cli import main
from gensig.measured import load, read_signal
from gensig.measured.file_names import name_pattern

RATE = 10_000
SAMPLES = np.random.default_rng(0).normal(size=(2, 600))


def write_csv(file: Path) -> None:
    time = np.arange(600) / RATE
    table = np.column_stack([time, SAMPLES.T])
    np.savetxt(file, table, delimiter=",", header="time_s,left,right", comments="")


def write_wav(file: Path) -> None:
    wavfile.write(file, RATE, SAMPLES.T.astype(np.float32))


def write_h5(file: Path) -> None:
    with h5py.File(file, "w") as content:
        content["acceleration"] = SAMPLES


WRITERS = {
    "csv": write_csv,
    "wav": write_wav,
    "npy": lambda file: np.save(file, SAMPLES),
    "npz": lambda file: np.savez(file, acceleration=SAMPLES),
    "mat": lambda file: io.savemat(file, {"acceleration": SAMPLES}),
    "h5": write_h5,
}
YAML = """
name: rig
unit: g
sampling_rate_hz: 10000
stages: [[20, 40]]
speed_rpm: 1500
classes: {broken: one_tooth, worn: many_teeth}
files:
- {pattern: "sound*", label: healthy, specimen: a}
- {pattern: "{class}_{specimen}.%s"}
"""


def made(folder: Path, kind: str = "npy", text: str = YAML) -> Path:
    for name in ("sound", "broken_b1", "broken_b2", "worn_w1"):
        WRITERS[kind](folder / f"{name}.{kind}")
    file = folder / "measured.yaml"
    file.write_text(text % kind if "%s" in text else text)
    return file


@pytest.mark.parametrize("kind", sorted(WRITERS))
def test_every_form_of_file_is_read(kind, tmp_path) -> None:
    made(tmp_path, kind)
    found = load(None, tmp_path)
    assert [one.label for one in found.recordings] == [
        "one_tooth",
        "one_tooth",
        "healthy",
        "many_teeth",
    ]
    assert [one.specimen for one in found.recordings[:2]] == ["rig b1", "rig b2"]
    signal = read_signal(found.recordings[0])
    expected = 9.80665 * (SAMPLES - SAMPLES.mean(axis=1, keepdims=True))
    np.testing.assert_allclose(signal.acceleration, expected, rtol=1e-5, atol=1e-5)
    assert signal.sampling_rate == RATE


def test_the_yaml_alone_names_its_folder(tmp_path) -> None:
    file = made(tmp_path)
    assert load(None, file) == load(None, tmp_path)


def test_short_form_of_files(tmp_path) -> None:
    made(
        tmp_path,
        text='files: {"sound.npy": healthy, "broken*": one_tooth}\nsampling_rate_hz: 10000',
    )
    found = load(None, tmp_path)
    assert found.name == tmp_path.name
    assert set(found.missing) == {"speed_rpm", "stages"}
    assert found.n_others == 1


@refusals(
    {
        "unknown key 'unti'; did you mean 'unit'": ("unit: g", "unti: g"),
        "files 1: unknown key 'specimn'": ("specimen: a", "specimn: a"),
        "the label 'fine' is none of healthy": ("label: healthy", "label: fine"),
        "maps 'broken' to 'bad'; allowed": ("broken: one_tooth", "broken: bad"),
        "no file is named silent*; it holds measured": ("sound*", "silent*"),
        "'../sound*' leads out of the folder": ('"sound*"', '"../sound*"'),
        "'/etc/sound*' leads out of the folder": ('"sound*"', '"/etc/sound*"'),
        "the unknown field 'kind'": ("{class}_", "{kind}_"),
        "more than 2 stars": ("sound*", "s*u*n*d"),
        "stages must be pairs of teeth": ("[[20, 40]]", "[20, 40]"),
        "speed_rpm must be a number of 1 to 1e+06, not 'fast'": ("1500", "fast"),
        "sampling_rate_hz must be a number of 1000": ("10000", "10"),
        "python/name:os.system' is refused: option files hold plain values": (
            "unit: g",
            "unit: !!python/name:os.system g",
        ),
        "told 2 times": ("label: healthy", "label: healthy, rows: [[a, 2]]"),
        "no files; give files": ("files:", "notes:"),
        "no YAML": ("name: rig", "- rig"),
        "no measured set 'suu'; did you mean 'seu'": ("name: rig", "set: suu"),
    }
)
def test_mistakes_are_one_line(words, given, tmp_path) -> None:
    right, wrong = given
    assert right in YAML
    made(tmp_path, text=YAML.replace(right, wrong))
    with refused(words):
        load(None, tmp_path)


def test_a_link_out_of_the_folder_is_refused(tmp_path) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    made(folder)
    np.save(tmp_path / "elsewhere.npy", SAMPLES)
    os.symlink(tmp_path / "elsewhere.npy", folder / "sound2.npy")
    with refused("leads out of"):
        load(None, folder)


def test_an_alias_that_grows_is_refused(tmp_path) -> None:
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 9)]
    made(tmp_path, text="\n".join(lines))
    with refused("stands for more than"):
        load(None, tmp_path)


def test_long_names_are_matched_in_a_moment() -> None:
    """Fields take all they can at once: no name makes the expression try again and again."""
    pattern = name_pattern("*{load}_{specimen}_{repeat}*.csv", (), "test")
    assert pattern.match("1" * 390) is None
    assert pattern.match("1" * 5000 + ".csv") is None


def test_numbers_without_names_need_their_columns(tmp_path) -> None:
    np.savetxt(tmp_path / "a.txt", SAMPLES.T)
    text = "sampling_rate_hz: 10000\nfiles: {a.txt: healthy}\ncolumns: [x, y%s]"
    (tmp_path / "measured.yaml").write_text(text % "")
    assert read_signal(load(None, tmp_path).recordings[0]).sensors == ("x", "y")
    (tmp_path / "measured.yaml").write_text(text % ", z")
    with refused("2 columns, the set has 3: x, y, z"):
        read_signal(load(None, tmp_path).recordings[0])


@refusals(
    {
        "no line of numbers": "a b\nc d\n",
        "2 columns of numbers from line 1": "1 2\n3\n4 5\n",
        "2 columns of numbers": "1 2\nx 3\n",
        "too short: 9 rows": "1 2\n" * 9,
    }
)
def test_broken_tables_are_one_line(words, given, tmp_path) -> None:
    (tmp_path / "a.txt").write_text(given)
    (tmp_path / "measured.yaml").write_text(
        "sampling_rate_hz: 10000\nfiles: {a.txt: healthy}"
    )
    with refused(words):
        read_signal(load(None, tmp_path).recordings[0])


def test_the_verb_prints_what_is_there(tmp_path, capsys) -> None:
    made(tmp_path)
    assert main(["measured", str(tmp_path)]) == 0
    text = capsys.readouterr().out
    assert re.search(r"rig +broken +one_tooth +2 +2 +2 +1500 r/min +10000 Hz +g", text)
    assert "specimens healthy 1, one_tooth 2, many_teeth 1" in text
    assert "one specimen a class" not in text
    assert main(["measured", str(tmp_path), "--json"]) == 0
    assert main(["measured"]) == 0
    assert "mcc5_thu" in capsys.readouterr().out


def test_the_verb_says_one_specimen_a_class(tmp_path, capsys) -> None:
    made(tmp_path, text='files: {"sound.npy": healthy, "worn*": many_teeth}')
    assert main(["measured", str(tmp_path)]) == 0
    text = capsys.readouterr().out
    assert "one specimen a class: says nothing about others" in text
    assert "missing: sampling_rate_hz (2 of 2 recordings: not given)" in text


@pytest.mark.parametrize(
    "words", [["seu"], ["seu", "nothere"], ["nothere"], ["a", "b", "c"], ["suu", "."]]
)
def test_words_that_are_wrong_end_with_status_2(
    words, tmp_path, capsys, monkeypatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["measured", *words]) == 2
    assert capsys.readouterr().err.count("\n") == 1
