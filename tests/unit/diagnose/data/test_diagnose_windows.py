"""Windows are cut after the split, and a task refuses what it cannot use."""

import itertools

import numpy as np
import pytest
import torch
from fake_dataset import CLASSES, FakeDataset
from numpy.testing import assert_allclose

from diagnose.data.torch_sets import VibrationDataset
from diagnose.data.windows import (
    SUBSETS,
    Segments,
    all_segments,
    load_windows,
    normalised,
    plan_windows,
    subset_segments,
    task_of,
)
from gensig.dataset.plan import Plan
from gensig.dataset.splitting.protocols import PROTOCOLS, make_splits
from gensig.errors import ConfigError, DatasetError

WINDOW = {"window_samples": 700, "stride_samples": 300}


def make_task(dataset=None, **changes):
    dataset = (
        dataset
        if dataset is not None
        else FakeDataset(n_units=4, records_per_unit=4, n_channels=2)
    )
    return task_of(dataset, **{**WINDOW, "normalise": "rms", **changes})


def samples_of(record, start, length):
    return {
        (int(r), s)
        for r, first in zip(record, start, strict=True)
        for s in range(first, first + length)
    }


class PlannedDataset(FakeDataset):
    """The splits that a plan of its records has, with values and groups to hold out."""

    def __init__(self):
        super().__init__(n_units=12, records_per_unit=8, n_channels=1)
        rng = np.random.default_rng(5)
        unit = self.columns["unit_id"]
        columns = {
            name: self.columns[name]
            for name in ("record_id", "label", "severity", "unit_id")
        }
        self.plan = Plan(
            columns=columns
            | {
                name: np.repeat(rng.uniform(1, 2, 24), 4)
                for name in ("speed_set_rpm", "torque_nm", "snr_db")
            }
            | {
                "gearbox_id": np.char.add("g", unit),
                "specimen_id": np.char.add("s", unit),
            }
            | {
                "shard": np.zeros(self.n_records, dtype=int),
                "row": np.arange(self.n_records),
            }
            | {"faults_json": np.where(columns["label"] == 0, "[]", "[{}]")}
        )
        self.tables = make_splits(self.plan, 0)
        self.protocols = tuple(self.tables)

    def split(self, protocol):
        table = self.tables[protocol]
        number = [int(name.lstrip("r")) for name in table.record_id]
        rows = list(
            zip(
                number,
                table.start_fraction.tolist(),
                table.stop_fraction.tolist(),
                strict=True,
            )
        )
        return {
            s: [row for row, mine in zip(rows, table.subset == s, strict=True) if mine]
            for s in SUBSETS
        }


def test_the_planned_data_set_has_every_protocol():
    assert set(PlannedDataset().protocols) == set(PROTOCOLS)


@pytest.mark.parametrize(
    ("dataset", "protocol"),
    [
        (FakeDataset, "by_unit"),
        (FakeDataset, "random_window_leaky"),
        *((PlannedDataset, name) for name in PROTOCOLS if "leaky" not in name),
    ],
)
def test_windows_of_two_subsets_share_no_sample(dataset, protocol):
    task = make_task(dataset())
    seen = []
    for subset in SUBSETS:
        segments = subset_segments(task, protocol, subset)
        segment, start = plan_windows(segments, 700, 300)
        assert (start >= segments.start[segment]).all()
        assert (start + 700 <= segments.stop[segment]).all()
        seen.append(samples_of(segments.record[segment], start, 700))
    assert all(not a & b for a, b in itertools.combinations(seen, 2))


def test_windows_cut_before_the_split_would_share_samples():
    start = np.arange(0, 3200 - 700 + 1, 300)
    train, test = start[::2], start[1::2]
    assert samples_of(np.zeros(train.size), train, 700) & samples_of(
        np.zeros(test.size), test, 700
    )


def test_units_are_on_one_side_only_but_for_the_leaky_protocol():
    task = make_task()
    unit = task.dataset.column("unit_id")
    units = [
        set(unit[subset_segments(task, "by_unit", subset).record]) for subset in SUBSETS
    ]
    assert all(not a & b for a, b in itertools.combinations(units, 2))
    leaky = [
        set(unit[subset_segments(task, "random_window_leaky", subset).record])
        for subset in SUBSETS
    ]
    assert leaky[0] & leaky[2]


