"""The stored baseline `tooth_logistic`, read where a network is read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from torch import nn

from diagnose.baselines.estimators import LinearModel
from diagnose.baselines.tooth_features import GEAR_FEATURES, tooth_features
from diagnose.baselines.tooth_models import ToothLogistic
from diagnose.data.packed_turns import turns_of
from diagnose.training.store import DESCRIPTION, WEIGHTS, read_description, tensors_of
from gensig.errors import DatasetError

TOOTH_KIND = ToothLogistic.text.name
ARRAYS = ("fill", "mean", "scale", "weight", "bias")


class ToothClassifier(nn.Module):
    """Packed turns (window, channel, point) in, class scores (window, class) out.

    Parameters
    ----------
    linear : on the features of the teeth
    samples_per_tooth : of the turns
    """

    def __init__(self, linear: LinearModel, samples_per_tooth: int) -> None:
        super().__init__()
        self.linear = linear
        self.samples_per_tooth = samples_per_tooth
        # nothing is trained here; torch asks its parameters for the device
        self.bias = nn.Parameter(torch.from_numpy(linear.bias), requires_grad=False)

    def forward(self, windows: torch.Tensor) -> torch.Tensor:
        """Unnormalised log-probabilities (window, class)."""
        packed = windows.cpu().numpy().astype(float)
        rows = [self._features(window) for window in packed]
        return torch.from_numpy(self.linear.scores(np.stack(rows)))

    def _features(self, packed: np.ndarray) -> np.ndarray:
        """(feature,) of the turns (channel, point) of `diagnose.data.packed_turns`."""
        driving, driven, _ = turns_of(packed, self.samples_per_tooth)
        return tooth_features(driving, driven)


def load_tooth_classifier(folder: str | Path) -> ToothClassifier:
    """Classifier of a folder that ``diagnose train`` wrote.

    Raises
    ------
    DatasetError    for a folder without description and arrays that belong together
    """
    description, tensors = read_description(folder), tensors_of(Path(folder))
    shapes = {name: tensors[name].shape for name in ARRAYS if name in tensors}
    n_features, n_classes = 2 * len(GEAR_FEATURES), len(description.class_names)
    row, label = (n_features,), (n_classes,)
    expected = dict(
        zip(ARRAYS, (row, row, row, (n_classes, n_features), label), strict=True)
    )
    if shapes != expected:
        raise DatasetError(
            f"{Path(folder) / WEIGHTS} does not fit {DESCRIPTION}: it holds no "
            f"{TOOTH_KIND} of {n_features} features and {n_classes} classes"
        )
    arrays = {name: tensors[name].astype(float) for name in ARRAYS}
    samples_per_tooth = int(description.model["samples_per_tooth"])
    return ToothClassifier(LinearModel(**arrays), samples_per_tooth)
