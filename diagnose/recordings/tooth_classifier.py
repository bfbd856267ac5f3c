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
from diagnose.data.turns import PER_TOOTH, Turns
from diagnose.training.model_files import DESCRIPTION, one_line, tensors_of
from diagnose.training.store import check_answers, read_description
from gensig.errors import ConfigError, DatasetError
from gensig.options.configuration import whole_number

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
    folder = Path(folder)
    description = read_description(folder)
    n_features, n_classes = 2 * len(GEAR_FEATURES), len(description.class_names)
    row, label = (n_features,), (n_classes,)
    shapes = (row, row, row, (n_classes, n_features), label)
    kinds = {
        name: ("float32", shape) for name, shape in zip(ARRAYS, shapes, strict=True)
    }
    tensors = tensors_of(folder, kinds)
    arrays = {name: tensors[name].astype(float) for name in ARRAYS}
    try:
        samples_per_tooth = whole_number(
            PER_TOOTH, description.model[PER_TOOTH], at_least=1
        )
    except (ConfigError, KeyError, TypeError, ValueError) as error:
        raise DatasetError(
            f"{folder / DESCRIPTION} does not describe a {TOOTH_KIND}: {one_line(error)}"
        ) from None
    model = ToothClassifier(LinearModel(**arrays), samples_per_tooth)
    check_answers(model, Turns.of, description, folder)
    return model
