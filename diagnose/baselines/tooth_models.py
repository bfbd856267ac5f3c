"""A simple model on the teeth of both gears that their sisters do not explain."""

from __future__ import annotations

from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.base import (
    Input,
    MethodText,
    Parts,
    Role,
    Source,
    StorableBaseline,
)
from diagnose.baselines.estimators import (
    FittedModel,
    linear_model,
    logistic_regression,
)
from diagnose.baselines.features import (
    GEARS,
    Cache,
    FeatureTable,
    Key,
    Rotation,
    known_rotation,
    stretch_table,
)
from diagnose.baselines.tooth_features import GEAR_FEATURES, tooth_features
from diagnose.data.teeth import missing_teeth
from diagnose.data.windows import (
    FloatArray,
    Segments,
    Task,
    read_signal,
    subset_segments,
    subsets_of,
)
from gensig.signals.separation import separate_gears

SAMPLES_PER_TOOTH = 64
NAMES = tuple(f"{gear}/{name}" for gear in GEARS for name in GEAR_FEATURES)
STRENGTH = (
    0.03  # inverse of the penalty, chosen by cross-validation over training machines
)


def why_no_turns(task: Task, protocol: str) -> str | None:
    """Reason in one line why stretches of a protocol hold no turns that are known; else None."""
    dataset = task.dataset
    missing = missing_teeth(dataset)
    if "speed_rpm" not in dataset.column_names:
        missing = missing or "speed_rpm"
    if missing:
        return f"the data set does not say {missing}"
    speed = np.asarray(dataset.column("speed_rpm"), dtype=float)
    turns = []
    for subset in subsets_of(task, protocol):
        segments = subset_segments(task, protocol, subset)
        seconds = (segments.stop - segments.start) / dataset.sampling_rate
        turns.append(np.min(seconds * speed[segments.record] / 60))
    if min(turns) < 1:
        return f"a stretch holds {min(turns):.2g} turns of the pinion, and it needs a whole one"
    return None


def tooth_table(task: Task, segments: Segments, cache: Cache) -> FeatureTable:
    """`tooth_features` of both gears in every stretch; ``cache`` is filled and used."""
    rotation = known_rotation(task)

    def values(key: Key) -> FloatArray:
        return tooth_features(*turns_of(task, rotation, key))

    return stretch_table(task, segments, NAMES, values, cache)


def turns_of(
    task: Task, rotation: Rotation, key: Key, *, name: str = "acceleration"
) -> tuple[FloatArray, FloatArray]:
    """Deviations (channel, tooth, sample) of both gears from the mean passage, at constant speed.

    Parameters
    ----------
    task, key : a stretch
    rotation : of the records of the task
    name : of the signal

    Raises
    ------
    ValueError    for less than a turn of the driving gear
    """
    signal = read_signal(task, *key[1:], name=name)
    driving, driven = rotation.n_teeth(key[1]).values()
    turns = separate_gears(
        signal,
        float(task.dataset.sampling_rate),
        rotation.mesh_frequency(key[1]),
        (driving, driven),
        samples_per_tooth=SAMPLES_PER_TOOTH,
    )
    shape = (len(signal), -1, SAMPLES_PER_TOOTH)
    return turns.driving.reshape(shape), turns.driven.reshape(shape)


def tooth_tables(source: Source) -> Parts:
    """Features of the teeth in every subset."""
    return source.tables(TEETH_INPUT.name, tooth_table, source.subsets)


TEETH_INPUT = Input(name="teeth", make=tooth_tables, why_not=why_no_turns)


@final
class ToothLogistic(StorableBaseline):
    """Logistic regression on `tooth_features`."""

    text = MethodText(
        name="tooth_logistic",
        label="teeth, logistic",
        card_label="teeth",
        meaning="logistic regression on the tooth of either gear that the other teeth explain "
        "least: its distance from them, and its levels in bands and places of the passage; it "
        "knows the speed and the tooth counts, and sees no level.",
    )
    role = Role.RIVAL
    reads = TEETH_INPUT
    _model: FittedModel

    def fit(self, train: FeatureTable, validation: FeatureTable, n_classes: int) -> str:
        """Fit to the training rows; there is no choice."""
        self._model = logistic_regression(train, n_classes, STRENGTH)
        return self._model.name

    def predict_proba(self, table: FeatureTable) -> FloatArray:
        """Probabilities (row, class) of the regression."""
        return self._model.probability(table)

    def tensors(self) -> dict[str, NDArray[np.float32]]:
        """Arrays of `diagnose.baselines.estimators.LinearModel`."""
        return linear_model(self._model, len(NAMES)).tensors()

    @classmethod
    def description(cls, task: Task) -> dict[str, Any]:
        """Kind, and the turns that the features are made of."""
        return {
            "name": cls.text.name,
            "kind": cls.text.name,
            "samples_per_tooth": SAMPLES_PER_TOOTH,
        }
