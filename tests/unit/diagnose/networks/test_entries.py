"""Answers with entries that are known, and networks that look at every channel by itself."""

import numpy as np
import pytest
import torch
from fake_dataset import FakeDataset
from numpy.testing import assert_allclose, assert_array_equal
from small_studies import run, study_of

from diagnose.data.packed_turns import tooth_counts
from diagnose.data.teeth import common_teeth, teeth_of_records, teeth_range
from diagnose.data.windows import all_segments
from diagnose.networks.registry import build_model, input_of
from diagnose.training.entries import KNOWN, UNKNOWN, entry_notes, predict_entries
from gensig.errors import ConfigError, DatasetError

TOOTH = ["model=tooth", "model.samples_per_tooth=16", "model.widths=[8,4]"]


@pytest.fixture(scope="module")
def dataset():
    """Machines of two designs, whose records say where they start."""
    made = FakeDataset(n_units=8, records_per_unit=4, n_channels=2, duration=0.2)
    unit = np.arange(made.n_records) // 4
    made.columns["n_teeth_pinion"] = np.where(unit % 2, 17, 23)
    made.columns["n_teeth_wheel"] = np.where(unit % 2, 31, 84)
    rng = np.random.default_rng(0)
    made.columns["start_phase"] = rng.random(made.n_records)
    del made.attributes["n_teeth_pinion"], made.attributes["n_teeth_wheel"]
    return made


def loaded(dataset, *words):
    """Network with random weights and the inputs of all records."""
    task, settings = study_of(dataset, *TOOTH, *words)
    inputs = input_of(settings.model)
    windows = inputs.load(task, all_segments(task))
    torch.manual_seed(0)
    n_channels = windows.signals[0].shape[0]
    model = build_model(settings.model, n_channels=n_channels, n_classes=4)
    return model.eval(), windows


def test_records_of_several_designs_say_their_teeth(dataset):
    _, windows = loaded(dataset)
    expected = teeth_of_records(dataset)[windows.record]
    assert_array_equal([tooth_counts(signal) for signal in windows.signals], expected)
    assert common_teeth(dataset) is None
    assert teeth_range(dataset) == ((17, 23), (31, 84))
    lengths = {signal.shape[-1] for signal in windows.signals}
    assert len(lengths) == 2
    assert windows.cut(np.array([0, 4])).shape[-1] == max(lengths)
    assert windows.cut(np.array([4])).shape[-1] == min(lengths)


def test_a_design_alone_is_common_and_has_no_range():
    single = FakeDataset(n_units=2)
    assert common_teeth(single) == (23, 84)
    assert teeth_range(single) is None
    del single.attributes["n_teeth_wheel"]
    assert common_teeth(single) is None
    with pytest.raises(DatasetError, match="n_teeth_wheel"):
        teeth_of_records(single)


def test_what_fills_a_window_up_is_no_vibration(dataset):
    _, windows = loaded(dataset)
    alone = windows.cut(np.array([4]))
    together = windows.cut(np.array([0, 4]))[1:]
    assert_array_equal(together[..., : alone.shape[-1]], alone)
    assert not together[..., alone.shape[-1] :].any()


def test_a_network_of_one_pair_refuses_several(dataset):
    with pytest.raises(ConfigError, match="model=tooth reads any"):
        study_of(dataset, "model=order")


def test_the_estimated_entry_is_one_of_the_places(dataset):
    model, windows = loaded(dataset)
    answers = predict_entries(model, windows)
    assert answers[KNOWN].shape == answers[UNKNOWN].shape == (32, 4)
    assert 0 <= answers["median_error"] <= 0.5
    cut = torch.from_numpy(windows.cut(np.arange(32)))
    with torch.inference_mode():
        guessed = model.entries(cut).numpy() / 16
        windows.targets["entry"][:] = guessed
        of_guess = predict_entries(model, windows)
        estimated = torch.log_softmax(model(cut), dim=1)
    assert of_guess["median_error"] == 0
    assert_allclose(of_guess[KNOWN], estimated, rtol=1e-4, atol=1e-5)


def test_without_the_start_nothing_is_known(dataset):
    model, windows = loaded(dataset)
    windows.targets["entry"][3] = np.nan
    assert predict_entries(model, windows) == {}


def test_a_study_prints_what_the_entry_is_worth(dataset):
    task, settings = study_of(dataset, *TOOTH, "epochs=1")
    (prediction,) = run(task, settings)
    assert {KNOWN, UNKNOWN, "median_error"} <= set(prediction.further)
    scored = {"mean": 0.9, "low": 0.8, "high": 1.0}
    entry = {KNOWN: scored, UNKNOWN: scored, "median_error": 0.01}
    ((title, text),) = entry_notes({"new_machine": {"entry": entry}, "by_unit": {}})
    assert title == "new_machine, entry of a tooth"
    assert "off by 1.0% of a passage" in text
    assert "0.90 [0.80, 1.00]" in text


def test_each_channel_is_an_input_of_its_own(dataset):
    model, windows = loaded(dataset, "model.each_channel=true")
    whole, together = loaded(dataset)[1], windows
    assert len(together) == 2 * len(whole)
    assert_array_equal(together.record, np.repeat(whole.record, 2))
    assert {len(signal) for signal in together.signals} == {1}
    n_deviations = 2 + 16 * (
        23 + 84 + 1
    )  # of which channels do not depend on each other
    for channel in range(2):
        alone = together.signals[channel][0, :n_deviations]
        assert_array_equal(alone, whole.signals[0][channel, :n_deviations])
    assert together.levels.shape[1] * 2 == whole.levels.shape[1]
    with torch.inference_mode():
        assert model(torch.from_numpy(windows.cut(np.arange(2)))).shape == (2, 4)
