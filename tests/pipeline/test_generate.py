"""Data sets from the command line: the same bits however they are made, nothing lost or faked."""

import json
import resource
import signal
import subprocess
import sys
import time
from functools import partial

import h5py
import numpy as np
import pytest
from small_sets import contents

import gensig
from gensig.cli import main
from gensig.dataset.folder.verify import verify

SMALL = (
    "plan.n_records=8",
    "plan.n_units=4",
    "plan.classes=[healthy,crack,pitting,missing_tooth]",
    "operating.duration_s=0.04",
    "plan.vary={operating.speed_rpm:{distribution:uniform,low:1200,high:2400}}",
    "executor.n_workers=1",
)
LONGER = (*SMALL, "operating.duration_s=0.1", "dataset.records_per_shard=2")


def make(out, *overrides):
    words = ["--quiet", *SMALL, *overrides, f"out={out}"]
    assert main(["generate", *words]) == 0
    return out


def process_of(words, out, **options):
    """A process of its own that makes a data set."""
    command = [sys.executable, "-m", "gensig.cli", "generate", *words, f"out={out}"]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, **options)


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """One shard of eight records, made in this process."""
    return make(tmp_path_factory.mktemp("reference") / "data")


def signals(folder):
    with gensig.open_dataset(folder) as data:
        return np.stack([data.signals(index) for index in range(data.n_records)])


@pytest.mark.parametrize("per_shard", [1, 3])
def test_bits_do_not_depend_on_shards_or_workers(reference, tmp_path, per_shard):
    shards = f"dataset.records_per_shard={per_shard}"
    other = make(tmp_path / "data", shards, "executor.n_workers=2")
    assert signals(other).tobytes() == signals(reference).tobytes()


def test_same_configuration_gives_the_same_bytes_and_another_seed_does_not(
    reference, tmp_path
):
    assert contents(make(tmp_path / "same")) == contents(reference)
    other = make(tmp_path / "other", "seed=1")
    assert not np.array_equal(signals(other), signals(reference))


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
        np.testing.assert_allclose(*speeds, rtol=2e-3, atol=0.0)
        assert set(data.column("fault_gear")[label > 0]) == {"pinion"}
    with h5py.File(reference / "index.h5") as index:
        assert index["acceleration"].shape == (8, 4, 2048)
        assert np.isfinite(index["acceleration"][...]).all()


def test_noise_floor_is_the_same_for_every_class_of_a_condition(reference):
    with gensig.open_dataset(reference) as data:
        noise, condition = data.column("noise_power"), data.column("condition_id")
    for name in set(condition):
        of_condition = noise[condition == name]
        assert np.all(of_condition == of_condition[0])
    assert len({tuple(row) for row in noise}) > 1


def test_sham_plan_keeps_labels_without_faults(tmp_path):
    folder = make(tmp_path / "data", "plan.sham=true", "sensing.snr_db=null")
    with gensig.open_dataset(folder) as data:
        assert set(data.column("severity")) == {0.0}
        assert len(set(data.column("label"))) == 4
        levels = {
            name: np.std(data.signals(index)[1])
            for index, name in enumerate(data.column("label_name"))
        }
    assert 1 / 1.3 < levels["missing_tooth"] / levels["healthy"] < 1.3


def test_multirun_makes_one_data_set_each(tmp_path):
    words = ["plan.n_records=1", "operating.duration_s=0.02", "executor.n_workers=1"]
    out = f"out={tmp_path}"
    assert main(["generate", "-m", "fault=healthy,crack", *words, out]) == 0
    folders = sorted(path.name for path in tmp_path.iterdir())
    assert folders == ["0-fault=healthy", "1-fault=crack"]
    for name in folders:
        with gensig.open_dataset(tmp_path / name) as data:
            assert data.class_names == [name.partition("=")[2]]


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    return make(tmp_path_factory.mktemp("uninterrupted") / "data", *LONGER)


@pytest.mark.parametrize("kill", [signal.SIGINT, signal.SIGKILL])
def test_interrupted_set_is_never_whole_and_resume_ends_byte_equal(
    uninterrupted, tmp_path, kill
):
    out = tmp_path / "data"
    # A process begun in the background ignores the interrupt, and so would its children.
    interruptible = partial(signal.signal, signal.SIGINT, signal.default_int_handler)
    process = process_of(LONGER, out, preexec_fn=interruptible)
    deadline = time.monotonic() + 120.0
    while not any(out.glob("shards/shard-*.h5")):
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.002)
    process.send_signal(kill)
    _, said = process.communicate(timeout=60)
    if kill is signal.SIGINT:
        assert process.returncode == 130
        assert said.strip().splitlines()[-1].startswith("gensig: interrupted")
    interrupted = verify(out)
    assert not interrupted.complete
    assert interrupted.problems
    assert main(["verify", str(out)]) == 1
    assert main(["resume", "--quiet", "--workers", "1", str(out)]) == 0
    assert main(["verify", str(out)]) == 0
    assert contents(out) == contents(uninterrupted)


def test_a_full_disk_is_one_line_and_leaves_an_incomplete_set(tmp_path):
    limit = (resource.RLIMIT_FSIZE, (100_000, 100_000))
    out = tmp_path / "data"
    process = process_of(SMALL, out, preexec_fn=partial(resource.setrlimit, *limit))
    _, said = process.communicate(timeout=300)
    assert process.returncode == 1
    assert "Traceback" not in said
    assert "incomplete" in said
    assert not verify(out).complete
    assert json.loads((out / "manifest.json").read_text())["state"] != "complete"
