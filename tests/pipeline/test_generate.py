"""Data sets from the command line: labelled, whole, with the same bits however they are made."""

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose

import gensig
import gensig.errors
from gensig.cli import main
from gensig.dataset.folder.layout import read_manifest
from gensig.dataset.folder.verify import verify
from gensig.production import making

SMALL = (
    "plan.n_records=8",
    "plan.n_units=4",
    "plan.classes=[healthy,crack,pitting,missing_tooth]",
    "operating.duration_s=0.04",
    "plan.vary={operating.speed_rpm:{distribution:uniform,low:1200,high:2400}}",
    "executor.n_workers=1",
)


def make(out, *overrides):
    words = ["--quiet", *SMALL, *overrides, f"out={out}"]
    assert main(["generate", *words]) == 0
    return out


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """One shard of eight records, made in this process."""
    return make(tmp_path_factory.mktemp("reference") / "data")


def signals(folder):
    with gensig.open_dataset(folder) as data:
        return np.stack([data.signals(index) for index in range(data.n_records)])


def test_bits_do_not_depend_on_shards_or_workers(reference, tmp_path):
    words = ("dataset.records_per_shard=3", "executor.n_workers=2")
    other = make(tmp_path / "data", *words)
    assert signals(other).tobytes() == signals(reference).tobytes()


def test_counts_are_the_signals_but_for_half_a_count(reference, tmp_path):
    words = ("dataset.sample_type=int16", "dataset.compression=blosc2")
    other = make(tmp_path / "data", *words)
    assert verify(other).complete
    assert read_manifest(other).identity != read_manifest(reference).identity
    exact = signals(reference)
    count = np.abs(exact).max(axis=-1, keepdims=True) / 32767
    assert (np.abs(signals(other) - exact) <= 0.505 * count).all()


def test_a_data_set_is_labelled_and_whole(reference):
    result = verify(reference)
    assert result.complete
    assert result.problems == []
    with gensig.open_dataset(reference) as data:
        assert data.class_names == ["healthy", "crack", "pitting", "missing_tooth"]
        label, severity = data.column("label"), data.column("severity")
        assert sorted(label) == [0, 0, 1, 1, 2, 2, 3, 3]
        assert data.sampling_rate == 51200.0
        assert data.attributes["n_teeth_pinion"] == 23
        assert np.all((severity == 0.0) == (label == 0))
        speeds = data.column("speed_rpm"), data.column("speed_set_rpm")
        assert_allclose(*speeds, rtol=2e-3, atol=0.0)
        assert set(data.column("fault_gear")[label > 0]) == {"pinion"}
    with h5py.File(reference / "index.h5") as index:
        assert index["acceleration"].shape == (8, 4, 2048)
        assert np.isfinite(index["acceleration"][...]).all()


def test_multirun_makes_one_data_set_each(tmp_path):
    words = ["plan.n_records=1", "operating.duration_s=0.02", "executor.n_workers=1"]
    out = f"out={tmp_path}"
    assert main(["generate", "-m", "fault=healthy,crack", *words, out]) == 0
    folders = sorted(path.name for path in tmp_path.iterdir())
    assert folders == ["0-fault=healthy", "1-fault=crack"]
    for name in folders:
        with gensig.open_dataset(tmp_path / name) as data:
            assert data.class_names == [name.partition("=")[2]]


def test_python_makes_the_same_bits_with_workers_and_shows_progress(
    reference, tmp_path, capsys
):
    words = [word for word in SMALL if not word.startswith("executor")]
    with gensig.generate(*words, out=tmp_path / "a", workers=1) as data:
        assert data.n_records == 8
    assert "8 of 8 records" in capsys.readouterr().err
    two = ("dataset.records_per_shard=4",)
    gensig.generate(*words, *two, out=tmp_path / "b", workers=2, progress=False)
    assert capsys.readouterr().err == ""
    for name in "ab":
        assert signals(tmp_path / name).tobytes() == signals(reference).tobytes()
    with pytest.raises(gensig.errors.ConfigError, match="n_workers = 0 must be"):
        gensig.generate(*words, out=tmp_path / "c", workers=0)


def test_python_reuses_and_finishes_the_same_data_set_only(
    reference, tmp_path, monkeypatch
):
    words, quiet = [*SMALL, "dataset.records_per_shard=2"], {"progress": False}
    out = tmp_path / "data"
    frozen = ["plan", "--freeze", *words, f"out={out}"]
    assert main(frozen) == 0
    with gensig.generate(*words, out=out, reuse=True, **quiet) as data:
        assert data.manifest.is_complete
    assert signals(out).tobytes() == signals(reference).tobytes()
    before = {path: path.stat().st_mtime_ns for path in out.rglob("*.h5")}
    gensig.generate(*words, out=out, reuse=True, **quiet).close()
    assert {path: path.stat().st_mtime_ns for path in out.rglob("*.h5")} == before
    with pytest.raises(gensig.errors.DatasetError, match="begun with another seed"):
        gensig.generate(*words, "seed=5", out=out, reuse=True, **quiet)
    with pytest.raises(gensig.errors.DatasetError):
        gensig.generate(*words, out=out, **quiet)


def test_python_warns_of_a_plan_without_sense(tmp_path):
    with pytest.warns(UserWarning, match="root of the teeth has"):
        gensig.generate(
            *SMALL, "operating.torque_nm=400", out=tmp_path / "data", progress=False
        )


def test_a_warning_names_the_line_that_called(tmp_path, monkeypatch):
    monkeypatch.setattr(making, "plan_doubts", lambda *_: ["a doubt"])
    with pytest.warns(UserWarning, match="^a doubt$") as warned:
        gensig.generate(*SMALL, out=tmp_path / "data", progress=False).close()
    assert [warning.filename for warning in warned] == [__file__]
