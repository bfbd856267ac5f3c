"""Data sets from the command line: the same bits however they are made, and nothing lost or faked on the way."""

import json
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

import gensig
from gensig.cli import main
from gensig.dataset.folder.verify import verify

SMALL = (
    "plan.n_records=8",
    "plan.n_units=4",
    "plan.classes=[healthy,crack,pitting,missing_tooth]",
    "operating.duration_s=0.04",
    "plan.vary={operating.speed_rpm:{distribution:uniform,low:1200,high:2400}}",
)


def make(out: Path, *overrides: str) -> Path:
    assert main(["generate", "--quiet", *SMALL, *overrides, f"out={out}"]) == 0
    return out


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One shard of eight records, made in this process."""
    return make(tmp_path_factory.mktemp("reference") / "data", "executor.n_workers=1")


def signals(folder: Path) -> np.ndarray:
    with gensig.open_dataset(folder) as data:
        return np.stack([data.signals(index) for index in range(data.n_records)])


@pytest.mark.parametrize("per_shard", [1, 3])
def test_bits_do_not_depend_on_shards_or_workers(
    reference: Path, tmp_path: Path, per_shard: int
) -> None:
    other = make(
        tmp_path / "data",
        f"dataset.records_per_shard={per_shard}",
        "executor.n_workers=2",
    )
    assert signals(other).tobytes() == signals(reference).tobytes()


def test_same_configuration_gives_the_same_bytes_and_another_seed_does_not(
    reference: Path, tmp_path: Path
) -> None:
    same = make(tmp_path / "same", "executor.n_workers=1")
    for name in ("plan.csv", "index.h5", "shards/shard-00000.h5"):
        assert (same / name).read_bytes() == (reference / name).read_bytes(), name
    other = make(tmp_path / "other", "executor.n_workers=1", "seed=1")
    assert not np.array_equal(signals(other), signals(reference))


def test_a_data_set_is_labelled_and_whole(reference: Path) -> None:
    result = verify(reference)
    assert result.complete
    assert result.problems == []
    with gensig.open_dataset(reference) as data:
        assert data.class_names == ["healthy", "crack", "pitting", "missing_tooth"]
        assert sorted(data.column("label")) == [0, 0, 1, 1, 2, 2, 3, 3]
        assert data.sampling_rate == 51200.0
        assert data.attributes["n_teeth_pinion"] == 23
        severity, label = data.column("severity"), data.column("label")
        assert np.all((severity == 0.0) == (label == 0))
        assert np.allclose(
            data.column("speed_rpm"), data.column("speed_set_rpm"), rtol=2e-3, atol=0.0
        )
        gears = data.column("fault_gear")
        assert set(gears[label > 0]) == {"pinion"}
    with h5py.File(reference / "index.h5") as index:
        assert index["acceleration"].shape == (8, 4, 2048)
        assert np.isfinite(index["acceleration"][...]).all()


def test_noise_floor_is_the_same_for_every_class_of_a_condition(
    reference: Path,
) -> None:
    with gensig.open_dataset(reference) as data:
        noise, condition = data.column("noise_power"), data.column("condition_id")
    for name in set(condition):
        mine = noise[condition == name]
        assert np.all(mine == mine[0])
    assert len({tuple(row) for row in noise}) > 1


def test_sham_plan_keeps_labels_without_faults(tmp_path: Path) -> None:
    folder = make(
        tmp_path / "data",
        "plan.sham=true",
        "sensing.snr_db=null",
        "dataset.records_per_shard=8",
    )
    with gensig.open_dataset(folder) as data:
        assert set(data.column("severity")) == {0.0}
        assert len(set(data.column("label"))) == 4
        level = {
            name: np.std(data.signals(i)[1])
            for i, name in enumerate(data.column("label_name"))
        }
    assert level["missing_tooth"] < 1.3 * level["healthy"]


def test_multirun_makes_one_data_set_each(tmp_path: Path) -> None:
    words = [
        "generate",
        "--quiet",
        "-m",
        "fault=healthy,crack",
        "plan.n_records=1",
        "operating.duration_s=0.02",
    ]
    assert main([*words, f"out={tmp_path / 'all'}"]) == 0
    folders = sorted(path.name for path in (tmp_path / "all").iterdir())
    assert folders == ["0-fault=healthy", "1-fault=crack"]
    for name, kind in zip(folders, ("healthy", "crack"), strict=True):
        with gensig.open_dataset(tmp_path / "all" / name) as data:
            assert data.class_names == [kind]


def test_python_interface_makes_and_opens(tmp_path: Path) -> None:
    words = (
        "plan.n_records=2",
        "plan.classes=[healthy,crack]",
        "operating.duration_s=0.02",
        "executor.n_workers=1",
    )
    with gensig.generate(*words, out=tmp_path / "data") as data:
        assert data.n_records == 2


LONGER = (
    *SMALL,
    "operating.duration_s=0.1",
    "dataset.records_per_shard=2",
    "executor.n_workers=1",
)


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make(tmp_path_factory.mktemp("uninterrupted") / "data", *LONGER)


@pytest.mark.parametrize("kill", [signal.SIGINT, signal.SIGKILL])
def test_interrupted_set_is_never_whole_and_resume_ends_byte_equal(
    uninterrupted: Path, tmp_path: Path, kill: signal.Signals
) -> None:
    out = tmp_path / "data"
    command = [sys.executable, "-m", "gensig.cli", "generate", *LONGER, f"out={out}"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    shards = out / "shards"
    deadline = time.monotonic() + 120.0
    while not (shards.is_dir() and any(shards.glob("shard-*.h5"))):
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
    for name in (
        "plan.csv",
        "index.h5",
        *(f"shards/{path.name}" for path in shards.iterdir()),
    ):
        assert (out / name).read_bytes() == (uninterrupted / name).read_bytes(), name


def test_disk_refusing_is_one_line_and_leaves_an_incomplete_set(tmp_path: Path) -> None:
    out = tmp_path / "data"

    def no_large_files() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

    result = subprocess.run(
        [
            sys.executable,
            "-m",
            "gensig.cli",
            "generate",
            *SMALL,
            "executor.n_workers=1",
            f"out={out}",
        ],
        preexec_fn=no_large_files,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "NUMBA_CACHE_DIR": os.environ.get("NUMBA_CACHE_DIR", "")},
    )
    assert result.returncode == 1
    assert "Traceback" not in result.stderr
    assert "incomplete" in result.stderr
    assert not verify(out).complete
    assert json.loads((out / "manifest.json").read_text())["state"] != "complete"
