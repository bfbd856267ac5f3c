"""Outcomes of finished jobs: the same bits back, and nothing that is damaged or stale."""

from __future__ import annotations

from dataclasses import asdict, replace
from types import SimpleNamespace

import numpy as np
import pytest
from fake_dataset import FakeDataset
from small_studies import study_of

from diagnose.networks.domain import Domain
from diagnose.scoring.hours import LifeFacts
from diagnose.scoring.predictions import Prediction, Rows
from diagnose.studies.jobs import Job, run_jobs
from diagnose.studies.kept_jobs import (
    KeptJobs,
    keep_outcomes,
    kept_outcomes,
    outcomes_digest,
)
from gensig.errors import DatasetError

JOBS = [Job(protocols=("by_unit",), seed=seed) for seed in (0, 1, 2)]


def outcome(seed):
    """A prediction with everything that can be in one, in every layout."""
    rng = np.random.default_rng(seed)
    scores = np.asfortranarray(rng.normal(size=(4, 3)))
    scores[0, 0] = -np.inf
    rows = Rows(record=np.arange(4), answers=scores[:, ::-1])
    weights = {
        "a": rng.normal(size=(2, 3)).astype(np.float32),
        "n": np.array(7, dtype=np.int64),
        "none": np.zeros((0, 2), dtype=np.float16),
    }
    return Prediction(
        protocol="by_unit",
        method="méthode \u202e",
        seed=seed,
        record=np.arange(4, dtype=np.int32),
        answers=scores,
        detail="",
        parts={"validation": rows},
        further={
            "severity": np.array([np.nan, 1e-310]),
            "odd": np.array([True, False]),
        },
        n_followed=None,
        hours=LifeFacts(
            method="cnn",
            early_life_h=1 / 3,
            half_width_h=0.1,
            coverage=0.8,
            n_calibration_lives=3,
        ),
        weights=weights,
        domain=Domain(
            levels=np.ones((2, 2), np.float32), threshold=0.1, n_validation_windows=3
        ),
        best_epoch=2,
        validation_loss=(0.1, float("nan"), 1 / 3, np.float64(0.3)),
        temperature=float("inf"),
    )


def same(first, second):
    """Equal values, types and kinds of numbers."""
    if isinstance(first, np.ndarray | np.generic):
        return (
            type(first) is type(second)
            and first.dtype == second.dtype
            and first.shape == second.shape
            and np.asarray(first).tobytes() == np.asarray(second).tobytes()
        )
    if isinstance(first, dict):
        return list(first) == list(second) and all(
            same(first[name], second[name]) for name in first
        )
    if isinstance(first, tuple | list):
        pairs = zip(first, second, strict=True)
        return type(first) is type(second) and all(same(*pair) for pair in pairs)
    return type(first) is type(second) and repr(first) == repr(second)


@pytest.fixture
def kept(tmp_path):
    return KeptJobs(folder=tmp_path, digest="d")


def test_what_is_kept_comes_back_bit_for_bit(kept):
    (back,) = keep_outcomes(kept, JOBS[1], [outcome(1)])
    assert same(asdict(back), asdict(outcome(1)))
    assert not same(asdict(back), asdict(outcome(2)))
    assert not same({"a": 1}, {"a": 1.0})
    # a second time it is the same in memory too: what is summed is summed in the same order
    (again,) = keep_outcomes(kept, JOBS[1], [back])
    assert again.answers.strides == back.answers.strides
    assert kept_outcomes(kept, JOBS[0]) is None


def test_no_object_is_kept(kept):
    for value in (np.array([{}], dtype=object), {1, 2}, lambda: 1):
        odd = replace(outcome(0), further={"a": value})
        with pytest.raises(TypeError, match="cannot be kept"):
            keep_outcomes(kept, JOBS[0], [odd])
    assert list(kept.folder.iterdir()) == []


def change(path, at):
    content = bytearray(path.read_bytes())
    content[at] ^= 1
    path.write_bytes(content)


def exchange(first, second):
    """Give one job the files of another."""
    for suffix in (".json", ".npz"):
        content = first.with_suffix(suffix).read_bytes()
        second.with_suffix(suffix).write_bytes(content)


def link(path):
    path.rename(path.with_suffix(".elsewhere"))
    path.symlink_to(path.with_suffix(".elsewhere"))


HARMS = {
    "none": lambda first, second: None,
    "arrays": lambda first, second: change(second.with_suffix(".npz"), 300),
    "text": lambda first, second: change(second.with_suffix(".json"), 40),
    "lost arrays": lambda first, second: second.with_suffix(".npz").unlink(),
    "lost text": lambda first, second: second.with_suffix(".json").unlink(),
    "no text": lambda first, second: second.with_suffix(".json").write_text("[]"),
    "longer": lambda first, second: second.with_suffix(".npz").write_bytes(b"0" * 9999),
    "link": lambda first, second: link(second.with_suffix(".npz")),
    "of another job": exchange,
}


@pytest.mark.parametrize("harm", HARMS)
def test_a_damaged_piece_is_made_again(kept, harm):
    begun = []

    def run_job(job):
        begun.append(job.seed)
        return [outcome(job.seed)]

    study = SimpleNamespace(run_job=run_job)

    def outcomes():
        found = run_jobs(study, JOBS, n_workers=1, on_done=lambda _: None, kept=kept)
        return [asdict(each) for each in found]

    first = outcomes()
    HARMS[harm](*(kept.folder / kept.name(job) for job in JOBS[:2]))
    assert same(outcomes(), first)
    assert begun == [0, 1, 2] + [1] * (harm != "none")


def faster(dataset):
    dataset.columns["speed_rpm"] = dataset.columns["speed_rpm"] + 1.0


def split_otherwise(dataset):
    subsets = dataset.split("by_unit")
    subsets["train"] = subsets["train"][1:]
    dataset.split = lambda _: subsets


@pytest.mark.parametrize(
    ("words", "harm", "is_same"),
    [
        ((), None, True),
        (("n_threads=7", "n_bootstrap=51"), None, True),
        (("learning_rate=0.01",), None, False),
        (("normalise=none",), None, False),
        ((), faster, False),
        ((), split_otherwise, False),
    ],
)
def test_a_piece_belongs_to_its_data_splits_and_settings(words, harm, is_same):
    digest = outcomes_digest(*study_of(FakeDataset()), ["by_unit"])
    dataset = FakeDataset()
    if harm is not None:
        harm(dataset)
    other = outcomes_digest(*study_of(dataset, *words), ["by_unit"])
    assert (other == digest) == is_same


def test_a_piece_belongs_to_its_version_and_its_shards(monkeypatch):
    from diagnose.studies import kept_jobs

    task, settings = study_of(FakeDataset())
    digest = outcomes_digest(task, settings, ["by_unit"])
    with monkeypatch.context() as patch:
        patch.setattr("diagnose.studies.result_files.__version__", "0.0.1")
        assert outcomes_digest(task, settings, ["by_unit"]) != digest
    with monkeypatch.context() as patch:
        patch.setattr(kept_jobs, "_shards", lambda _: ["other signals"])
        assert outcomes_digest(task, settings, ["by_unit"]) != digest
    assert outcomes_digest(task, settings, ["by_unit"]) == digest


def test_a_disk_that_gives_something_else_back_is_one_line(kept, monkeypatch):
    from diagnose.studies import kept_jobs

    monkeypatch.setattr(kept_jobs, "write_bytes", lambda path, raw: None)
    with pytest.raises(DatasetError, match="cannot be read back"):
        keep_outcomes(kept, JOBS[0], [outcome(0)])
