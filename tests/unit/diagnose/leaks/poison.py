"""Data sets of which one subset is garbage, and fingerprints of all that a study fits.

Text columns keep their values: they say which machine a record is of, and so decide the split.
The last class keeps its label: it is the one that the protocol open_set withholds.
"""

from contextlib import contextmanager
from dataclasses import asdict, fields

import joblib
import numpy as np
import pytest
from fake_dataset import CompleteDataset
from fake_lives import FakeLives
from novelty_sets import OpenDataset
from runs import LIFE
from runs import settings_of as life_settings_of
from small_studies import TINY_CNN, run, study_of

from diagnose.baselines import base as baseline_inputs
from diagnose.baselines.base import Role
from diagnose.baselines.registry import BASELINES, baseline_names
from diagnose.data import lives as life_data
from diagnose.data.windows import Segments, subset_segments
from diagnose.studies import class_jobs, life_jobs, novelty_metrics
from diagnose.studies import novelty as novelty_runs
from diagnose.studies.class_jobs import ORACLE, PROBE
from diagnose.studies.jobs import Job
from diagnose.studies.study import task_from

HUGE = 1e6
FASTER = 1.5  # a speed must stay one at which gears make whole turns
AS_THEY_ARE = ("life_failed",)  # the same for all records of a life
LEVEL_KEPT = "normalise=none"  # else no input is divided by the level of other records
# how many shuffles are drawn, the test decides
NO_SHUFFLE = "shuffle_control=false"
WORDS = (*TINY_CNN, LEVEL_KEPT, NO_SHUFFLE, "epochs=2")
RIVALS = f"baselines=[{','.join(baseline_names(Role.RIVAL))}]"
BASELINE_JOBS = tuple(
    Job(protocols=("by_unit",), seed=None, control=control)
    for control in ("", PROBE, ORACLE)
)
OPEN = ("healthy_only", "open_set")
OF_TEST = ("record", "answers", "further", "n_followed", "windows")


class Poisoned:
    """A data set in memory whose records of one subset have other labels, rows and signals."""

    def __init__(self, dataset, subset, *, signals_alone=False):
        self._dataset = dataset
        record = [row[0] for row in dataset.split("by_unit")[subset]]
        self.is_poisoned = np.isin(np.arange(dataset.n_records), record)
        self.columns = dict(dataset.columns)
        if signals_alone:
            return
        for name, values in dataset.columns.items():
            garbage = self._garbage(name, values)
            self.columns[name] = np.where(self.is_poisoned, garbage, values)

    def __getattr__(self, name):
        return getattr(self._dataset, name)

    def _garbage(self, name, values):
        if name == "label":
            n_changed = max(len(self._dataset.class_names) - 1, 1)
            return np.where(values < n_changed, (values + 1) % n_changed, values)
        if name in AS_THEY_ARE or values.dtype.kind in "US":
            return values
        if name == "speed_rpm":
            return FASTER * values
        if values.dtype.kind == "f":
            return HUGE * (1 + values)
        return values[::-1]

    def column(self, name):
        return self.columns[name]

    def signals(self, record_index, *args, **which):
        signal = self._dataset.signals(record_index, *args, **which)
        if not self.is_poisoned[record_index]:
            return signal
        rng = np.random.default_rng(record_index)
        return (HUGE * rng.standard_normal(signal.shape)).astype(np.float32)


def with_garbage(dataset, subset):
    """The data set with garbage in a subset; as it is for None."""
    if subset is None:
        return dataset
    return Poisoned(dataset, subset)


@contextmanager
def training_on(leaked):
    """Leak put in on purpose: the training part of every study holds a second subset too."""

    def with_leak(task, protocol, subset):
        part = subset_segments(task, protocol, subset)
        if subset != "train":
            return part
        second = subset_segments(task, protocol, leaked)
        columns = {
            name: np.concatenate([getattr(part, name), getattr(second, name)])
            for name in ("record", "start", "stop")
        }
        return Segments(**columns)

    with pytest.MonkeyPatch.context() as patch:
        for module in (class_jobs, baseline_inputs, novelty_runs, life_data):
            patch.setattr(module, "subset_segments", with_leak)
        yield


