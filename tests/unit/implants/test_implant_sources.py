"""Words of a folder that name the sources of a set of implants."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml
from refusals import refused

from gensig.dataset.folder.layout import OVERRIDES
from gensig.errors import DatasetError, GensigError
from gensig.implants import implant_sources
from gensig.implants.implant_sources import (
    ImplantSources,
    open_implanter,
    read_sources,
    source_words,
)
from gensig.implants.options import ImplantOptions


def sources(folder):
    return ImplantSources(
        data=folder / "faults",
        healthy=(folder / "monday.csv", folder / "r\udcff.csv"),
        teeth=(29, 95, 36, 90),
        speed_rpm=(1480.0, 1500.5),
        options=ImplantOptions(gain_db=(-3.0, 4.5), duration=0.5, seed=7),
        channels=("x", "y"),
        tacho="pulse",
        pulses_per_turn=2,
    )


def stored(out, words):
    out.mkdir(exist_ok=True)
    (out / OVERRIDES).write_text(yaml.safe_dump(words))
    return out


def test_what_is_stored_is_read_again(tmp_path):
    out = tmp_path / "runs" / "mine"
    out.parent.mkdir()
    assert read_sources(stored(out, source_words(sources(tmp_path), out))) == sources(
        tmp_path
    )


def test_a_tree_that_is_moved_stays_together(tmp_path):
    before, after = tmp_path / "before", tmp_path / "after"
    before.mkdir()
    words = source_words(sources(before), before / "mine")
    assert not any(str(tmp_path) in word for word in words)
    after.mkdir()
    assert read_sources(stored(after / "mine", words)) == sources(after)


def test_the_folder_may_be_named_from_elsewhere(tmp_path, monkeypatch):
    out = stored(tmp_path / "mine", source_words(sources(tmp_path), tmp_path / "mine"))
    monkeypatch.chdir(out)
    assert read_sources(Path(".")) == sources(tmp_path)


@pytest.mark.parametrize(
    "word",
    [
        "teeth=20",
        "teeth=[20.5, 33]",
        "teeth=[true, 33]",
        "gain_db=[1]",
        "gain_db=[1e400, 2]",
        'speed_rpm=["fast"]',
        f"speed_rpm=[{'9' * 400}]",
        'data=["a"]',
        'data="a\\u0000b"',
        "healthy={}",
        'healthy="monday.csv"',
        "path=3",
        "seed=-1",
        "records=0",
        "unit=null",
        "unknown=1",
        "tacho",
        f"channels={'[' * 5000}",
        "seed=",
    ],
)
def test_other_words_are_one_line(tmp_path, word):
    out = tmp_path / "mine"
    name = word.partition("=")[0]
    words = [
        each
        for each in source_words(sources(tmp_path), out)
        if each.partition("=")[0] != name
    ]
    with pytest.raises(GensigError) as raised:
        read_sources(stored(out, [*words, word]))
    assert "\n" not in str(raised.value)
    with refused("does not name the sources", DatasetError):
        read_sources(stored(out, words if name != "unknown" else words[1:]))


def test_every_word_about_recordings_reaches_their_reader(tmp_path, monkeypatch):
    given = {}

    def taken(_, **words):
        given.update(words)
        raise DatasetError("read no further")

    data = SimpleNamespace(close=lambda: None)
    monkeypatch.setattr(implant_sources, "open_dataset", lambda _: data)
    monkeypatch.setattr(implant_sources, "taken_recordings", taken)
    whole = replace(sources(tmp_path), array="X097", unit="g", sampling_rate=51200.0)
    with refused("read no further", DatasetError):
        open_implanter(whole)
    assert given == {name: getattr(whole, name) for name in given}
    assert given.keys() == {"sampling_rate", "channels", "unit", "array", "tacho"}
