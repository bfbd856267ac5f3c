"""Records of a drive line through a housing, with nuisances, shaft sensors and a measured path."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from record_sets import rows_of, simulated

from gensig.plan.request import read_request
from gensig.record.inputs import InputReader
from gensig.record.machines import read_machine
from gensig.signals.tacho import pulse_times
from gensig.systems.nuisances import with_nuisances
from gensig.systems.run import CleanRecord

SHORT = (
    "experiment=two_stage",
    "operating.duration_s=0.3",
    "plan.n_records=4",
    "plan.classes=[healthy,crack,broken,missing_tooth]",
    "plan.fault_gear=as_given",
    "plan.n_units=1",
    "plan.n_repeats=1",
    "plan.n_gearboxes=1",
    "plan.vary={}",
    "quality.iso1328_grade=null",
    "dataset.store_source=true",
    "dataset.store_clean=true",
    "dataset.store_shaft_angle=true",
)
TURN = 2.0 * np.pi


def made(*words):
    """Machine, rows and records of a small set, by class."""
    config = read_request([*SHORT, *words]).config
    rows = rows_of(config)
    records = simulated(config, rows)
    assert not any("status" in record.values for record in records)  # none failed
    names = [row["label_name"] for row in rows]
    return read_machine(config), dict(zip(names, records, strict=True))


def source(record):
    return record.signals["acceleration_source"].astype(float)


def test_every_bearing_shakes_the_housing_and_nuisances_add_to_every_class():
    system, still = made("sensing=geared_line_housing")
    _, shaken = made("sensing=geared_line_machine")
    assert len(system.sensing.channels) == 8
    assert system.sensing.channel_names == (
        "housing_input",
        "housing_output",
        "housing_top",
    )
    added = {name: source(shaken[name]) - source(still[name]) for name in still}
    for name, difference in added.items():
        assert shaken[name].signals["acceleration"].shape == (3, 7680)
        level, motion = difference.std(axis=1), source(still[name]).std(axis=1)
        is_moved = motion > 1e-6
        assert level[:4].min() > 1e-3
        assert np.all(level[is_moved] < 0.1 * motion[is_moved])
        clean = [
            made_one[name].signals["acceleration_clean"] for made_one in (shaken, still)
        ]
        assert np.std(clean[0].astype(float) - clean[1], axis=1).min() > 1e-4


def test_no_class_of_a_line_has_other_nuisances():
    """At the same angle of the shaft a faulty line and a sound one are shaken by the same bits."""
    config = read_request([*SHORT, "sensing=geared_line_machine"]).config
    reader = InputReader(config)
    (faulty,) = [row for row in rows_of(config) if row["label_name"] == "missing_tooth"]
    system = reader.inputs(faulty).machine
    sensing = system.sensing
    n_samples = 7680
    motion = CleanRecord(
        acceleration=np.zeros((8, sensing.n_lead + n_samples)),
        shaft_angle=system.operating.speed * np.arange(n_samples) / 25600.0,
        mean_speed=system.operating.speed,
        contact_loss_fraction=0.0,
        integration_error=0.0,
        integration_check="none",
    )

    def shaken(row):
        inputs = reader.inputs(row)
        moved = with_nuisances(inputs.run, motion, *inputs.nuisance_streams())
        return bool(inputs.run.faults), moved.acceleration

    (has_fault, one), (still_has, other) = (
        shaken(faulty),
        shaken({**faulty, "faults_json": "[]", "label_name": "healthy"}),
    )
    assert (has_fault, still_has) == (True, False)
    assert_array_equal(one, other)
    assert one[:4].std(axis=1).min() > 0.0


@pytest.mark.parametrize(("gear", "ratio"), [("output_gear", 0.2), ("pinion", 1.0)])
def test_a_tachometer_sits_on_the_shaft_of_any_gear(gear, ratio):
    words = (
        "sensing=geared_line",
        f"sensing.tacho.shaft={gear}",
        f"sensing.encoder.shaft={gear}",
        "sensing.encoder.quantised=false",
        "sensing.tacho.pulses_per_turn=4",
        "sensing.tacho.jitter_deg=0",
        "dataset.store_tacho=true",
        "dataset.store_encoder=true",
    )
    system, records = made(*words)
    rate = system.sensing.sampling_rate
    for record in records.values():
        angle = ratio * record.signals["shaft_angle"]
        times = pulse_times(record.signals["tacho"], rate)
        at = np.interp(times, np.arange(len(angle)) / rate, angle)
        assert len(at) >= 5
        assert_allclose(np.diff(at), TURN / 4.0, atol=1e-5)
        read = record.signals["encoder_angle"]
        assert_allclose(np.ptp(read), np.ptp(angle), atol=2e-3)


def test_a_measured_path_leads_from_any_gear_to_the_sensors(tmp_path):
    rate, delay = 10240.0, 3
    file = tmp_path / "path.csv"
    rows = ["time_s,pinion_y_to_cover,output_gear_y_to_cover"]
    for sample in range(32):
        heard = 2.0 * (sample == 0), 0.5 * (sample == delay)
        rows.append(f"{sample / rate!r},{heard[0]},{heard[1]}")
    file.write_text("\n".join(rows))
    words = (
        "sensing=geared_line",
        "sensing.channels=[pinion_y,output_gear_y]",
        "sensing.sensors=[cover]",
        "~sensing.path",
        f"+sensing.path={{kind: measured, file: '{file}'}}",
        "sensing.snr_db=null",
    )
    system, records = made(*words)
    assert system.sensing.n_lead == 32
    for record in records.values():
        near, far = source(record)
        (heard,) = record.signals["acceleration_clean"].astype(float)
        expected = 2.0 * near[delay:] + 0.5 * far[:-delay]
        assert_allclose(heard[delay:], expected, atol=1e-5 * np.abs(expected).max())


def test_a_sensor_hears_what_it_did_before_it_had_a_lead_in():
    """Of an ideal path, the accelerometer's filters alone."""
    quiet = ("sensing=geared_line", "sensing.snr_db=null", "sensing.gain_scatter=0")
    _, plain = made(*quiet)
    _, filtered = made(*quiet, "sensing.sensor.low_cutoff_hz=0.5")
    for name, record in plain.items():
        here, there = (each.signals["shaft_angle"] for each in (record, filtered[name]))
        assert_allclose(here, there, atol=1e-4)
        motion = source(record)
        scale = motion.std(axis=1)
        moved = np.std(source(filtered[name]) - motion, axis=1)
        assert np.all(moved < 1e-2 * scale)
        assert_array_equal(record.signals["acceleration"].shape, motion.shape)
