"""``python -m benchmarks.bridge``: its judges on made-up data, where what is true is known."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from benchmarks import _bridge_control as control
from benchmarks import _bridge_healthy as healthy
from benchmarks import _bridge_worlds as worlds

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "unit" / "diagnose"))
from fake_dataset import FakeDataset
from runs import NETWORK_ONLY, SMALL_CNN, model_of, train

CLASSES = ("healthy", "crack", "pitting", "missing_tooth")
FAST = (
    "window_samples=1600",
    "stride_samples=1600",
    "epochs=3",
    "seeds=[0]",
    "n_bootstrap=20",
    "n_threads=1",
    *SMALL_CNN,
    *NETWORK_ONLY[:-1],
)


def world(seed=0):
    made = FakeDataset(n_units=12, records_per_unit=8, duration=0.5, seed=seed)
    made.columns["gearbox_id"] = np.repeat(["g0", "g1"] * 6, 8)
    return made


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """A network of one channel trained on made-up records."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    out = train(tmp_path_factory.mktemp("bridge") / "out", world(), *FAST)
    yield Path(model_of(out))
    torch.set_num_threads(before)


def test_a_threshold_finds_its_share_of_the_healthy_records_it_was_fitted_on():
    rng = np.random.default_rng(0)
    label = np.repeat(np.arange(4), 40)
    said = np.log(rng.dirichlet(np.ones(4), label.size))
    shift = healthy.healthy_shift(said, label, 0)
    moved = said + shift * (np.arange(4) == 0)
    found = (moved.argmax(axis=1) == 0)[label == 0]
    assert 0.95 <= found.mean() <= 0.975
    answers = healthy.Answers(
        label=label,
        unit=np.tile(np.arange(16), 10),
        log_probability=said[None],
        shift=np.array([shift]),
    )
    plain = healthy.scores_of(answers, CLASSES)
    row = healthy.scores_of(answers, CLASSES, shifted=True)
    assert row["recall"]["healthy"] == found.mean()
    assert plain["interval"][0] < 0.25 < plain["interval"][1]
    assert row["n_units"] == 16


def test_other_classes_take_the_place_of_those_of_a_world(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(worlds, "kept", lambda folder, words: asked.append(words))
    worlds.open_world(tmp_path, worlds.SOURCE)
    worlds.open_world(tmp_path, worlds.SOURCE, ["healthy", "surface_damage"])
    assert asked[0] == list(worlds.SOURCE)
    assert asked[1] == [*worlds.SOURCE, "plan.classes=[healthy,surface_damage]"]


def test_all_records_of_a_world_are_judged_but_the_references(model):
    other = world(seed=1)
    reference = np.zeros(other.n_records, dtype=int)
    reference[::8] = 1
    other.columns["is_reference"] = reference
    answers = healthy.judge_of([model], world()).answers(other)
    assert answers.log_probability.shape == (1, (reference == 0).sum(), 4)
    assert np.isfinite(answers.log_probability).all()
    names = [CLASSES[label] for label in answers.label]
    assert names == list(other.columns["label_name"][reference == 0])
    row = healthy.scores_of(answers, CLASSES)
    assert row["n_units"] == 12
    sure = np.log(np.where(np.arange(4) == answers.label[:, None], 0.97, 0.01))
    perfect = replace(answers, log_probability=sure[None])
    assert healthy.scores_of(perfect, CLASSES)["balanced_accuracy"] == 1.0


def recorded(folder, gain):
    """Both states of the same gear; broken, channel 0 is `gain` times as loud in the high band."""
    rng = np.random.default_rng(0)
    arrays = {}
    for state in control.STATES:
        for load in control.LOADS:
            signal = rng.standard_normal((2, 32768))
            if state == "broken_tooth":
                signal[0] += gain * np.diff(signal[0], append=0.0)
            arrays[f"{state}__load{load}"] = signal.astype(np.float32)
    np.savez(folder / "negative_control_x.npz", **arrays)
    return folder / "negative_control_x.npz"


def test_the_control_has_a_row_for_every_case_and_forgives_a_sound_gear(
    model, tmp_path, monkeypatch
):
    monkeypatch.delenv(control.VARIABLE, raising=False)
    assert control.find_control() is None
    file = recorded(tmp_path, 20.0)
    monkeypatch.setenv(control.VARIABLE, str(tmp_path))
    assert control.find_control() == file
    rows = control.judge_control(file, [model])
    cases = {(row["channel"], row["load"]) for row in rows}
    assert len(cases) == len(rows) == 2 * 3
    assert {row["n_windows"] for row in rows} == {20}
    alike = [row for row in rows if row["channel"] == 1]
    assert sum(row["contains_zero"] or row["refuses_both"] for row in alike) >= 2
    unlike = [row for row in rows if row["channel"] == 0]
    assert all(row["beyond_if_broken"] > 0.9 for row in unlike)


def test_a_difference_is_told_from_none():
    rng = np.random.default_rng(0)
    noise = {state: rng.uniform(0.4, 0.6, 20) for state in control.STATES}
    shifted = {**noise, "broken_tooth": noise["broken_tooth"] + 0.3}
    one_state = {"healthy": np.zeros(20), "broken_tooth": np.ones(20)}
    both_states = {state: np.ones(20) for state in noise}

    def row(probability, beyond):
        return control._row(probability, beyond, np.random.default_rng(1))

    same = row(noise, one_state)
    assert same["contains_zero"]
    assert not same["refuses_both"]
    assert not row(shifted, one_state)["contains_zero"]
    assert row(noise, both_states)["refuses_both"]
