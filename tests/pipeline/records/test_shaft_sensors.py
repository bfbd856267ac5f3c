"""Tachometer, encoder, drift, lost samples and torsional channels, from configuration to record and file."""

import csv

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose
from small_sets import make

from gensig.cli import main
from gensig.dataset.reader import open_dataset
from gensig.errors import ConfigError
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader
from gensig.record.options import read_dataset_options
from gensig.record.simulate import forget_twins, simulate_records
from gensig.signals.averaging import time_synchronous_average
from gensig.signals.tacho import pulse_times, resample_by_pulses, speed_of_pulses

RATE = 51_200.0
STORED = (
    "dataset.store_tacho=true",
    "dataset.store_encoder=true",
    "dataset.store_shaft_angle=true",
)
EXACT = ("sensing.tacho.jitter_deg=0",)
RAMP = "operating.speed_profile=[[0,0.7],[0.2,1.3]]"
DRIFTING = (
    "sensing.sensor.drift_scatter=0.1",
    "dataset.store_clean=true",
    "sensing.sensor.drift_time_s=0.1",
)
LOSING = ("sensing.sensor.dropped_fraction=0.2", "sensing.sensor.dropped_fill=zero")


def records(*overrides):
    config = read_request(["plan.n_records=4", "plan.classes=[healthy,missing_tooth]", "plan.n_gearboxes=1",
                           "operating.duration_s=0.2", *overrides]).config  # fmt: skip
    plan = make_plan(config)
    rows = [plan.record(place) for place in range(plan.n_records)]
    forget_twins()
    return config, rows, simulate_records(config, rows)


def gear_angle(config, row, record, shaft):
    """Angle of a gear from where its tooth 0 enters contact, worked out from the columns alone."""
    teeth = {gear: config["gear"][gear]["n_teeth"] for gear in ("pinion", "wheel")}
    turned = record.signals["shaft_angle"] * teeth["pinion"] / teeth[shaft]
    return (
        turned
        + 2.0
        * np.pi
        * (row[f"start_tooth_{shaft}"] + row["start_phase"])
        / teeth[shaft]
    )


@pytest.fixture(scope="module")
def steady():
    return records(*STORED, *EXACT)


@pytest.mark.parametrize("sensing", ["bearing", "housing"])
@pytest.mark.parametrize("shaft", ["pinion", "wheel"])
def test_pulses_are_turns_of_the_shaft_at_one_place_of_the_gear(shaft, sensing):
    config, rows, found = records(*STORED, *EXACT, RAMP, f"sensing={sensing}", f"sensing.tacho.shaft={shaft}",
                                  "sensing.tacho.pulses_per_turn=3")  # fmt: skip
    places = []
    for row, record in zip(rows, found, strict=True):
        times = pulse_times(record.signals["tacho"], RATE)
        angle = gear_angle(config, row, record, shaft)
        at = np.interp(times, np.arange(len(angle)) / RATE, angle)
        assert len(at) >= (17 if shaft == "pinion" else 4)
        assert_allclose(np.diff(at), 2.0 * np.pi / 3.0, rtol=0, atol=1e-6)
        places.append(at[0] % (2.0 * np.pi / 3.0))
    assert_allclose(places, places[0], rtol=0, atol=1e-6)


def test_the_mark_meets_the_same_tooth_in_every_record_of_a_gearbox():
    """By the mesh state, which knows nothing of tachometers."""
    _, _, found = records(
        *STORED, *EXACT, "dataset.store_mesh_state=true", "plan.classes=[healthy]"
    )
    newest = []
    for record in found:
        samples = np.rint(pulse_times(record.signals["tacho"], RATE) * RATE).astype(int)
        newest += record.signals["mesh_pinion_tooth"][:, samples].max(axis=0).tolist()
    assert len(newest) >= 20
    assert len({record.values["start_tooth_pinion"] for record in found}) > 2
    assert (
        np.ptp(newest) <= 1
    )  # a mark near the change of teeth sees it now before, now after


def test_mean_speed_is_that_of_the_column(steady):
    _, _, found = steady
    for record in found:
        _, speed = speed_of_pulses(pulse_times(record.signals["tacho"], RATE))
        assert len(speed) == 5
        assert_allclose(
            60.0 * speed.mean(), record.values["speed_rpm"], rtol=1e-3, atol=0
        )
        assert_allclose(speed, speed.mean(), rtol=2e-3, atol=0)


