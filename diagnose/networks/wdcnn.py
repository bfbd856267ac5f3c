"""WDCNN, the network that most papers on raw vibration compare with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import torch
from torch import nn

from diagnose.data.inputs import NetworkInput
from diagnose.data.window_input import Windows
from diagnose.networks.network import FeatureNetwork

FIRST_KERNEL, FIRST_STRIDE, FIRST_PADDING = 64, 16, 24


class Wdcnn(FeatureNetwork):
    """Deep convolutional network with a wide first kernel, as published, for several channels.

    A first convolution of 64 samples with stride 16, then convolutions of 3 samples, the last one
    without padding. Each is followed by batch normalisation, ReLU and a maximum over 2; a hidden
    layer and the class scores follow. The initial weights are the defaults of torch.

    For one channel and the published 2048 samples, layers and sizes are those of the paper. Its
    hidden layer sees the 3 positions that such a window leaves. Other windows leave more or
    fewer. Their last map is pooled to the same number of positions by the maximum over equal
    parts. This is ours, and does nothing at 2048 samples.

    Parameters
    ----------
    n_channels, n_classes : of the data
    input_scale : (channel,) what the input is divided by; stored with the weights
    widths : channels after each convolution, the first one included
    n_positions : of the last map that the hidden layer sees
    n_hidden : units of the hidden layer
    heads : see `diagnose.settings.HEADS`

    Source: Zhang, Peng, Li, Chen & Zhang (2017), "A new deep learning model for fault diagnosis
    with good anti-noise and domain adaptation ability on raw vibration signals", Sensors 17 (2),
    425, table 2.
    """

    inputs: ClassVar[type[NetworkInput]] = Windows

    def __init__(
        self,
        *,
        n_channels: int,
        n_classes: int,
        input_scale: Sequence[float],
        widths: Sequence[int],
        n_positions: int,
        n_hidden: int,
        heads: Sequence[str] = (),
    ) -> None:
        super().__init__(input_scale)
        layers: list[nn.Module] = []
        for index, n_out in enumerate(widths):
            kernel, stride, padding = 3, 1, 1
            if index == 0:
                kernel, stride, padding = FIRST_KERNEL, FIRST_STRIDE, FIRST_PADDING
            elif index == len(widths) - 1:
                padding = 0
            layers += [
                nn.Conv1d(n_channels, n_out, kernel, stride, padding),
                nn.BatchNorm1d(n_out),
                nn.ReLU(),
                nn.MaxPool1d(2),
            ]
            n_channels = n_out
        self.blocks = nn.Sequential(*layers)
        self.hidden = nn.Sequential(
            nn.AdaptiveMaxPool1d(n_positions),
            nn.Flatten(),
            nn.Linear(n_positions * widths[-1], n_hidden),
            nn.BatchNorm1d(n_hidden),
            nn.ReLU(),
        )
        self.head = nn.Linear(n_hidden, n_classes)
        self.add_heads(heads, n_hidden, n_classes)

    def look(self, windows: torch.Tensor) -> tuple[torch.Tensor, None]:
        """Units of the hidden layer."""
        return self.hidden(self.blocks(windows)), None
