"""The worked example of an executor: chosen as any other, with the bytes of any other."""

import shutil
from pathlib import Path

import pytest
from executor_example import read_serial

from gensig.cli import main
from gensig.execution.registry import EXECUTORS

WORDS = [
    "fault=healthy",
    "plan.n_records=4",
    "plan.n_units=2",
    "operating.duration_s=0.02",
    "dataset.records_per_shard=2",
    "executor.n_workers=1",
]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of options with the executor, which the registry has during the test."""
    monkeypatch.setitem(EXECUTORS, "serial", read_serial)
    (tmp_path / "mine" / "executor").mkdir(parents=True)
    shutil.copy(Path(__file__).with_name("serial.yaml"), tmp_path / "mine" / "executor")
    return tmp_path


def contents(out: Path) -> dict[str, bytes]:
    return {
        path.name: path.read_bytes()
        for path in [out / "plan.csv", *sorted((out / "shards").glob("*.h5"))]
    }


def test_it_makes_the_same_bytes(folder: Path) -> None:
    serial, local = folder / "serial", folder / "local"
    own = ["--config-dir", str(folder / "mine"), "executor=serial"]
    assert main(["generate", *WORDS, *own, f"out={serial}"]) == 0
    assert main(["generate", *WORDS, f"out={local}"]) == 0
    assert len(contents(serial)) == 3
    assert contents(serial) == contents(local)


def test_an_unknown_one_is_refused(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    monkeypatch.delitem(EXECUTORS, "serial")
    own = ["--config-dir", str(folder / "mine"), "executor=serial"]
    assert main(["generate", *WORDS, *own, f"out={folder / 'none'}"]) == 2
    assert (
        "executor.kind = 'serial'; there is local, dask, slurm"
        in capsys.readouterr().err
    )
