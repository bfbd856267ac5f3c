"""Remaining life as learning target: a share of the early level, by least squares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, final

import numpy as np
import torch
from torch import nn

from diagnose.data.windows import FloatArray, IntArray, WindowSet
from diagnose.networks.registry import build_model
from diagnose.scoring.hours import LifeFacts
from diagnose.scoring.metrics import over_records
from diagnose.training.store import ModelDescription, load_network
from diagnose.training.target import LearningTarget
from gensig.options.configuration import Section

N_FEATURES = 16  # numbers that the head takes of the network; assumed
AT_A_TIME = 32  # windows answered in one step


class LifeNetwork(nn.Module):
    """Windows (window, channel, sample) and conditions (window, column) in, a share of life out.

    Parameters
    ----------
    model_config : of `diagnose.networks.registry.build_model`, for the network on the windows
    input_scale : (channel,) typical RMS of each channel
    mean, spread : (column,) of the conditions in the training
    """

    ear: nn.Module  # named so in stored weights
    mean: torch.Tensor
    spread: torch.Tensor

    def __init__(
        self,
        model_config: Section,
        input_scale: Sequence[float],
        mean: FloatArray,
        spread: FloatArray,
    ) -> None:
        super().__init__()
        self.ear = build_model(
            model_config,
            n_channels=len(input_scale),
            n_classes=N_FEATURES,
            input_scale=input_scale,
        )
        self.register_buffer("mean", torch.tensor(mean, dtype=torch.float32))
        self.register_buffer("spread", torch.tensor(spread, dtype=torch.float32))
        self.head = nn.Sequential(
            nn.ReLU(),
            nn.Linear(N_FEATURES + len(mean), N_FEATURES),
            nn.ReLU(),
            nn.Linear(N_FEATURES, 1),
        )

    def forward(self, windows: torch.Tensor, conditions: torch.Tensor) -> torch.Tensor:
        """(window,) remaining life as a share of the early level, not cut."""
        known = (conditions - self.mean) / self.spread
        return self.head(torch.cat([self.ear(windows), known], dim=1)).squeeze(1)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class RemainingLife(LearningTarget[LifeNetwork]):
    """Remaining life of records, cut at an early level.

    Attributes
    ----------
    conditions : (record, column) values known besides the signal, of all records of the data set
    share : (record,) remaining life as a share of the early level
    weight : (record,) weights; those of a life have the same sum for every life of a subset
    """

    conditions: FloatArray
    share: FloatArray
    weight: FloatArray
    stream: ClassVar[int] = 4

    def network(
        self,
        model_config: Section,
        train: WindowSet,
        input_scale: Sequence[float],
    ) -> LifeNetwork:
        """Network with one output, and the mean and spread of the training conditions."""
        seen = self.conditions[np.unique(train.record)]
        spread = seen.std(axis=0)
        spread = np.where(spread > 0, spread, 1.0)
        return LifeNetwork(model_config, input_scale, seen.mean(axis=0), spread)

    def loss(
        self,
        model: LifeNetwork,
        signals: torch.Tensor,
        windows: WindowSet,
        batch: IntArray,
    ) -> torch.Tensor:
        """Weighted mean of the squared errors."""
        record = windows.record[batch]
        conditions, share, weight = (
            torch.from_numpy(values[record].astype(np.float32)).to(signals.device)
            for values in (self.conditions, self.share, self.weight)
        )
        error = model(signals, conditions) - share
        return (weight * error.square()).mean()

    def answers(
        self, model: LifeNetwork, signals: torch.Tensor, windows: WindowSet
    ) -> FloatArray:
        """(window, 1) shares of the early level, not cut."""
        return _shares(model, signals, self.conditions[windows.record])[:, None]

    def record_loss(self, answers: FloatArray, windows: WindowSet) -> float:
        """Root of the mean squared error of records, every life counting the same."""
        record, share = _over_records(answers[:, 0], windows)
        error = share - self.share[record]
        return float(np.sqrt(np.average(error**2, weights=self.weight[record])))

    def temperature(self, answers: FloatArray, windows: WindowSet) -> float:
        """1: there are no probabilities."""
        return 1.0


def shares_of_windows(
    model: LifeNetwork,
    windows: WindowSet,
    conditions: FloatArray,
) -> FloatArray:
    """(window,) shares of the early level, not cut; ``conditions`` (record, column)."""
    of_window = conditions[windows.record]
    shares = []
    for block in windows.blocks(AT_A_TIME):
        signals = torch.from_numpy(windows.cut(block))
        shares.append(_shares(model, signals, of_window[block]))
    return np.concatenate(shares)


def shares_of_records(
    model: LifeNetwork,
    windows: WindowSet,
    conditions: FloatArray,
) -> tuple[IntArray, FloatArray]:
    """Records (record,), sorted, and their shares: the mean over their windows, cut to 0..1."""
    return _over_records(shares_of_windows(model, windows, conditions), windows)


def _over_records(share: FloatArray, windows: WindowSet) -> tuple[IntArray, FloatArray]:
    record, mean = over_records(share[:, None], windows.record)
    return record, np.clip(mean[:, 0], 0.0, 1.0)


def _shares(
    model: LifeNetwork, signals: torch.Tensor, conditions: FloatArray
) -> FloatArray:
    """(window,) shares of windows (window, channel, sample) and conditions (window, column)."""
    model.eval()
    device = model.mean.device
    known = torch.from_numpy(conditions.astype(np.float32))
    n_blocks = -(-len(signals) // AT_A_TIME)
    blocks = (signals.tensor_split(n_blocks), known.tensor_split(n_blocks))
    with torch.inference_mode():
        shares = [
            model(part.to(device), values.to(device)).cpu()
            for part, values in zip(*blocks, strict=True)
        ]
    return torch.cat(shares).numpy().astype(float)


def load_life_model(
    folder: str | Path,
) -> tuple[LifeNetwork, ModelDescription, LifeFacts]:
    """Network in evaluation mode, its description, and the facts of its hours."""

    def build(description: ModelDescription) -> LifeNetwork:
        told = np.zeros(len(_facts(description).told))
        ones = [1.0] * len(description.channel_names)
        return LifeNetwork(description.network, ones, told, told + 1)

    model, description = load_network(folder, "remaining_life", build)
    return model, description, _facts(description)


def _facts(description: ModelDescription) -> LifeFacts:
    assert description.remaining_life is not None
    return description.remaining_life