def test_random_training_windows_stay_in_their_stretch():
    task = make_task(normalise="none")
    segments = subset_segments(task, "random_window_leaky", "train")
    windows = load_windows(task, segments)
    rng = np.random.default_rng(0)
    for window in range(0, len(windows), 5):
        cut = windows.cut(np.array([window]), rng)[0]
        stretch = windows.signals[windows.segment[window]]
        assert stretch.shape[-1] == 1600
        views = np.lib.stride_tricks.sliding_window_view(stretch[0], 700)
        assert (
            np.abs(views - views.mean(axis=1, keepdims=True) - cut[0]).max(axis=1).min()
            < 1e-5
        )


def test_plan_windows_counts():
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
    assert_allclose(np.sqrt((normalised(x, "rms") ** 2).mean(axis=-1)), 1.0, rtol=1e-4)
    assert_allclose(
        normalised(x, "none"), x - x.mean(axis=-1, keepdims=True), rtol=1e-6, atol=1e-6
    )
    assert_allclose(
        normalised(7 * x, "rms"), normalised(x, "rms"), rtol=1e-4, atol=1e-5
    )
    assert (normalised(np.ones((2, 1, 8), dtype=np.float32), "rms") == 0).all()


def test_classes_and_channels_are_chosen_by_name():
    task = make_task(classes=["missing_tooth", "healthy"], channels=["channel_1"])
    labels = task.labels()
    names = task.dataset.column("label_name")
    assert set(names[labels == 0]) == {"missing_tooth"}
    assert set(names[labels == -1]) == {"crack", "pitting"}
    windows = load_windows(task, subset_segments(task, "by_unit", "train"))
    record = int(windows.record[0])
    assert_allclose(windows.signals[0][0], task.dataset.signals(record)[1])


def test_failed_records_are_left_out():
    dataset = FakeDataset(n_units=4, records_per_unit=4)
    dataset.usable[3] = False
    assert 3 not in all_segments(make_task(dataset)).record


def test_signal_that_is_not_finite_is_refused():
    dataset = FakeDataset(n_units=4, records_per_unit=4, noise=np.nan)
    task = make_task(dataset)
    with pytest.raises(DatasetError, match=r"record r00000 .* not finite"):
        load_windows(task, subset_segments(task, "by_unit", "train"))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"classes": ["helthy", "crack"]}, "no class 'helthy'; did you mean healthy"),
        ({"channels": ["z"]}, "no channel 'z'; there is channel_0"),
        ({"classes": ["crack"]}, "one class only"),
        ({"normalise": "peak"}, "no normalisation 'peak'"),
    ],
)
def test_task_refuses(changes, message):
    with pytest.raises(ConfigError, match=message):
        make_task(**changes)


def test_subsets_refuse():
    task = make_task()
    with pytest.raises(
        ConfigError, match="no protocol 'by_units'; did you mean by_unit"
    ):
        subset_segments(task, "by_units", "train")
    with pytest.raises(
        ConfigError, match="too long: the longest stretch holds 800 samples"
    ):
        plan_windows(subset_segments(task, "random_window_leaky", "test"), 801, 1)
    task.dataset.usable[:] = False
    with pytest.raises(ConfigError, match="its test part is empty"):
        subset_segments(task, "by_unit", "test")


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_torch_dataset_gives_the_same_from_several_workers(method):
    dataset = FakeDataset(n_units=4, records_per_unit=4, n_channels=2)
    windows = VibrationDataset(dataset, "by_unit", "train", **WINDOW)
    assert windows.class_names == CLASSES
    assert windows[0][0].shape == (2, 700)
    assert windows[0][0].dtype == torch.float32
    loader = torch.utils.data.DataLoader(
        windows, batch_size=16, num_workers=2, multiprocessing_context=method
    )
    got = list(loader)
    assert torch.equal(
        torch.cat([label for _, label in got]), torch.from_numpy(windows.label)
    )
    assert torch.equal(
        torch.cat([x for x, _ in got]),
        torch.stack([windows[i][0] for i in range(len(windows))]),
    )