def test_jitter_moves_pulses_as_far_as_asked():
    _, _, found = records(*STORED, "sensing.tacho.jitter_deg=0.2", "sensing.tacho.pulses_per_turn=20",
                          "sensing.tacho.pulse_width_share=0.5")  # fmt: skip
    off = []
    for record in found:
        times = pulse_times(record.signals["tacho"], RATE)
        angle = np.interp(
            times, np.arange(10_240) / RATE, record.signals["shaft_angle"]
        )
        off.append((angle - angle[0] + np.radians(9.0)) % np.radians(18.0))
        off[-1] -= off[-1].mean()
    assert_allclose(np.degrees(np.concatenate(off).std()), 0.2, rtol=0.1, atol=0)
    shortest = min(map(len, off))
    assert abs(np.corrcoef(off[0][:shortest], off[1][:shortest])[0, 1]) < 0.3


def test_the_tachometer_makes_a_ramp_comparable():
    """The pinion's mesh harmonics after order tracking stand out of what a constant speed leaves of them."""
    _, _, found = records(
        *STORED, RAMP, "plan.classes=[healthy]", "sensing.snr_db=null"
    )
    for record in found:
        signal, tacho = record.signals["acceleration"][1], record.signals["tacho"]
        tracked = resample_by_pulses(signal, RATE, pulse_times(tacho, RATE)).mean(
            axis=0
        )
        plain = time_synchronous_average(
            signal, RATE, record.values["speed_rpm"] / 60.0
        )
        mesh = [np.abs(np.fft.rfft(one))[23] / len(one) for one in (tracked, plain)]
        assert mesh[0] > 1.5 * mesh[1]


def test_the_encoder_reads_the_angle_within_its_errors(steady):
    config, rows, found = steady
    encoder = config["sensing"]["encoder"]
    most = np.radians(
        encoder["eccentricity_error_deg"] + 4.0 * encoder["line_error_deg"]
    )
    line = 2.0 * np.pi / encoder["lines_per_turn"]
    indices = []
    for row, record in zip(rows, found, strict=True):
        read = record.signals["encoder_angle"]
        assert read.dtype == np.float64
        assert -most - line < read[0] < 2.0 * np.pi + most
        off = (
            gear_angle(config, row, record, "pinion") - read
        )  # the index's place, a line's width and the errors
        assert np.ptp(off) <= line + 2.0 * most
        indices.append(np.mean(off) % (2.0 * np.pi))
    assert np.ptp(indices) < 0.2 * line


def test_what_is_stored_moves_no_bit(steady):
    _, _, found = steady
    _, _, plain = records()
    _, _, less = records("dataset.store_encoder=true")
    for one, other, third in zip(found, plain, less, strict=True):
        assert set(one.signals) - set(other.signals) == {
            "tacho",
            "encoder_angle",
            "shaft_angle",
        }
        assert np.array_equal(
            one.signals["acceleration"], other.signals["acceleration"]
        )
        assert np.array_equal(
            one.signals["encoder_angle"], third.signals["encoder_angle"]
        )


def test_drift_changes_the_signal_by_its_gain_and_not_the_floor():
    _, _, plain = records("dataset.store_clean=true")
    config, _, found = records(*DRIFTING)
    gains = []
    for one, other in zip(found, plain, strict=True):
        clean, still = (
            record.signals["acceleration_clean"].astype(float)
            for record in (one, other)
        )
        clear = np.abs(still) > 0.1 * still.std(axis=1, keepdims=True)
        gain = np.where(clear, clean / np.where(clear, still, 1.0), np.nan)
        assert np.nanmin(gain) > np.exp(-0.6)
        assert np.nanmax(gain) < np.exp(0.6)
        assert np.all(np.nanstd(gain, axis=1) > 1e-3)
        noise, before = (
            record.signals["acceleration"]
            - record.signals["acceleration_clean"].astype(float)
            for record in (one, other)
        )
        assert_allclose(noise, before, rtol=0, atol=1e-3 * before.std())
        assert np.array_equal(one.signals["noise_power"], other.signals["noise_power"])
        gains.append(np.nanmean(gain, axis=1))
    assert np.log(gains).std() > 0.02
    assert len(np.unique(np.round(gains, 6))) == 4 * len(config["sensing"]["channels"])


