"""Prediction of a data set: counts, and bytes near those that are made."""

import functools
import re

import pytest

import gensig
from gensig.errors import SimulationError
from gensig.plan.make import varied_keys
from gensig.plan.request import read_request
from gensig.production.prediction import FailedRecordsWarning, predict
from gensig.production.shard_writing import block_length
from gensig.record import inputs as records
from gensig.record.inputs import InputReader
from gensig.systems.registry import read_system

CLASSES = "plan.classes=[healthy,crack,pitting,missing_tooth]"
SPEEDS = "plan.vary={operating.speed_rpm: {distribution: choice, values: [1200, 1800, 2400]}}"
SETS = {
    "many shards": (
        "plan.n_records=20",
        CLASSES,
        "dataset.records_per_shard=2",
        "operating.duration_s=0.05",
    ),
    "counts, compressed": (
        "plan.n_records=8",
        CLASSES,
        "operating.duration_s=0.25",
        "dataset.sample_type=int16",
        "dataset.compression=gzip",
        "dataset.store_clean=true",
        "dataset.store_shaft_angle=true",
    ),
    "a grid": (
        "plan.design=grid",
        "plan.n_records=null",
        "plan.n_units=2",
        SPEEDS,
        CLASSES,
        "operating.duration_s=0.05",
    ),
}


@functools.cache
def foretold(name):
    return predict(
        InputReader(read_request([*SETS[name], "executor.n_workers=1"]).config)
    )


@pytest.mark.parametrize("name", SETS)
def test_bytes_are_within_a_factor_of_one_and_a_half(name, tmp_path):
    expected = int(foretold(name)["bytes"].split()[0].replace(",", ""))
    gensig.generate(*SETS[name], "executor.n_workers=1", out=tmp_path / "data").close()
    made = sum(
        path.stat().st_size for path in (tmp_path / "data").rglob("*") if path.is_file()
    )
    assert made > 700_000
    assert 1 / 1.5 < expected / made < 1.5


def test_what_a_grid_holds_is_told():
    told = foretold("a grid")
    assert told["records"] == "24"
    assert told["classes"].count(" 6") == 4
    assert (told["machines"], told["conditions"], told["repeats"]) == ("2", "6", "1")
    assert (told["gears"], told["gearboxes"]) == ("2 set(s)", "1")
    assert told["design"].startswith(
        "grid of operating.speed_rpm 3; drawn: crack.tooth, crack.crack_depth_mm"
    )
    line = re.split(" +", told["varies"].splitlines()[0], maxsplit=1)
    assert line == ["operating.speed_rpm", "1200, 1800, 2400"]


def test_every_varied_key_has_a_line_with_its_range():
    words = ["experiment=many_machines", "fault.crack_depth_mm=1"]
    config = read_request(words).config
    varied = varied_keys(InputReader(config))
    assert varied["gear.pinion.n_teeth"] == "18 to 60, whole numbers"
    assert varied["operating.speed_rpm"] == "400 to 3600, logarithmic"
    assert varied["operating.torque_nm"] == (
        "10 to 50, logarithmic of unit load, N/mm2"
    )
    assert varied["sensing.snr_db"] == "10 to 30"
    assert "crack.crack_depth_mm" not in varied  # which is given
    assert varied["fault_gear"].startswith("pinion, wheel; ")
    assert set(config["plan"]["vary"]) < set(varied)


def test_faults_of_lives_grow():
    config = read_request(["experiment=run_to_failure"]).config
    varied = varied_keys(InputReader(config))
    grown = {name for name, text in varied.items() if text == "grows along each life"}
    assert grown == set(config["classes"])
    assert set(varied) - grown == set(config["plan"]["vary"])


@pytest.mark.parametrize(
    ("duration", "n_records"), [(1, 16), (8, 10), (9, 9), (1000, 8)]
)
def test_a_block_is_as_many_records_as_128_mebibytes_hold(duration, n_records):
    """From 8, one for each lane, to 16; a second of four channels has 1.6 MB."""
    words = [f"operating.duration_s={duration}"]
    assert block_length(read_system(read_request(words).config)) == n_records


def test_records_that_fail_while_they_are_timed_are_told(monkeypatch):
    whole = records.simulate_with_lead_in
    monkeypatch.setattr(
        records,
        "simulate_with_lead_in",
        lambda runs: [*whole(runs)[:-1], SimulationError("it grew")],
    )
    config = read_request(
        ["operating.duration_s=0.02", "plan.n_records=2", "executor.n_workers=1"]
    ).config
    with pytest.warns(
        FailedRecordsWarning,
        match="^1 of 2 records made to time the plan failed: it grew$",
    ):
        predict(InputReader(config))
