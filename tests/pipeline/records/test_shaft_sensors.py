"""Tachometer, encoder, drift, lost samples and torsional channels, from configuration to file."""

import csv
from functools import partial

import h5py
import numpy as np
import pytest
import record_sets
from numpy.testing import assert_allclose, assert_array_equal
from record_sets import run, shard, texts
from refusals import refused
from small_sets import make

from gensig.dataset.reader import open_dataset
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.signals.tacho import pulse_times

RATE = 51_200.0
TURN = 2.0 * np.pi
STORED = (
    "dataset.store_tacho=true",
    "dataset.store_encoder=true",
    "dataset.store_shaft_angle=true",
)
EXACT = (*STORED, "sensing.tacho.jitter_deg=0")
RAMP = "operating.speed_profile=[[0,0.7],[0.2,1.3]]"
CLEAN = "dataset.store_clean=true"
DRIFTING = (
    "sensing.sensor.drift_scatter=0.1",
    CLEAN,
    "sensing.sensor.drift_time_s=0.1",
)
LOSING = ("sensing.sensor.dropped_fraction=0.2", "sensing.sensor.dropped_fill=zero")
records = partial(record_sets.records, "plan.n_gearboxes=1", "operating.duration_s=0.2")


def gear_angle(config, row, record, shaft):
    """Angle of a gear from where its tooth 0 enters contact, by the columns alone."""
    teeth = {gear: config["gear"][gear]["n_teeth"] for gear in ("pinion", "wheel")}
    turned = record.signals["shaft_angle"] * teeth["pinion"] / teeth[shaft]
    start = row[f"start_tooth_{shaft}"] + row["start_phase"]
    return turned + TURN * start / teeth[shaft]


def pulses_of(record):
    return pulse_times(record.signals["tacho"], RATE)


@pytest.mark.parametrize(
    ("sensing", "shaft", "least"), [("bearing", "pinion", 17), ("housing", "wheel", 4)]
)
def test_pulses_are_turns_of_the_shaft_at_one_place_of_the_gear(sensing, shaft, least):
    tacho = (f"sensing.tacho.shaft={shaft}", "sensing.tacho.pulses_per_turn=3")
    config, rows, made = records(*EXACT, RAMP, f"sensing={sensing}", *tacho)
    places = []
    for row, record in zip(rows, made, strict=True):
        angle = gear_angle(config, row, record, shaft)
        at = np.interp(pulses_of(record), np.arange(len(angle)) / RATE, angle)
        assert len(at) >= least
        assert_allclose(np.diff(at), TURN / 3.0, atol=1e-6)
        places.append(at[0] % (TURN / 3.0))
    assert_allclose(places, places[0], atol=1e-6)


def test_the_encoder_reads_the_angle_within_its_errors():
    config, rows, made = records(*EXACT)
    encoder = config["sensing"]["encoder"]
    error = encoder["eccentricity_error_deg"] + 4.0 * encoder["line_error_deg"]
    most, line = np.radians(error), TURN / encoder["lines_per_turn"]
    indices = []
    for row, record in zip(rows, made, strict=True):
        read = record.signals["encoder_angle"]
        assert read.dtype == np.float64
        assert -most - line < read[0] < TURN + most
        # the index's place, a line's width and the errors
        off = gear_angle(config, row, record, "pinion") - read
        assert np.ptp(off) <= line + 2.0 * most
        indices.append(np.mean(off) % TURN)
    assert np.ptp(indices) < 0.2 * line


def test_what_is_stored_moves_no_bit():
    sets = (EXACT, (), ("dataset.store_encoder=true",))
    for whole, plain, less in zip(*(records(*words)[2] for words in sets), strict=True):
        added = set(whole.signals) - set(plain.signals)
        assert added == {"tacho", "encoder_angle", "shaft_angle"}
        for name, other in (("acceleration", plain), ("encoder_angle", less)):
            assert_array_equal(whole.signals[name], other.signals[name])


def test_drift_changes_the_signal_by_its_gain_and_not_the_floor():
    config, _, drifting = records(*DRIFTING)
    gains = []
    for one, other in zip(drifting, records(CLEAN)[2], strict=True):
        pair = (one.signals, other.signals)
        clean, still = (made["acceleration_clean"].astype(float) for made in pair)
        noise, before = (
            made["acceleration"] - made["acceleration_clean"] for made in pair
        )
        is_clear = np.abs(still) > 0.1 * still.std(axis=1, keepdims=True)
        gain = np.divide(clean, still, out=np.full(still.shape, np.nan), where=is_clear)
        assert np.nanmax(np.abs(np.log(gain))) < 0.6
        assert np.all(np.nanstd(gain, axis=1) > 1e-3)
        assert_allclose(noise, before, atol=1e-3 * before.std())
        assert_array_equal(one.signals["noise_power"], other.signals["noise_power"])
        gains.append(np.nanmean(gain, axis=1))
    assert np.log(gains).std() > 0.02
    assert len(np.unique(np.round(gains, 6))) == 4 * len(config["sensing"]["channels"])


def test_drift_is_no_part_of_what_a_fault_does():
    judged = "dataset.store_detectability=true"
    drifting = records(*DRIFTING, judged, "sensing.sensor.drift_scatter=0.3")[2]
    for one, other in zip(drifting, records(judged)[2], strict=True):
        value = one.values["detectability"]
        assert value == pytest.approx(other.values["detectability"], rel=0.1)
        assert (value == 0.0) == (one.values["label_name"] == "healthy")


