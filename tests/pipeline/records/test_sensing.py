"""Data sets of housing sensors: the same promises as of bearings, and the stories their columns
tell."""

from functools import partial

import numpy as np
import pytest
import record_sets
from record_sets import refused
from small_sets import make

from gensig.dataset.reader import open_dataset
from gensig.record.inputs import InputReader

SET = (
    "sensing=housing",
    "sensing.channels=[pinion_x,pinion_y,wheel_x,wheel_y]",
    "operating.duration_s=0.05",
)
STORED = (
    "dataset.store_source=true",
    "dataset.store_clean=true",
    "dataset.store_detectability=true",
)
SENSORS = ["housing_input", "housing_output", "housing_top"]


records = partial(record_sets.records, "operating.duration_s=0.05")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return make(tmp_path_factory.mktemp("housing") / "data", *SET, *STORED)


def test_channels_are_the_sensors(folder):
    data = open_dataset(folder)
    assert data.channel_names == SENSORS
    assert data.attributes["source_names"] == [
        "pinion_x",
        "pinion_y",
        "wheel_x",
        "wheel_y",
    ]
    assert data.signals(0).shape == (3, 2560)
    assert np.all(np.isnan(data.column("detectability")))
    assert np.all(data.column("clipped_fraction") == 0.0)


def test_the_floor_is_the_same_for_all_classes_and_at_the_ratio_asked_for():
    sharp = (
        "sensing=housing",
        "sensing.sensor.adc_bits=null",
        "sensing.sensor.adc_range_m_per_s2=null",
        "sensing.sensor.dc_offset_m_per_s2=0",
        "dataset.store_clean=true",
    )
    config, rows, made = records(*sharp)
    floors = {}
    for row, record in zip(rows, made, strict=True):
        instrument = InputReader(config).inputs(row).instrument
        clean = record.signals["acceleration_clean"].astype(float)
        floor = instrument.power(record.signals["acceleration"] - clean)
        floors[row["condition_id"], row["label_name"]] = floor
        if row["label_name"] == "healthy":
            ratio = 10 * np.log10(record.signals["signal_power"] / floor)
            np.testing.assert_allclose(ratio, config["sensing"]["snr_db"], atol=0.1)
    assert len(floors) == 4
    for (condition, _), floor in floors.items():
        np.testing.assert_allclose(floor, floors[condition, "healthy"], rtol=1e-4)


def test_the_source_is_that_of_a_sensor_on_the_bearing():
    """With perfect gears that do not bounce: their motion is the same from wherever it starts."""
    perfect = (
        "plan.classes=[healthy,crack]",
        "sensing.gain_scatter=0",
        "quality.iso1328_grade=null",
        "dataset.store_shaft_angle=true",
        "dataset.store_mesh_state=true",
    )
    _, _, housing = records("sensing=housing", *perfect, "dataset.store_source=true")
    _, _, bearing = records(*perfect, "dataset.store_clean=true")
    for one, other in zip(housing, bearing, strict=True):
        is_sound = one.values["label_name"] == "healthy"
        # a crack that is in mesh where the machine starts moves its static equilibrium, to which
        # the drive is anchored
        most = {True: 2e-3, False: 0.05}[is_sound]
        exact = other.signals["acceleration_clean"]
        error = one.signals["acceleration_source"] - exact
        assert np.all(error.std(axis=1) < most * exact.std(axis=1))
        for name in ("mesh_pinion_tooth", "mesh_wheel_tooth", "fault_engaged"):
            shown, expected = (
                np.sort(np.atleast_2d(record.signals[name]), axis=0)
                for record in (one, other)
            )
            assert np.mean(shown != expected) < 2e-3
        assert one.signals["fault_engaged"].any() != is_sound
        angles = [record.signals["shaft_angle"] for record in (one, other)]
        np.testing.assert_allclose(*angles, atol=2e-4)
        speeds = [record.values["speed_rpm"] for record in (one, other)]
        np.testing.assert_allclose(*speeds, rtol=1e-6)


def test_a_converter_that_clips_marks_its_records():
    _, _, made = records("sensing=housing", "sensing.sensor.adc_range_m_per_s2=10")
    for record in made:
        assert record.values["clipped"] == 1
        assert 0.01 < record.values["clipped_fraction"] < 1.0
        assert np.abs(record.signals["acceleration"]).max() <= 10.0


def test_a_user_file_that_does_not_fit_stops_the_plan(tmp_path, capsys):
    file = tmp_path / "response.csv"
    file.write_text("frequency_hz,x\n" + "".join(f"{line},1\n" for line in range(20)))
    words = ("plan", "sensing=measured", f"sensing.path.file={file}")
    error = refused(capsys, *words, "plan.n_records=1")
    assert "no column pinion_x_to_housing_real" in error
