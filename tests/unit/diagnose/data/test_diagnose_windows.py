"""Windows are cut after the split, and a task refuses unusable settings."""

import itertools

import numpy as np
import pytest
import torch
from fake_dataset import CLASSES, FakeDataset
from numpy.testing import assert_allclose
from small_studies import windows_of

from diagnose.data import VibrationDataset
from diagnose.data.windows import (
    SUBSETS,
    Segments,
    all_segments,
    normalised,
    plan_windows,
    subset_segments,
    task_of,
)
from gensig.dataset.plan import Plan
from gensig.dataset.splitting.protocols import PROTOCOLS, make_splits
from gensig.errors import ConfigError, DatasetError

WINDOW = {"window_samples": 700, "stride_samples": 300}
LEAKY = "random_window_leaky"


def fake(**changes):
    return FakeDataset(n_units=4, records_per_unit=4, n_channels=2, **changes)


def make_task(dataset=None, **changes):
    return task_of(dataset or fake(), **{**WINDOW, "normalise": "rms", **changes})


def samples_of(record, start):
    """All pairs of record and sample in windows."""
    windows = zip(record.tolist(), start.tolist(), strict=True)
    return {(r, s) for r, first in windows for s in range(first, first + 700)}


def share_nothing(sets):
    return all(not first & second for first, second in itertools.combinations(sets, 2))


class PlannedDataset(FakeDataset):
    """The splits of a plan of its records, with values and groups to hold out."""

    def __init__(self):
        super().__init__(n_units=12)
        rng = np.random.default_rng(5)
        names = ("record_id", "label", "severity", "unit_id")
        columns = {name: self.columns[name] for name in names}
        for name in ("speed_set_rpm", "torque_nm", "snr_db"):
            columns[name] = np.repeat(rng.uniform(1, 2, 24), 4)
        columns["gearbox_id"] = np.char.add("g", columns["unit_id"])
        columns["specimen_id"] = np.char.add("s", columns["unit_id"])
        columns["shard"] = np.zeros(self.n_records, dtype=int)
        columns["row"] = np.arange(self.n_records)
        columns["faults_json"] = np.where(columns["label"] == 0, "[]", "[{}]")
        self.tables = make_splits(Plan(columns=columns), 0)
        self.protocols = tuple(self.tables)

    def split(self, protocol):
        table = self.tables[protocol]
        subsets = {name: [] for name in SUBSETS}
        columns = (table.record_id, table.start_fraction, table.stop_fraction)
        for name, *fractions, subset in zip(*columns, table.subset, strict=True):
            subsets[subset].append((int(name.lstrip("r")), *fractions))
        return subsets


def test_the_planned_data_set_has_every_protocol():
    assert set(PlannedDataset().protocols) == set(PROTOCOLS)


PLANNED = [(PlannedDataset, name) for name in PROTOCOLS if "leaky" not in name]


@pytest.mark.parametrize(
    ("dataset", "protocol"), [(FakeDataset, "by_unit"), (FakeDataset, LEAKY), *PLANNED]
)
def test_windows_of_two_subsets_share_no_sample(dataset, protocol):
    task = make_task(dataset())
    samples = []
    for subset in SUBSETS:
        segments = subset_segments(task, protocol, subset)
        segment, start = plan_windows(segments, 700, 300)
        assert (start >= segments.start[segment]).all()
        assert (start + 700 <= segments.stop[segment]).all()
        samples.append(samples_of(segments.record[segment], start))
    assert share_nothing(samples)


@pytest.mark.parametrize(("protocol", "whole"), [("by_unit", True), (LEAKY, False)])
def test_units_are_in_one_subset_except_for_the_leaky_protocol(protocol, whole):
    task = make_task()
    unit = task.dataset.column("unit_id")
    units = [
        set(unit[subset_segments(task, protocol, subset).record]) for subset in SUBSETS
    ]
    assert share_nothing(units) == whole


