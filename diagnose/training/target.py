"""Interface of learning targets: classes and remaining lives."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar, Generic, TypeVar

import torch
from torch import nn

from diagnose.data.windows import FloatArray, IntArray, WindowSet
from gensig.options.configuration import Section

Model = TypeVar("Model", bound=nn.Module)


class LearningTarget(ABC, Generic[Model]):
    """Head, loss and answers of a network, for `diagnose.training.train.train_network`.

    Attributes
    ----------
    stream : number of the random draws of a training, which differ from target to target
    """

    stream: ClassVar[int]

    @abstractmethod
    def network(
        self,
        model_config: Section,
        train: WindowSet,
        input_scale: Sequence[float],
    ) -> Model:
        """Network of a configuration with the head of this target, untrained."""

    @abstractmethod
    def loss(
        self,
        model: Model,
        signals: torch.Tensor,
        windows: WindowSet,
        batch: IntArray,
    ) -> torch.Tensor:
        """Loss of a batch.

        Parameters
        ----------
        signals : (window, channel, sample) of the batch, on the network's device
        windows, batch : the training windows, and the numbers of those in the batch
        """

    @abstractmethod
    def answers(
        self, model: Model, signals: torch.Tensor, windows: WindowSet
    ) -> FloatArray:
        """(window, output) answers of a network in evaluation mode.

        Parameters
        ----------
        signals : of all the windows, (window, channel, sample)
        windows : the same ones
        """

    @abstractmethod
    def record_loss(self, answers: FloatArray, windows: WindowSet) -> float:
        """Loss of the answers of windows, combined to those of their records."""

    @abstractmethod
    def temperature(self, answers: FloatArray, windows: WindowSet) -> float:
        """Temperature of the probabilities of records; 1 for a target without them."""


def batch_targets(
    windows: WindowSet, batch: IntArray, device: torch.device
) -> dict[str, torch.Tensor]:
    """Further targets of the windows of a batch, on a device."""
    return {
        name: torch.from_numpy(values[batch]).to(device)
        for name, values in windows.targets.items()
    }
