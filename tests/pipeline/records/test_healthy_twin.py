"""The healthy twin of every record: nothing in it depends on the fault, and its noise is its
own."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from small_sets import make

import gensig
from gensig.cli import main
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.simulate import forget_twins, simulate_records
from gensig.record.streams import Stream, stream

SWITCH = "dataset.store_healthy_twin=true"
SMALL = (
    "experiment=quickstart", "plan.n_records=8", "plan.n_units=2", "operating.duration_s=0.2", SWITCH,
    "dataset.store_clean=true",
)  # fmt: skip
REALISTIC = (
    "experiment=realistic", "plan.n_records=5", "plan.n_units=1", "operating.duration_s=0.1", SWITCH,
    "sensing.sensor.drift_scatter=0.1", "sensing.sensor.dropped_fraction=0.05", "dataset.store_clean=true",
)  # fmt: skip


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


@pytest.mark.parametrize("reference", ["healthy_twin", "record"])
def test_it_has_the_same_bits_whatever_the_fault(reference: str) -> None:
    """Severity zero changes no bit of it, so that it cannot tell the class; it does change the
    faulty records."""
    words = (*SMALL, f"sensing.snr_reference={reference}")
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


def test_nor_with_nuisances_drift_and_lost_samples() -> None:
    for faulty, sound in zip(
        records(*REALISTIC), records(*REALISTIC, sham=True), strict=True
    ):
        assert (
            faulty.signals["healthy_twin"].tobytes()
            == sound.signals["healthy_twin"].tobytes()
        )


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


@pytest.mark.parametrize("kind", ["npz", "parquet", "hdf5", "wav"])
def test_exports_of_it(stored: Path, tmp_path: Path, kind: str) -> None:
    pytest.importorskip("pyarrow")
    out = tmp_path / "out"
    assert main(["export", str(stored), "--to", kind, "--out", str(out)]) == 0
    if kind == "npz":
        arrays = np.load(next(tmp_path.rglob("*.npz")) if out.is_dir() else out)
        with gensig.open_dataset(stored) as data:
            np.testing.assert_array_equal(
                arrays["healthy_twin"][2], data.signals(2, name="healthy_twin")
            )


def test_a_switch_that_is_none_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (
        main(
            [
                "generate",
                "dataset.store_healthy_twin=perhaps",
                f"out={tmp_path / 'set'}",
            ]
        )
        != 0
    )
    assert (
        "dataset.store_healthy_twin = 'perhaps' must be true or false"
        in capsys.readouterr().err
    )


def test_its_draws_have_a_stream_of_their_own() -> None:

    values = [stream(0, cause, 3).random() for cause in Stream]
    assert len(set(values)) == len(Stream) == len(set(Stream))
