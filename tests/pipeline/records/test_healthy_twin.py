"""Healthy twins of records: independent of the fault, with separate noise."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from record_sets import rows_of, run, simulated
from refusals import refused
from small_sets import make

import gensig
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.streams import Stream, stream

SWITCH = "dataset.store_healthy_twin=true"
SMALL = (
    "experiment=quickstart",
    "plan.n_records=8",
    "plan.n_units=2",
    "operating.duration_s=0.2",
    SWITCH,
    "dataset.store_clean=true",
)
REALISTIC = (
    "experiment=realistic",
    "plan.n_records=5",
    "plan.n_units=1",
    "operating.duration_s=0.1",
    SWITCH,
    "sensing.sensor.drift_scatter=0.1",
    "sensing.sensor.dropped_fraction=0.05",
    "dataset.store_clean=true",
    "dataset.store_tacho=true",
    "dataset.store_encoder=true",
)


def records(*overrides: str, sham: bool = False) -> list:
    return simulated(read_request(list(overrides)).config, sham=sham)


@pytest.fixture(scope="module")
def small() -> list:
    return records(*SMALL)


@pytest.fixture(scope="module")
def realistic() -> list:
    return records(*REALISTIC)


@pytest.mark.parametrize(
    "words",
    [SMALL, (*SMALL, "sensing.snr_reference=record"), REALISTIC],
    ids=["healthy_twin", "record", "nuisances, drift and lost samples"],
)
def test_it_has_the_same_bits_whatever_the_fault(words: tuple[str, ...]) -> None:
    """Severity zero changes no bit of it, so that it cannot tell the class; it does change the
    faulty records."""
    for faulty, sound in zip(records(*words), records(*words, sham=True), strict=True):
        twins = [record.signals["healthy_twin"] for record in (faulty, sound)]
        assert_array_equal(*twins)
        own = [record.signals["acceleration"] for record in (faulty, sound)]
        is_faulty = faulty.values["label_name"] != "healthy"
        assert np.array_equal(*own) != is_faulty


def test_its_noise_is_as_loud_and_independent(small: list) -> None:
    for record in small:
        if record.values["label_name"] != "healthy":
            continue
        clean = record.signals["acceleration_clean"].astype(float)
        power = record.signals["noise_power"]
        noises = [
            record.signals[name] - clean for name in ("acceleration", "healthy_twin")
        ]
        for noise in noises:
            assert_allclose(noise.var(axis=1), power, rtol=0.05)
        product = np.mean(noises[0] * noises[1], axis=1)
        assert np.abs(product / power).max() < 0.05


def test_drift_and_lost_samples_are_its_own() -> None:
    for record in records(*REALISTIC, "sensing.snr_db=null"):
        if record.values["label_name"] == "healthy":
            signals = record.signals
            assert not np.array_equal(signals["acceleration"], signals["healthy_twin"])


def test_with_the_source_stored_it_is_known_at_the_bearings() -> None:
    """Free of noise, so that the record at the bearings less it is what the fault adds."""
    source = "dataset.store_source=true"
    faulty, sound = records(*REALISTIC, source), records(*REALISTIC, source, sham=True)
    for record, without in zip(faulty, sound, strict=True):
        twin = record.signals["healthy_twin_source"]
        assert_array_equal(twin, without.signals["acceleration_source"])
        is_sound = record.values["label_name"] == "healthy"
        assert np.array_equal(twin, record.signals["acceleration_source"]) == is_sound


def test_a_record_and_its_twin_are_the_same_alone_and_among_others(
    realistic: list,
) -> None:
    config = read_request(list(REALISTIC)).config
    rows = rows_of(config)
    for index in (3, 0):
        (alone,) = simulated(config, [rows[index]])
        assert {"tacho", "encoder_angle", "healthy_twin"} <= set(alone.signals)
        for name, values in alone.signals.items():
            assert_array_equal(values, realistic[index].signals[name])
        np.testing.assert_equal(alone.values, realistic[index].values)


@pytest.mark.usefixtures("last_fails")
def test_a_twin_that_does_not_stay_finite_fails_its_record() -> None:
    made = records(*SMALL)
    (failed,) = [record for record in made if record.values.get("status") == "failed"]
    assert failed.values["label_name"] != "healthy"
    assert failed.values["status_reason"] == "the motion grew without bound"
    for name in ("acceleration", "healthy_twin"):
        assert np.isnan(failed.signals[name]).all()


def test_a_set_with_twins_comes_again_and_has_the_other_bits_of_a_set_without(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sample_type = "dataset.sample_type=int16"
    stored = make(tmp_path / "stored", SWITCH, sample_type)
    plain = make(tmp_path / "plain", sample_type)
    run("verify", stored)
    run("reproduce", stored)
    assert "6 of 6 records have the same bits" in capsys.readouterr().out
    with gensig.open_dataset(stored) as data, gensig.open_dataset(plain) as other:
        assert data.signals(3, name="healthy_twin").shape == data.signals(3).shape
        assert "healthy_twin" not in other.signal_names
        for index in range(data.n_records):
            assert_array_equal(data.signals(index), other.signals(index))


def test_its_draws_have_a_stream_of_their_own() -> None:
    values = [stream(0, cause, 3).random() for cause in Stream]
    assert len(set(values)) == len(Stream) == len(set(Stream))


@pytest.mark.parametrize("name", ["healthy_twin", "mesh_state", "tacho"])
def test_a_switch_is_true_or_false(name: str) -> None:
    with refused(f"dataset.store_{name} = 1 must be true or"):
        make_plan(read_request([f"dataset.store_{name}=1"]).config)
