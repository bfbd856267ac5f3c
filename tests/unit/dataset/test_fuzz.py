"""Files from strangers: 144 of the mutants of ``python -m benchmarks.fuzz_campaign``, none of which
may do harm."""

import collections
import os
import time

import h5py
import pytest
from dataset_samples import build, make_plan

from benchmarks import _fuzz_judge
from benchmarks._damaged_folders import SECRET, STRUCTURES, Mutant
from benchmarks._fuzz_judge import verdicts
from gensig.dataset.folder.inspection import inspect

# Every forbidden structure and every forgery of a manifest once; the campaign tries thousands.
N_MUTANTS = 144


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    plan = make_plan(n_records=4, records_per_shard=2, n_units=2, n_classes=2)
    return build(tmp_path_factory.mktemp("tiny") / "set", plan)


@pytest.fixture(scope="module")
def found(tiny, tmp_path_factory):
    """Verdicts of two processes, which begin with what is imported here."""
    scratch = tmp_path_factory.mktemp("mutants")
    halves = (range(N_MUTANTS // 2), range(N_MUTANTS // 2, N_MUTANTS))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_fuzz_judge, "METHOD", "fork")
        parts = [verdicts(tiny, scratch, seeds) for seeds in halves]
        return [verdict for pair in zip(*parts, strict=True) for verdict in pair]


def test_no_mutant_does_harm(found):
    assert len(found) == N_MUTANTS
    harmful = [verdict for verdict in found if verdict.fault]
    assert [
        f"{verdict.seed} ({verdict.kind}): {verdict.fault}" for verdict in harmful
    ] == []


def test_every_forbidden_structure_was_tried_and_noticed(found):
    noticed = collections.Counter(verdict.kind for verdict in found if verdict.noticed)
    assert all(noticed[name] for name in STRUCTURES)


def _no_mutation(_folder, _seed):
    return Mutant(kind="nothing", refused=True)


def _die(_folder):
    os._exit(3)


def _hang(_folder):
    time.sleep(60)


def _crash(_folder):
    raise KeyError("x")


@pytest.mark.parametrize(
    ("reader", "message"),
    [
        (_die, "died"),
        (_hang, "hung for 1 s"),
        (_crash, "read: KeyError"),
        (None, "must be refused"),
    ],
)
def test_the_judge_sees_harm(tiny, tmp_path, reader, message, monkeypatch):
    """A reader that dies, hangs, stumbles or takes everything is found, and the next mutant is
    tried all the same."""
    if reader is _hang:
        monkeypatch.setattr(_fuzz_judge, "TIME_LIMIT", 1.0)
    monkeypatch.setattr(_fuzz_judge, "mutate", _no_mutation)
    monkeypatch.setattr(
        _fuzz_judge, "METHOD", "fork"
    )  # the child must know the changes made here
    if reader is not None:
        monkeypatch.setattr(_fuzz_judge, "read_all", reader)
    result = list(verdicts(tiny, tmp_path, range(2)))
    assert [verdict.seed for verdict in result] == [0, 1]
    assert all(message in verdict.fault for verdict in result)


def test_inspect_reads_no_other_file(tmp_path):
    """A value small enough to be shown may lie in another file, or be declared with a chunk of any
    size."""
    (tmp_path / "secret.bin").write_bytes(SECRET)
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset(
            "stolen", (1,), "i8", external=[(str(tmp_path / "secret.bin"), 0, 8)]
        )
        layout = h5py.VirtualLayout((1,), "i8")
        layout[...] = h5py.VirtualSource(str(tmp_path / "other.h5"), "x", (1,))
        file.create_virtual_dataset("seen", layout)
        file.create_dataset(
            "wide", (1,), "i8", maxshape=(None,), chunks=(10**8,), compression="gzip"
        )
    text = inspect(path)
    assert str(int.from_bytes(SECRET[:8], "little")) not in text
    assert "value" not in text
    assert "data in another file" in text
