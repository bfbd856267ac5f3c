"""The gain of a fault: a factor of what it adds to a record, and of nothing else."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from record_sets import run, simulated

import gensig
from gensig.errors import ConfigError
from gensig.plan.request import read_request
from gensig.record import inputs
from gensig.record.simulate import Record

SMALL = (
    "experiment=quickstart",
    "plan.n_records=4",
    "plan.n_units=1",
    "plan.n_reference=0",
    "operating.duration_s=0.05",
    "dataset.store_clean=true",
    "dataset.store_source=true",
)
# Path, drift and nuisances: all that lies between the bearings and the noise.
WHOLE_CHAIN = (
    "experiment=realistic",
    "plan.n_records=5",
    "plan.n_units=1",
    "operating.duration_s=0.05",
    "dataset.store_clean=true",
    "dataset.store_source=true",
)
SOURCE, CLEAN, NOISY = "acceleration_source", "acceleration_clean", "acceleration"


def records(*words: str, gain: float | None = None, sham: bool = False) -> list[Record]:
    if gain is not None:
        words = (*words, f"sensing.fault_gain={gain}")
    return simulated(read_request(list(words)).config, sham=sham)


def is_healthy(record: Record) -> bool:
    return record.values["label_name"] == "healthy"


def test_gain_one_simulates_no_twin_and_has_the_bits_of_no_gain(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = []
    whole = inputs.simulate_with_lead_in

    def counted(runs: list) -> list:
        asked.append(len(runs))
        return whole(runs)

    monkeypatch.setattr(inputs, "simulate_with_lead_in", counted)
    plain = records(*SMALL)
    one = records(*SMALL, gain=1.0)
    records(*SMALL, gain=2.0)
    n_faulty = sum(not is_healthy(record) for record in plain)
    assert asked[0] == asked[1] == asked[2] - n_faulty
    for record, other in zip(plain, one, strict=True):
        for name, values in record.signals.items():
            assert_array_equal(values, other.signals[name])
        np.testing.assert_equal(record.values, other.values)


@pytest.mark.parametrize("words", [SMALL, WHOLE_CHAIN], ids=["bearings", "whole chain"])
def test_what_a_fault_adds_grows_with_the_gain_and_nothing_else_does(
    words: tuple[str, ...],
) -> None:
    sound = records(*words, sham=True)
    plain, loud = records(*words), records(*words, gain=8.0)
    for without, as_is, record in zip(sound, plain, loud, strict=True):
        for name in (SOURCE, CLEAN):
            twin, faulty, louder = (
                each.signals[name].astype(float) for each in (without, as_is, record)
            )
            atol = 2e-5 * np.abs(louder).max()
            assert_allclose(louder - twin, 8.0 * (faulty - twin), rtol=0, atol=atol)
        assert_array_equal(as_is.signals["noise_power"], record.signals["noise_power"])
        for signal in (SOURCE, CLEAN, NOISY):
            alike = np.array_equal(as_is.signals[signal], record.signals[signal])
            assert alike == is_healthy(record)
        assert record.values["faults_json"] == as_is.values["faults_json"]
        assert record.values["speed_rpm"] == as_is.values["speed_rpm"]


def test_gain_zero_is_the_machine_without_its_faults() -> None:
    for twin, silent in zip(
        records(*SMALL, sham=True), records(*SMALL, gain=0.0), strict=True
    ):
        for name in (SOURCE, CLEAN, NOISY):
            assert_array_equal(twin.signals[name], silent.signals[name])


@pytest.mark.usefixtures("last_fails")
def test_a_record_whose_twin_fails_is_marked_so() -> None:
    made = records(*SMALL, gain=2.0)
    (failed,) = [each for each in made if each.values.get("status") == "failed"]
    assert not is_healthy(failed)
    assert np.isnan(failed.signals[NOISY]).all()


DRAWN = "plan.vary={sensing.fault_gain: {distribution: log_uniform, low: 1, high: 30}}"


def test_a_drawn_gain_is_that_of_the_condition_and_tells_no_class(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    small = (*SMALL, "plan.n_records=12", "plan.n_units=3", DRAWN)
    gensig.generate(*small, out=tmp_path / "set")
    run("verify", tmp_path / "set")
    run("reproduce", tmp_path / "set")
    assert "10 of 10 records have the same bits" in capsys.readouterr().out
    with gensig.open_dataset(tmp_path / "set") as data:
        gain = np.asarray(data.column("params/sensing.fault_gain"))
        condition = np.asarray(data.column("condition_id"))
        label = np.asarray(data.column("label"))
        signals = [data.signals(index) for index in range(data.n_records)]
    assert np.all((gain >= 1.0) & (gain <= 30.0))
    for name in np.unique(condition):
        of_condition = condition == name
        assert np.unique(gain[of_condition]).size == 1
        assert np.unique(label[of_condition]).size == np.unique(label).size
    assert np.unique(gain).size == np.unique(condition).size
    streamed = [record.signals[NOISY] for record in gensig.stream(*small)]
    for stored, fresh in zip(signals, streamed, strict=True):
        assert_array_equal(stored, fresh)


@pytest.mark.parametrize("gain", ["-1", "1001", ".nan", "loud", "null", "true"])
def test_a_gain_that_is_no_factor_is_refused_with_its_limits(gain: str) -> None:
    with pytest.raises(ConfigError, match=r"sensing\.fault_gain"):
        records(*SMALL, f"sensing.fault_gain={gain}")
