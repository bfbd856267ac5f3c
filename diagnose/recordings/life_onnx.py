"""A network of remaining lives as an ONNX file: windows in m/s2 and what it is told beside in, hours out."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from diagnose.data.windows import normalised
from diagnose.networks.registry import input_of
from diagnose.recordings.onnx_export import (
    INPUT,
    N_CHECKED,
    TOLERANCE,
    answers_of,
    describe_onnx,
    need_packages,
    raw_examples,
    with_fixed_pooling,
    without_level,
    write_onnx,
)
from gensig.errors import ConfigError, GensigError

if TYPE_CHECKING:
    from diagnose.training.life_store import LifeFacts
    from diagnose.training.remaining_life import LifeNetwork
    from diagnose.training.store import ModelDescription

TOLD, OUTPUT = "told", "remaining_life_h"


class RawLife(nn.Module):
    """A network of remaining lives with what its windows are normalised by, and its early level in h."""

    def __init__(self, model: nn.Module, normalise: str, early_life_h: float) -> None:
        super().__init__()
        self.model, self.normalise, self.level = model, normalise, early_life_h

    def forward(self, acceleration: torch.Tensor, told: torch.Tensor) -> torch.Tensor:
        """(window,) h, not cut, of (window, channel, sample) in m/s2 and (window, column)."""
        return self.level * self.model(without_level(acceleration, self.normalise), told)


def export_life_onnx(model: LifeNetwork, description: ModelDescription, facts: LifeFacts, file: Path) -> float:
    """Write the file, check it, and return the largest difference from torch's answer as a share of the early level.

    Parameters
    ----------
    model, description, facts : of `diagnose.training.life_store.load_life_model`
    file : must not exist; what the numbers mean goes into its metadata

    Raises
    ------
    ConfigError    for a model that looks at turns, or without the packages of the extra ``onnx``
    GensigError    for a network that cannot be written, or whose file does not answer like torch; no file is left
    """
    if reason := input_of(description.model).why_not_exported:
        raise ConfigError(reason)
    need_packages()
    fixed = copy.deepcopy(model).eval()
    fixed.ear = with_fixed_pooling(model.ear, description)
    examples, told = raw_examples(model.ear, description), _told_examples(facts)
    inputs = {INPUT: torch.from_numpy(examples[:2]), TOLD: torch.from_numpy(told[:2])}
    try:
        write_onnx(RawLife(fixed, description.normalise, facts.early_life_h).eval(), inputs, OUTPUT, file)
        describe_onnx(file, description, _described(facts))
        with torch.inference_mode():
            windows = torch.from_numpy(normalised(examples, description.normalise))
            expected = model.eval()(windows, torch.from_numpy(told)).numpy().astype(float)
        found = answers_of(file, {INPUT: examples, TOLD: told}, OUTPUT) / facts.early_life_h
        difference = float(np.max(np.abs(found - expected) / np.maximum(np.abs(expected), 1.0)))
        if not difference <= TOLERANCE:
            raise GensigError(
                f"{file} answered unlike torch by {difference:.2g} of the early level, at most {TOLERANCE:g} is "
                "allowed; it was removed"
            )
    except BaseException:
        file.unlink(missing_ok=True)
        raise
    return difference


def _told_examples(facts: LifeFacts) -> NDArray[np.float32]:
    """(window, column) within the ranges of the training, as many as there are examples of windows."""
    low, high = np.array([facts.told_range[name] for name in facts.told]).reshape(-1, 2).T
    share = np.random.default_rng(1).uniform(size=(N_CHECKED, len(facts.told)))
    return (low + share * (high - low)).astype(np.float32)


def _described(facts: LifeFacts) -> dict[str, object]:
    return {
        TOLD: list(facts.told),
        "told_range": {name: list(ends) for name, ends in facts.told_range.items()},
        "early_life_h": facts.early_life_h,
        "half_width_h": facts.half_width_h,
        "coverage": facts.coverage,
        "intervals_hold": facts.intervals_hold,
        "record": "mean of remaining_life_h over the windows of a record, cut to 0..early_life_h, which stands for "
        "itself and all above; interval: half_width_h to both sides, cut alike",
    }
