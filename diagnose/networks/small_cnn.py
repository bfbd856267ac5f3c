"""A small convolutional network on windows of time, for records without turns too."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar

import torch
from torch import nn

from diagnose.data.inputs import NetworkInput
from diagnose.data.window_input import Windows
from diagnose.networks.network import FeatureNetwork, check_blocks


class SmallCnn(FeatureNetwork):
    """One-dimensional convolutional network with a wide, strided first kernel.

    The first kernel spans a mesh period rather than a few samples. Pooling over the window takes
    the mean and the maximum: a fault shows once a turn.

    Parameters
    ----------
    n_channels, n_classes : of the data
    input_scale : (channel,) typical RMS, which the input is divided by; stored with the weights
    widths : channels after each block, the first block included
    kernels : kernel of each block, in its input samples
    strides : stride of each block
    dropout : share of pooled features dropped in training
    heads : see `diagnose.settings.HEADS`

    Source of the first kernel: Zhang, Peng, Li, Chen & Zhang (2017), "A new deep learning model for
    fault diagnosis with good anti-noise and domain adaptation ability on raw vibration signals",
    Sensors 17 (2), 425.
    """

    inputs: ClassVar[type[NetworkInput]] = Windows

    def __init__(
        self,
        *,
        n_channels: int,
        n_classes: int,
        input_scale: Sequence[float],
        widths: Sequence[int],
        kernels: Sequence[int],
        strides: Sequence[int],
        dropout: float,
        heads: Sequence[str] = (),
    ) -> None:
        super().__init__(input_scale)
        check_blocks(widths, kernels, strides)
        layers: list[nn.Module] = []
        for n_out, kernel, stride in zip(widths, kernels, strides, strict=True):
            convolution = nn.Conv1d(
                n_channels, n_out, kernel, stride, padding=kernel // 2, bias=False
            )
            if not layers:
                _start_as_band_passes(convolution.weight)
            layers += [convolution, nn.BatchNorm1d(n_out), nn.ReLU()]
            n_channels = n_out
        self.blocks = nn.Sequential(*layers)
        n_features = 2 * widths[-1]
        self.head = nn.Sequential(nn.Dropout(dropout), nn.Linear(n_features, n_classes))
        self.add_heads(heads, n_features, n_classes)

    def look(self, windows: torch.Tensor) -> tuple[torch.Tensor, None]:
        """Mean and maximum over the window of the last block."""
        maps = self.blocks(windows)
        return torch.cat([maps.mean(dim=-1), maps.amax(dim=-1)], dim=1), None


def _start_as_band_passes(weight: torch.Tensor) -> None:
    """Fill (filter, channel, sample) with windowed cosines of random phase and size.

    Their frequencies are evenly spaced. Random kernels all respond to the mesh tones first, and
    learning other frequencies takes most of a training.

    Source: the initialisation of SincNet, Ravanelli & Bengio (2018), "Speaker recognition from raw
    waveform with SincNet".
    """
    n_filters, n_channels, kernel = weight.shape
    sample = torch.arange(kernel) - (kernel - 1) / 2
    frequency = (torch.arange(n_filters) + 0.5) / (2 * n_filters)
    phase = 2 * math.pi * torch.rand(n_filters, n_channels, 1)
    carrier = torch.cos(2 * math.pi * frequency[:, None, None] * sample + phase)
    size = torch.randn(n_filters, n_channels, 1) / math.sqrt(n_channels * kernel)
    with torch.no_grad():
        weight.copy_(2 * size * carrier * torch.hann_window(kernel, periodic=False))
