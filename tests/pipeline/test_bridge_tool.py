"""``python -m benchmarks.bridge``: its judges on made-up data, where what is true is known."""

import sys
from pathlib import Path

import numpy as np
import pytest
import torch

import gensig.dataset.reader
from benchmarks import _bridge_control as control
from benchmarks import _bridge_worlds as worlds
from diagnose.cli import main

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "unit" / "diagnose"))
from fake_dataset import FakeDataset

CLASSES = ("healthy", "crack", "pitting", "missing_tooth")
FAST = [
    "window_samples=1600", "stride_samples=1600", "epochs=3", "seeds=[0]", "n_bootstrap=20", "n_threads=1",
    "model.widths=[8,16]", "model.kernels=[32,5]", "model.strides=[8,4]", "protocols=[by_unit]",
    "shuffle_control=false", "baselines=false",
]  # fmt: skip


def world(seed=0, n_channels=1):
    made = FakeDataset(
        n_units=12, records_per_unit=8, duration=0.5, n_channels=n_channels, seed=seed
    )
    made.columns["gearbox_id"] = np.array(
        [f"g{index % 2}" for index in np.repeat(np.arange(12), 8)]
    )
    return made


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """A network of one channel trained on made-up records."""
    folder = tmp_path_factory.mktemp("bridge")
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gensig.dataset.reader, "open_dataset", lambda path: world())
        assert main(["train", "data=good", f"out={folder / 'out'}", *FAST]) == 0
    yield folder / "out" / "models" / "by_unit-seed0"
    torch.set_num_threads(before)


def test_scores_know_a_perfect_variant_from_chance():
    rng = np.random.default_rng(0)
    label, unit = np.tile(np.arange(4), 40), np.repeat(np.arange(16), 10)
    sure = np.log(np.where(np.arange(4) == label[:, None], 0.97, 0.01))
    random = np.stack([np.log(rng.dirichlet(np.ones(4), label.size)) for _ in range(2)])
    found = worlds.scores(
        worlds.Judged(
            label=label,
            unit=unit,
            log_probability={
                worlds.BEFORE: random,
                "same": random,
                "perfect": np.stack([sure, sure]),
            },
            n_windows=1,
        ),
        CLASSES,
    )
    assert found["perfect"]["balanced_accuracy"] == found["perfect"]["auroc"] == 1.0
    assert found["perfect"]["gain"] == pytest.approx(
        1.0 - found[worlds.BEFORE]["balanced_accuracy"]
    )
    assert found["perfect"]["gain_interval"][0] > 0.5
    assert found["same"]["gain_interval"] == [0.0, 0.0]
    low, high = found[worlds.BEFORE]["interval"]
    assert low < 0.25 < high


def test_every_variant_judges_units_that_no_adaptation_saw(model):
    other = world(seed=1)
    judged = worlds.judge_world(world(), other, [model])
    adapted_to = {record for record, _, _ in other.split("by_unit")["train"]}
    units = {other.columns["unit_id"][record] for record in adapted_to}
    assert units.isdisjoint(judged.unit)
    assert judged.label.size + len(adapted_to) == other.n_records
    names = [f"{kind}{method}, {scope}" for scope in worlds.SCOPES for method in ("adabn", "coral")
             for kind in ("", "naive ")]  # fmt: skip
    assert set(judged.log_probability) == {worlds.BEFORE, *names}
    for name, values in judged.log_probability.items():
        assert values.shape == (1, judged.label.size, 4)
        assert np.isfinite(values).all()
        assert (name == worlds.BEFORE) == np.array_equal(
            values, judged.log_probability[worlds.BEFORE]
        )


def recorded(folder, gain):
    """Both states of the same gear; the sensor of channel 0 is `gain` times as loud in the high band when broken."""
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
    assert (
        len({(row["channel"], row["load"], row["variant"]) for row in rows})
        == len(rows)
        == 2 * 3 * 3
    )
    assert {row["n_windows"] for row in rows} == {20}
    alike = [row for row in rows if row["channel"] == 1]
    assert sum(row["contains_zero"] or row["refuses_both"] for row in alike) >= 7
    unlike = [
        row for row in rows if row["channel"] == 0 and row["variant"] != control.BEFORE
    ]
    assert all(row["beyond_if_broken"] > 0.9 for row in unlike)
    assert np.mean([row["beyond_if_healthy"] for row in unlike]) < 0.5


def test_a_difference_is_told_from_none():
    rng = np.random.default_rng(0)
    noise = {state: rng.uniform(0.4, 0.6, 20) for state in control.STATES}
    told = {"healthy": np.zeros(20), "broken_tooth": np.ones(20)}
    row = control._row(noise, told, np.random.default_rng(1))
    assert row["contains_zero"]
    assert not row["refuses_both"]
    shifted = {**noise, "broken_tooth": noise["broken_tooth"] + 0.3}
    assert not control._row(shifted, told, np.random.default_rng(1))["contains_zero"]
    assert control._row(
        noise, {state: np.ones(20) for state in noise}, np.random.default_rng(1)
    )["refuses_both"]