def test_drift_is_no_part_of_what_a_fault_does():
    with_drift = records(
        *DRIFTING,
        "dataset.store_detectability=true",
        "sensing.sensor.drift_scatter=0.3",
    )
    without = records("dataset.store_detectability=true")
    for one, other in zip(with_drift[2], without[2], strict=True):
        found, expected = one.values["detectability"], other.values["detectability"]
        assert found == pytest.approx(expected, rel=1.0)
        assert (found == 0.0) == (one.values["label_name"] == "healthy")


def test_lost_samples_are_told_and_the_same_in_all_channels():
    _, _, plain = records()
    _, _, found = records(*LOSING)
    shares = []
    for one, other in zip(found, plain, strict=True):
        signal = one.signals["acceleration"]
        lost = np.all(signal == 0.0, axis=0)
        assert one.values["dropped_fraction"] == lost.mean()
        assert other.values["dropped_fraction"] == 0.0
        assert np.array_equal(signal[:, ~lost], other.signals["acceleration"][:, ~lost])
        shares.append(lost.mean())
    assert len(set(shares)) > 1
    assert 0.1 < np.mean(shares) < 0.3


def test_a_record_does_not_depend_on_its_neighbours():
    config, rows, found = records(*STORED, *DRIFTING, *LOSING)
    for row, record in zip(rows, found, strict=True):
        forget_twins()
        (alone,) = simulate_records(config, [row])
        for name, signal in record.signals.items():
            assert np.array_equal(signal, alone.signals[name])


def test_a_file_has_them_and_says_what_they_are(tmp_path, capsys):
    sensors = (
        "sensing.tacho.pulses_per_turn=60",
        "sensing.tacho.pulse_width_share=0.5",
        "sensing.encoder.shaft=wheel",
    )
    words = (
        *STORED,
        *DRIFTING,
        *LOSING,
        *sensors,
        "sensing.snr_reference=record",
        "operating.duration_s=0.05",
    )
    folder = make(tmp_path / "set", *words)
    assert main(["verify", str(folder)]) == 0
    assert main(["reproduce", str(folder), "--records", "3"]) == 0
    assert "3 of 3 records have the same bits" in capsys.readouterr().out
    data = open_dataset(folder)
    told = (
        "tacho_shaft",
        "tacho_pulses_per_turn",
        "encoder_shaft",
        "encoder_lines_per_turn",
    )
    assert [data.attributes[name] for name in told] == ["pinion", 60, "wheel", 1024]
    assert (
        data.trace(0, "tacho").shape == data.trace(0, "encoder_angle").shape == (2560,)
    )
    assert np.all(
        (data.column("dropped_fraction") > 0.0)
        & (data.column("dropped_fraction") < 1.0)
    )
    sound, cracked = tmp_path / "sound.h5", tmp_path / "cracked.h5"
    faulty = str(np.flatnonzero(data.column("label_name") == "crack")[0])
    assert (
        main(
            [
                "simulate",
                "--from",
                str(folder),
                "--record",
                faulty,
                "--output",
                str(cracked),
            ]
        )
        == 0
    )
    assert (
        main(
            [
                "simulate",
                "--from",
                str(folder),
                "--record",
                faulty,
                "--twin",
                "--output",
                str(sound),
            ]
        )
        == 0
    )
    with h5py.File(sound) as one, h5py.File(cracked) as other:
        lost = [np.all(file["acceleration"][0] == 0.0, axis=0) for file in (one, other)]
        assert np.array_equal(*lost)
        noise = [
            file["acceleration"][0] - file["acceleration_clean"][0]
            for file in (one, other)
        ]
        assert_allclose(
            noise[0][:, ~lost[0]],
            noise[1][:, ~lost[0]],
            rtol=0,
            atol=1e-4 * noise[1].std(),
        )


@pytest.mark.parametrize(
    ("word", "text"),
    [
        ("dataset.store_tacho=1", "dataset.store_tacho = 1 must be true or false"),
        (
            "dataset.store_encoder=yess",
            "dataset.store_encoder = 'yess' must be true or false",
        ),
    ],
)
def test_mistakes(word, text):
    with pytest.raises(ConfigError, match=text):
        read_dataset_options(read_request([word]).config)


@pytest.mark.parametrize(
    "key", ["sensing.tacho.pulses_per_turn", "sensing.encoder.lines_per_turn"]
)
def test_what_a_reader_has_to_know_is_one_for_the_set(key):
    config = read_request(
        [f"plan.vary={{{key}: {{distribution: integers, low: 8, high: 9}}}}"]
    ).config
    with pytest.raises(ConfigError, match=f"'{key}' is one value for a whole data set"):
        make_plan(config)


