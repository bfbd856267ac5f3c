"""Log-magnitude spectra of windows, and a network on them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar

import torch
from torch import nn

from diagnose.data.inputs import NetworkInput
from diagnose.data.window_input import Windows
from diagnose.networks.network import FeatureNetwork, convolution_blocks
from gensig.errors import ConfigError


def log_spectrum(windows: torch.Tensor, floor: float) -> torch.Tensor:
    """Logarithm of the magnitude spectrum, tapered by a Hann window.

    Parameters
    ----------
    windows : (..., sample), of about unit RMS
    floor : added to the magnitude, whose root mean square is 1 for white noise of unit RMS; bins
        below it are equal

    Returns
    -------
    (..., bin) from 0 to half the sampling rate, natural logarithm
    """
    n = windows.shape[-1]
    taper = torch.hann_window(n, dtype=windows.dtype, device=windows.device)
    # 3/8 is the mean square of the taper
    magnitude = torch.fft.rfft(windows * taper).abs() / math.sqrt(3 * n / 8)
    return torch.log(magnitude + floor)


class SpectrumCnn(FeatureNetwork):
    """Small convolutional network on the log-magnitude spectrum of the window.

    It is blind to phase and to position in time. The mean over the bins is subtracted from the
    spectrum, channel by channel, so that gain has no effect. The last map is pooled to a fixed
    number of bands, mean and maximum of each: unlike time, frequency is not interchangeable.

    Parameters
    ----------
    n_channels, n_classes : of the data
    input_scale : (channel,) what the input is divided by; stored with the weights
    floor : see `log_spectrum`
    widths, kernels, strides : channels after each block, its kernel in its input's bins, its stride
    n_bands : equal parts of the frequency axis that the class scores distinguish
    dropout : share of pooled features dropped in training
    heads : see `diagnose.settings.HEADS`
    """

    inputs: ClassVar[type[NetworkInput]] = Windows

    def __init__(
        self,
        *,
        n_channels: int,
        n_classes: int,
        input_scale: Sequence[float],
        floor: float,
        widths: Sequence[int],
        kernels: Sequence[int],
        strides: Sequence[int],
        n_bands: int,
        dropout: float,
        heads: Sequence[str] = (),
    ) -> None:
        super().__init__(input_scale)
        if not floor > 0:
            raise ConfigError(f"model: floor must be greater than 0, not {floor!r}")
        self.floor = float(floor)
        self.blocks = convolution_blocks(n_channels, widths, kernels, strides)
        self.mean = nn.AdaptiveAvgPool1d(n_bands)
        self.maximum = nn.AdaptiveMaxPool1d(n_bands)
        n_features = 2 * widths[-1] * n_bands
        self.head = nn.Sequential(
            nn.Flatten(), nn.Dropout(dropout), nn.Linear(n_features, n_classes)
        )
        self.add_heads(heads, n_features, n_classes)

    def look(self, windows: torch.Tensor) -> tuple[torch.Tensor, None]:
        """Mean and maximum of every band of the last block."""
        spectrum = log_spectrum(windows, self.floor)
        maps = self.blocks(spectrum - spectrum.mean(dim=-1, keepdim=True))
        bands = torch.cat([self.mean(maps), self.maximum(maps)], dim=1)
        return bands.flatten(start_dim=1), None