def prints(values):
    """Fingerprint of each value of a dictionary."""
    return {name: joblib.hash(value) for name, value in values.items()}


def of_fields(outcome):
    """Fingerprint of each field of an outcome that is known before the test is scored."""
    values = {field.name: getattr(outcome, field.name) for field in fields(outcome)}
    values |= values.pop("parts")
    for field in ("domain", "hours"):
        if (part := values.pop(field)) is not None:
            values |= {f"{field}_{name}": each for name, each in asdict(part).items()}
    return prints({name: values[name] for name in values if name not in OF_TEST})


def baselines(subset, *words):
    """Fits of every registered baseline, and the tables that they are made from."""
    complete = CompleteDataset(n_channels=1, duration=0.3)
    seen = {}

    def watching(fit):
        def watched(self, train, validation, n_classes):
            detail = fit(self, train, validation, n_classes)
            fitted = {"fit": (detail, vars(self))}
            tables = {"train": train, "validation": validation}
            seen[self.text.name] = prints(fitted | tables)
            return detail

        return watched

    with pytest.MonkeyPatch.context() as patch:
        for baseline in BASELINES.values():
            patch.setattr(baseline, "fit", watching(baseline.fit))
        study = study_of(with_garbage(complete, subset), *WORDS, RIVALS, *words)
        run(*study, *BASELINE_JOBS)
    assert set(seen) == set(BASELINES)
    return seen


def network(subset, *words):
    """Training of a network on classes."""
    complete = CompleteDataset(n_channels=2, duration=0.3)
    (prediction,) = run(*study_of(with_garbage(complete, subset), *WORDS, *words))
    return {"network": of_fields(prediction)}


def novelty(subset, *words):
    """Scores of novelty of the validation records, and the thresholds that follow from them."""
    dataset = with_garbage(OpenDataset(n_channels=2), subset)
    kinds = [Job(protocols=(name,), seed=seed) for name in OPEN for seed in (None, 0)]
    runs = run(*study_of(dataset, *WORDS, *words), *kinds)
    return {
        f"{each.protocol}/{each.method}": of_fields(each)
        | prints({"score": each.answers, "threshold": novelty_metrics.threshold(each)})
        for each in runs
    }


def lives(subset, *words):
    """Predictions of remaining lives, and the regressions behind them."""
    dataset = with_garbage(FakeLives(n_channels=2), subset)
    settings = life_settings_of(*LIFE, LEVEL_KEPT, "epochs=2", *words)
    seen = {}
    fit_regression = life_jobs.fit_regression

    def watched(train, validation, lives, target):
        detail, predict = fit_regression(train, validation, lives, target)
        tables = {
            "fit": (detail, predict(train)),
            "train": (train, target[train.record]),
            "validation": (validation, target[validation.record]),
        }
        seen[f"regression {len(seen)}"] = prints(tables)
        return detail, predict

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(life_jobs, "fit_regression", watched)
        task = task_from(dataset, settings)
        planned = [Job(protocols=("by_unit",), seed=seed) for seed in (None, 0)]
        for prediction in run(task, settings, *planned):
            seen[prediction.method] = of_fields(prediction)
    return seen


STUDIES = {study.__name__: study for study in (baselines, network, novelty, lives)}


def changes(study, subset, *words):
    """Method -> fitted parts of it that garbage in a subset changes."""
    clean, poisoned = STUDIES[study](None, *words), STUDIES[study](subset, *words)
    assert clean.keys() == poisoned.keys()
    return {
        method: {name for name in known if known[name] != poisoned[method][name]}
        for method, known in clean.items()
    }