def test_drift_and_loss_can_vary_by_condition():
    vary = (
        "{sensing.sensor.drift_scatter: {distribution: uniform, low: 0.0, high: 0.1}}"
    )
    config = read_request([f"plan.vary={vary}", "plan.n_records=2"]).config
    plan = make_plan(config)
    inputs = [InputReader(config).inputs(plan.record(k)) for k in range(2)]
    scatters = [each.machine.sensing.sensor.drift_scatter for each in inputs]
    assert len({*scatters, 0.0}) == 3


class TestTorsionalChannels:
    NAMES = ("pinion_rotation", "wheel_rotation", "motor_rotation", "load_rotation")
    ROTORS = ("system.motor.inertia_kg_m2=0.01", "system.load.inertia_kg_m2=0.05")

    def test_they_are_the_second_derivative_of_the_angle(self):
        stored = (
            "dataset.store_shaft_angle=true",
            "dataset.store_clean=true",
            "plan.classes=[healthy]",
        )
        _, _, found = records(
            "sensing.channels=[pinion_rotation]", "sensing.gain_scatter=0", *stored
        )
        for record in found:
            angle = record.signals["shaft_angle"]
            by_angle = (angle[2:] - 2.0 * angle[1:-1] + angle[:-2]) * RATE**2
            told = record.signals["acceleration_clean"][0, 1:-1].astype(float)
            spectra = [
                np.fft.rfft(one * np.hanning(len(one)))[: len(one) // 20]
                for one in (by_angle, told)
            ]
            assert np.linalg.norm(spectra[0] - spectra[1]) < 0.05 * np.linalg.norm(
                spectra[1]
            )

    def test_a_set_of_them_says_their_unit(self, tmp_path):
        folder = make(
            tmp_path / "set", *self.ROTORS, f"sensing.channels=[{','.join(self.NAMES)}]"
        )
        assert main(["verify", str(folder)]) == 0
        data = open_dataset(folder)
        assert data.attributes["channel_units"] == ["rad/s^2"] * 4
        assert np.all(data.signals(0).std(axis=1) > 0.0)
        out = tmp_path / "one.h5"
        assert main(["export", str(folder), "--to", "hdf5", "--out", str(out)]) == 0
        for path in (folder / "shards" / "shard-00000.h5", out):
            with h5py.File(path, locking=False) as file:
                names = ("acceleration", "signal_power", "noise_power")
                units = {name: file[name].attrs["unit"].decode() for name in names}
            assert units == dict.fromkeys(units, "(rad/s^2)^2") | {
                "acceleration": "rad/s^2"
            }

    def test_mixed_units_are_told_by_channel(self, tmp_path):
        folder = make(tmp_path / "set", "sensing.channels=[pinion_y,wheel_rotation]")
        with h5py.File(folder / "shards" / "shard-00000.h5", locking=False) as file:
            assert file["acceleration"].attrs["unit"].decode() == "by channel_units"
            assert list(file.attrs["channel_units"].astype(str)) == ["m/s^2", "rad/s^2"]
        assert open_dataset(folder).attributes["channel_units"] == ["m/s^2", "rad/s^2"]

    def test_simulate_prints_and_writes_their_unit(self, tmp_path, capsys):
        words = [
            "sensing.channels=[pinion_y,wheel_rotation]",
            "operating.duration_s=0.05",
        ]
        path, figure = tmp_path / "record.csv", tmp_path / "record.png"
        assert (
            main(["simulate", *words, "--output", str(path), "--plot", str(figure)])
            == 0
        )
        units = {
            line.split()[0]: line.split()[2]
            for line in capsys.readouterr().out.splitlines()
            if "_" in line
        }
        assert units == {"pinion_y": "m/s2", "wheel_rotation": "rad/s2"}
        with path.open() as stream:
            assert next(csv.reader(stream)) == [
                "time_s",
                "pinion_y_m_per_s2",
                "wheel_rotation_rad_per_s2",
            ]
        assert figure.stat().st_size > 10_000

    @pytest.mark.parametrize(
        ("words", "text"),
        [
            (["sensing.channels=[motor_rotation]"], "no channel motor_rotation"),
            (
                ["sensing=housing", "sensing.channels=[pinion_rotation]"],
                "pinion_rotation is no bearing",
            ),
        ],
    )
    def test_where_there_is_none(self, words, text, capsys):
        assert main(["simulate", *words]) != 0
        told = capsys.readouterr().err.strip()
        assert text in told
        assert "\n" not in told