def test_lost_samples_are_counted_and_the_same_in_all_channels():
    shares = []
    for one, other in zip(records(*LOSING)[2], records()[2], strict=True):
        signal = one.signals["acceleration"]
        lost = np.all(signal == 0.0, axis=0)
        assert one.values["dropped_fraction"] == lost.mean()
        assert other.values["dropped_fraction"] == 0.0
        assert_array_equal(signal[:, ~lost], other.signals["acceleration"][:, ~lost])
        shares.append(lost.mean())
    assert len(set(shares)) > 1
    assert 0.1 < np.mean(shares) < 0.3


def test_a_file_says_what_they_are_and_a_twin_loses_the_same_samples(tmp_path):
    sensors = (
        "sensing.tacho.pulses_per_turn=60",
        "sensing.tacho.pulse_width_share=0.5",
        "sensing.encoder.shaft=wheel",
        "sensing.snr_reference=record",
        "operating.duration_s=0.05",
    )
    folder = make(tmp_path / "set", *STORED, *DRIFTING, *LOSING, *sensors)
    data = open_dataset(folder)
    attributes = {
        "tacho_shaft": "pinion",
        "tacho_pulses_per_turn": 60,
        "encoder_shaft": "wheel",
        "encoder_lines_per_turn": 1024,
    }
    assert attributes.items() <= dict(data.attributes).items()
    for name in ("tacho", "encoder_angle"):
        assert data.trace(0, name).shape == (2560,)
    dropped = data.column("dropped_fraction")
    assert np.all((dropped > 0.0) & (dropped < 1.0))
    crack = data.column("label_name").tolist().index("crack")
    out = tmp_path / "sound.h5"
    run("simulate", "--from", folder, "--record", crack, "--output", out, "--twin")
    with h5py.File(out) as file:
        lost = np.all(file["acceleration"][0] == 0.0, axis=0)
    assert_array_equal(lost, np.all(data.signals(crack) == 0.0, axis=0))


@pytest.mark.parametrize(
    "key", ["sensing.tacho.pulses_per_turn", "sensing.encoder.lines_per_turn"]
)
def test_what_a_reader_has_to_know_is_one_for_the_set(key):
    vary = f"plan.vary={{{key}: {{distribution: integers, low: 8, high: 9}}}}"
    with refused(f"'{key}' is one value for a whole data set"):
        make_plan(read_request([vary]).config)


class TestTorsionalChannels:
    NAMES = ("pinion_rotation", "wheel_rotation", "motor_rotation", "load_rotation")
    ROTORS = ("system.motor.inertia_kg_m2=0.01", "system.load.inertia_kg_m2=0.05")
    MIXED = "sensing.channels=[pinion_y,wheel_rotation]"

    def test_they_are_the_second_derivative_of_the_angle(self):
        stored = ("dataset.store_shaft_angle=true", CLEAN, "plan.classes=[healthy]")
        channel = ("sensing.channels=[pinion_rotation]", "sensing.gain_scatter=0")
        for record in records(*channel, *stored)[2]:
            angle = record.signals["shaft_angle"]
            by_angle = np.diff(angle, 2) * RATE**2
            reported = record.signals["acceleration_clean"][0, 1:-1].astype(float)
            window, low = np.hanning(len(reported)), len(reported) // 20
            first, second = (
                np.fft.rfft(signal * window)[:low] for signal in (by_angle, reported)
            )
            assert np.linalg.norm(first - second) < 0.05 * np.linalg.norm(second)

    def test_a_set_of_them_says_their_unit(self, tmp_path):
        channels = f"sensing.channels=[{','.join(self.NAMES)}]"
        folder = make(tmp_path / "set", *self.ROTORS, channels)
        data = open_dataset(folder)
        assert data.attributes["channel_units"] == ["rad/s^2"] * 4
        assert np.all(data.signals(0).std(axis=1) > 0.0)
        out = tmp_path / "one.h5"
        run("export", folder, "--to", "hdf5", "--out", out)
        for file in (shard(folder), h5py.File(out)):
            names = ("acceleration", "signal_power", "noise_power")
            units = texts(file[name].attrs["unit"] for name in names)
            assert units == ["rad/s^2", "(rad/s^2)^2", "(rad/s^2)^2"]
            file.close()

    def test_mixed_units_are_stored_by_channel(self, tmp_path):
        with shard(make(tmp_path / "set", self.MIXED)) as file:
            assert file["acceleration"].attrs["unit"].decode() == "by channel_units"
            assert texts(file.attrs["channel_units"]) == ["m/s^2", "rad/s^2"]

    def test_simulate_prints_and_writes_their_unit(self, tmp_path, capsys):
        path = tmp_path / "record.csv"
        run("simulate", self.MIXED, "operating.duration_s=0.05", "--output", path)
        lines = [line.split() for line in capsys.readouterr().out.splitlines()]
        units = {words[0]: words[2] for words in lines if words and "_" in words[0]}
        assert units == {"pinion_y": "m/s2", "wheel_rotation": "rad/s2"}
        with path.open() as stream:
            header = next(csv.reader(stream))
        assert header == ["time_s", "pinion_y_m_per_s2", "wheel_rotation_rad_per_s2"]