def test_random_training_windows_stay_in_their_stretch():
    (windows,) = windows_of(make_task(normalise="none"), "train", protocol=LEAKY)
    rng = np.random.default_rng(0)
    for window in range(0, len(windows), 5):
        cut = windows.cut(np.array([window]), rng)[0, 0]
        stretch = windows.signals[windows.segment[window]][0]
        assert stretch.size == 1600
        views = np.lib.stride_tricks.sliding_window_view(stretch, 700)
        centered = views - views.mean(axis=1, keepdims=True)
        assert np.abs(centered - cut).max(axis=1).min() < 1e-5


def test_windows_lie_whole_in_their_segments():
    segments = Segments(
        record=np.array([4, 9, 9]),
        start=np.array([0, 100, 500]),
        stop=np.array([1000, 400, 1000]),
    )
    segment, start = plan_windows(segments, 400, 300)
    assert segment.tolist() == [0, 0, 0, 2]
    assert start.tolist() == [0, 300, 600, 500]


def test_normalisation():
    x = np.random.default_rng(0).normal(3.0, 2.0, (5, 2, 400)).astype(np.float32)
    scaled = normalised(x, "rms")
    assert_allclose(np.mean(scaled**2, axis=-1), 1.0, rtol=2e-4)
    assert_allclose(normalised(7 * x, "rms"), scaled, rtol=1e-4, atol=1e-5)
    centered = x - x.mean(axis=-1, keepdims=True)
    assert_allclose(normalised(x, "none"), centered, rtol=1e-6, atol=1e-6)
    assert (normalised(np.ones((2, 1, 8), dtype=np.float32), "rms") == 0).all()


def test_classes_and_channels_are_chosen_by_name():
    task = make_task(classes=["missing_tooth", "healthy"], channels=["channel_1"])
    labels, names = task.labels(), task.dataset.column("label_name")
    assert set(names[labels == 0]) == {"missing_tooth"}
    assert set(names[labels == -1]) == {"crack", "pitting"}
    (windows,) = windows_of(task, "train")
    signal = task.dataset.signals(int(windows.record[0]))[1]
    assert_allclose(windows.signals[0][0], signal)


def test_failed_records_are_left_out():
    dataset = fake()
    dataset.usable[3] = False
    assert 3 not in all_segments(make_task(dataset)).record
    dataset.usable[:] = False
    with pytest.raises(DatasetError, match="no usable record of healthy"):
        all_segments(make_task(dataset))
    with pytest.raises(ConfigError, match="its test part is empty"):
        windows_of(make_task(dataset), "test")


def test_a_signal_that_is_not_finite_is_refused():
    with pytest.raises(DatasetError, match=r"record r00000 .* not finite"):
        windows_of(make_task(fake(noise=np.nan)), "train")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"classes": ["helthy", "crack"]}, "no class 'helthy'; did you mean healthy"),
        ({"channels": ["z"]}, "no channel 'z'; there is channel_0"),
        ({"classes": ["crack"]}, "one class only"),
        ({"normalise": "peak"}, "no normalisation 'peak'"),
        ({"stride_samples": 0}, "must be at least 1"),
        ({"window_samples": 801}, "longest stretch holds 800 samples"),
        ({"protocol": "by_units"}, "no protocol 'by_units'; did you mean by_unit"),
        ({"protocol": "cross_sensor"}, "no channels to test on are named"),
    ],
)
def test_mistakes_are_refused(changes, message):
    values = {"protocol": LEAKY} | changes
    protocol = values.pop("protocol")
    with pytest.raises(ConfigError, match=message):
        windows_of(
            make_task(**values).part(protocol, "test"), "test", protocol=protocol
        )


@pytest.mark.parametrize(("method", "n_workers"), [("fork", 2), ("spawn", 1)])
def test_the_torch_dataset_gives_the_same_from_workers(method, n_workers):
    windows = VibrationDataset(fake(), "by_unit", "train", **WINDOW)
    assert windows.class_names == CLASSES
    assert windows[0][0].shape == (2, 700)
    assert windows[0][0].dtype == torch.float32
    workers = {"num_workers": n_workers, "multiprocessing_context": method}
    batches = torch.utils.data.DataLoader(windows, batch_size=16, **workers)
    signals, labels = (torch.cat(parts) for parts in zip(*batches, strict=True))
    assert torch.equal(labels, torch.from_numpy(windows.label))
    expected = torch.stack([windows[index][0] for index in range(len(windows))])
    assert torch.equal(signals, expected)
