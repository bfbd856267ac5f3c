"""Healthy twins of records: independent of the fault, with separate noise."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from small_sets import make

import gensig
from gensig.cli import main
from gensig.errors import ConfigError
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.simulate import forget_twins, simulate_records
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
)


def records(*overrides: str, sham: bool = False) -> list:
    config = read_request(list(overrides)).config
    plan = make_plan(config)
    config = config.with_keys("plan", sham=sham)
    forget_twins()
    return simulate_records(
        config, [plan.record(index) for index in range(plan.n_records)]
    )


@pytest.fixture(scope="module")
def found() -> list:
    return records(*SMALL)


@pytest.mark.parametrize(
    "words",
    [SMALL, (*SMALL, "sensing.snr_reference=record"), REALISTIC],
    ids=["healthy_twin", "record", "nuisances, drift and lost samples"],
)
def test_it_has_the_same_bits_whatever_the_fault(words: tuple[str, ...]) -> None:
    """Severity zero changes no bit of it, so that it cannot tell the class; it does change the
    faulty records."""
    for faulty, sound in zip(records(*words), records(*words, sham=True), strict=True):
        assert (
            faulty.signals["healthy_twin"].tobytes()
            == sound.signals["healthy_twin"].tobytes()
        )
        changed = (
            faulty.signals["acceleration"].tobytes()
            != sound.signals["acceleration"].tobytes()
        )
        assert changed == (faulty.values["label_name"] != "healthy")


def test_its_noise_is_as_loud_and_has_nothing_to_do_with_that_of_the_record(
    found: list,
) -> None:
    for record in found:
        if record.values["label_name"] != "healthy":
            continue
        clean = record.signals["acceleration_clean"].astype(float)
        own, other = (
            record.signals[name] - clean for name in ("acceleration", "healthy_twin")
        )
        for noise in (own, other):
            assert_allclose(
                noise.var(axis=1), record.signals["noise_power"], rtol=0.05, atol=0
            )
        assert (
            np.abs(np.mean(own * other, axis=1) / record.signals["noise_power"]).max()
            < 0.05
        )


def test_a_healthy_record_has_one_that_differs_by_noise_alone(found: list) -> None:
    """The difference of a healthy record and its twin holds twice the noise; that of a missing
    tooth holds more."""
    ratio = {
        record.values["label_name"]: np.var(
            record.signals["acceleration"].astype(float)
            - record.signals["healthy_twin"],
            axis=1,
        )
        / record.signals["noise_power"]
        for record in found
    }
    assert_allclose(ratio["healthy"], 2.0, rtol=0.05, atol=0)
    assert (ratio["missing_tooth"] > 2.2).all()


def test_drift_and_lost_samples_are_its_own() -> None:
    for record in records(*REALISTIC, "sensing.snr_db=null"):
        if record.values["label_name"] == "healthy":
            assert (
                record.signals["acceleration"].tobytes()
                != record.signals["healthy_twin"].tobytes()
            )


def test_a_record_has_the_same_twin_alone_and_among_others(found: list) -> None:
    config = read_request(list(SMALL)).config
    plan = make_plan(config)
    for index in (5, 0):
        forget_twins()
        (alone,) = simulate_records(config, [plan.record(index)])
        for name, values in alone.signals.items():
            assert values.tobytes() == found[index].signals[name].tobytes()


def test_a_twin_that_does_not_stay_finite_fails_its_record(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from gensig.errors import SimulationError
    from gensig.record import inputs as module

    whole = module.simulate_with_lead_in

    def last_fails(runs: list) -> list:
        return [*whole(runs)[:-1], SimulationError("the motion grew without bound")]

    monkeypatch.setattr(module, "simulate_with_lead_in", last_fails)
    found = records(*SMALL)
    failed = [record for record in found if record.values.get("status") == "failed"]
    assert len(failed) == 1
    assert failed[0].values["label_name"] != "healthy"
    assert failed[0].values["status_reason"] == "the motion grew without bound"
    assert all(
        np.isnan(failed[0].signals[name]).all()
        for name in ("acceleration", "healthy_twin")
    )


@pytest.fixture(scope="module", params=["float32", "int16"])
def stored(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    return make(
        tmp_path_factory.mktemp("stored") / "set",
        SWITCH,
        f"dataset.sample_type={request.param}",
    )


def test_a_set_with_twins_is_whole_and_is_made_again(
    stored: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["verify", str(stored)]) == 0
    assert main(["reproduce", str(stored)]) == 0
    assert "6 of 6 records have the same bits" in capsys.readouterr().out
    with gensig.open_dataset(stored) as data:
        assert data.signals(3, name="healthy_twin").shape == data.signals(3).shape


def test_the_other_bits_are_those_of_a_set_without(
    stored: Path, tmp_path: Path
) -> None:
    with gensig.open_dataset(stored) as data:
        plain = make(
            tmp_path / "plain",
            f"dataset.sample_type={data.sample_type}",
            "dataset.records_per_shard=1",
        )
        with gensig.open_dataset(plain) as other:
            assert "healthy_twin" not in other.signal_names
            for index in range(data.n_records):
                assert data.signals(index).tobytes() == other.signals(index).tobytes()
            assert np.isnan(data.column("detectability")).all()


def test_its_draws_have_a_stream_of_their_own() -> None:

    values = [stream(0, cause, 3).random() for cause in Stream]
    assert len(set(values)) == len(Stream) == len(set(Stream))


@pytest.mark.parametrize("key", ["store_healthy_twin", "store_mesh_state"])
def test_a_switch_is_true_or_false(key: str) -> None:
    with pytest.raises(ConfigError, match=f"dataset.{key} = 'perhaps' must be true or"):
        make_plan(read_request([f"dataset.{key}=perhaps"]).config)
