"""Small settings, trainings and scores that the tests of `diagnose` share."""

import numpy as np
import runs
from fake_dataset import FakeDataset
from runs import SMALL_CNN

from diagnose.cli import main
from diagnose.data.windows import load_windows, subset_segments, task_of
from diagnose.recordings.registry import TARGETS
from diagnose.scoring.metrics import balanced_accuracy, confusion_by_unit
from diagnose.studies.jobs import Job, run_jobs
from diagnose.studies.network_choice import settings_for
from diagnose.studies.study import task_from

SMALL = [
    "window_samples=1200",
    "stride_samples=1000",
    "seeds=[0]",
    "n_threads=1",
    "n_bootstrap=50",
    "protocols=[by_unit]",
]
TINY_CNN = [*SMALL_CNN]
NETWORK_ALONE = ["shuffle_control=false", "baselines=false"]
LEARNS = ["epochs=8", "epoch_fraction=0.6", "learning_rate=0.01"]


def settings_of(*overrides):
    return runs.settings_of(*SMALL, *overrides)


def task_on(dataset, window=1200, stride=None, normalise="rms", **chosen):
    """Task of windows that lie one after another unless a stride is given."""
    lengths = {"window_samples": window, "stride_samples": stride or window}
    return task_of(dataset, **lengths, normalise=normalise, **chosen)


def study_of(dataset, *overrides):
    """Task and settings of a study."""
    settings = settings_of(*overrides)
    task = task_from(dataset, settings)
    return task, settings_for(task, settings)[0]


def two_channels(**changes):
    """The data of the fixture `two_channel_model`."""
    values = {"n_units": 12, "records_per_unit": 8, "duration": 0.5, "n_channels": 2}
    return FakeDataset(**(values | changes))


def windows_of(task, *subsets, protocol="by_unit"):
    """Windows of each subset."""
    return [
        load_windows(task, subset_segments(task, protocol, subset))
        for subset in subsets
    ]


def run(task, settings, *jobs, n_workers=1):
    """Outcomes of jobs of the settings' task, by default one training on by_unit."""
    jobs = jobs or (Job(protocols=("by_unit",), seed=0),)
    study = TARGETS[settings.task].study(task=task, settings=settings)
    return run_jobs(study, jobs, n_workers=n_workers, on_done=lambda _: None)


def plan_of(task, settings):
    """Plan of a study."""
    return TARGETS[settings.task].study(task=task, settings=settings).plan()


def train(dataset, out, *words):
    """``metrics.json`` of the command on a data set in memory, or on several by their names."""
    return runs.metrics_of(runs.train(out, dataset, *SMALL, *TINY_CNN, *words))


def accuracy(task, record, predicted):
    """Balanced accuracy of predicted labels (record,)."""
    label = task.labels()[record]
    one_unit, n_classes = np.zeros_like(label), len(task.class_names)
    confusion = confusion_by_unit(label, predicted, one_unit, n_classes)
    return float(balanced_accuracy(confusion[0]))


def command(capsys, *words):
    """Status, output and error text of a command."""
    capsys.readouterr()
    status = main([str(word) for word in words])
    return status, *capsys.readouterr()
