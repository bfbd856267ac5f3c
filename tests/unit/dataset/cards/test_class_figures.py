"""Class figures: chosen record, reproducible bytes, and harmless names."""

import builtins
import shutil

import matplotlib
import numpy as np
import pytest
from dataset_samples import ATTRIBUTES, build, make_plan, write_shard
from matplotlib.image import imread
from numpy.testing import assert_allclose

from gensig.dataset.cards.class_figures import (
    _example,
    example_records,
    write_class_figures,
)
from gensig.dataset.folder.closing import finalize
from gensig.dataset.folder.layout import shard_path
from gensig.dataset.folder.manifest import record_shards
from gensig.dataset.folder.verify import verify
from gensig.dataset.plan import Plan
from gensig.dataset.reader import open_dataset


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    return build(
        tmp_path_factory.mktemp("drawn") / "set", make_plan(), figures=True, failed=18
    )


def test_a_closed_set_has_a_picture_a_class_and_its_card_shows_it(drawn):
    names = ["0-healthy.png", "1-crack.png", "2-pitting.png"]
    assert sorted(path.name for path in (drawn / "figures").iterdir()) == names
    card = (drawn / "README.md").read_text(encoding="utf-8")
    assert all(f"](figures/{name})" in card for name in names)
    assert verify(drawn).problems == []
    for name in names:
        picture = imread(drawn / "figures" / name)
        assert picture.shape[0] > 150
        assert len(np.unique(picture[..., 2])) > 20  # lines and text, not a blank page


def test_the_record_of_median_severity_stands_for_its_class(drawn):
    with open_dataset(drawn) as data:
        label, usable = data.column("label"), data.usable.copy()
        severity = np.linspace(1.0, 0.0, data.n_records)
        data._columns["severity"] = severity
        chosen = example_records(data)
    assert list(chosen) == ["healthy", "crack", "pitting"]
    for number, index in enumerate(chosen.values()):
        mine = severity[(label == number) & usable]
        assert label[index] == number
        assert usable[index]
        assert severity[index] == np.sort(mine)[len(mine) // 2]


def test_an_example_lasts_two_turns_in_ms_and_reaches_half_the_rate_in_khz(drawn):
    with open_dataset(drawn) as data:
        example = _example(data, 0, data.channel_names[0])
        speed, rate = data.column("speed_rpm")[0], data.sampling_rate
        shown = min(2.0 * 60.0 / speed, data.n_samples / rate)
    step = example.time[1] - example.time[0]
    assert_allclose(step, 1e3 / rate)
    assert_allclose(example.time[-1] + step, 1e3 * shown, atol=step)
    assert_allclose(example.frequency[-1], 0.5e-3 * rate)


def test_the_bytes_depend_on_nobody_s_style(drawn, tmp_path):
    folder = shutil.copytree(drawn, tmp_path / "set")
    before = {path.name: path.read_bytes() for path in (folder / "figures").iterdir()}
    with (
        matplotlib.rc_context({"font.size": 22.0, "axes.facecolor": "black"}),
        open_dataset(folder) as data,
    ):
        write_class_figures(data)
        assert matplotlib.rcParams["font.size"] == 22.0
    assert {
        path.name: path.read_bytes() for path in (folder / "figures").iterdir()
    } == before


def test_without_matplotlib_a_card_has_no_pictures(tmp_path, plan, monkeypatch):
    real = builtins.__import__

    def missing(name, *words):
        if name.startswith("matplotlib"):
            raise ImportError(name)
        return real(name, *words)

    monkeypatch.setattr(builtins, "__import__", missing)
    folder = build(tmp_path / "set", plan, figures=True)
    assert not (folder / "figures").exists()
    assert "figures/" not in (folder / "README.md").read_text(encoding="utf-8")
    assert verify(folder).complete


def test_a_class_without_a_usable_record_has_no_picture(tmp_path):
    folder = build(tmp_path / "set", make_plan(n_records=3), figures=True, failed=1)
    assert sorted(path.name for path in (folder / "figures").iterdir()) == [
        "0-healthy.png",
        "2-pitting.png",
    ]
    assert verify(folder).problems == []


def test_hostile_class_names_stay_names(tmp_path):
    """Neither a path, nor mathematics that cannot be set, nor HTML."""
    evil = "../../$\\frac{<b>x"
    plan = make_plan(n_records=6, n_classes=2)
    names = np.where(plan.columns["label"] == 1, evil, plan.columns["label_name"])
    plan = Plan(columns={**plan.columns, "label_name": names})
    folder = build(tmp_path / "set", plan, shards=range(0), close=False)
    writer = write_shard(
        shard_path(folder, 0),
        plan,
        attributes=ATTRIBUTES | {"class_names": ["healthy", evil]},
    )
    record_shards(folder, {0: writer.entry})
    finalize(folder)
    names = sorted(path.name for path in (folder / "figures").iterdir())
    assert names == ["0-healthy.png", "1--frac-b-x.png"]
    assert "<b>" not in (folder / "README.md").read_text(encoding="utf-8")
    assert verify(folder).problems == []
