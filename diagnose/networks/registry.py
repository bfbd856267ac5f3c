"""Networks: vibration windows in, class scores out."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import torch
from torch import nn

from diagnose.networks.network import Network
from diagnose.networks.order_cnn import OrderCnn
from diagnose.networks.spectrum import SpectrumCnn
from diagnose.networks.wdcnn import Wdcnn
from gensig.errors import ConfigError


class SmallCnn(Network):
    """One-dimensional convolutional network with a wide, strided first kernel.

    The first kernel spans a mesh period rather than a few samples, as in Zhang, Peng, Li, Chen & Zhang (2017), "A new
    deep learning model for fault diagnosis with good anti-noise and domain adaptation ability on raw vibration
    signals", Sensors 17 (2), 425. Pooling over the window takes the mean and the maximum: a fault shows once a turn.

    Parameters
    ----------
    n_channels, n_classes : of the data
    input_scale : (channel,) typical RMS of each channel, which the input is divided by; stored with the weights
    widths : channels after each block, the first block included
    kernels : kernel of each block, in its input samples
    strides : stride of each block
    dropout : share of pooled features dropped in training
    heads : see `diagnose.settings.HEADS`
    """

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
        if not len(widths) == len(kernels) == len(strides) > 0:
            raise ConfigError("model: widths, kernels and strides must be lists of the same length, one entry a block")
        blocks: list[nn.Module] = []
        for n_in, n_out, kernel, stride in zip((n_channels, *widths), widths, kernels, strides, strict=False):
            convolution = nn.Conv1d(n_in, n_out, kernel, stride=stride, padding=kernel // 2, bias=False)
            if not blocks:
                _start_as_band_passes(convolution.weight)
            blocks += [convolution, nn.BatchNorm1d(n_out), nn.ReLU()]
        self.blocks = nn.Sequential(*blocks)
        self.head = nn.Sequential(nn.Dropout(dropout), nn.Linear(2 * widths[-1], n_classes))
        self.add_heads(heads, 2 * widths[-1], n_classes)

    def look(self, windows: torch.Tensor) -> tuple[torch.Tensor, None]:
        """Mean and maximum over the window of the last block."""
        maps = self.blocks(windows)
        return torch.cat([maps.mean(dim=-1), maps.amax(dim=-1)], dim=1), None


def _start_as_band_passes(weight: torch.Tensor) -> None:
    """Fill (filter, channel, sample) with windowed cosines, evenly spaced in frequency, of random phase and size.

    Random kernels all hear the mesh tones first, and learning to listen elsewhere takes most of a training. After the
    initialisation of SincNet: Ravanelli & Bengio (2018), "Speaker recognition from raw waveform with SincNet".
    """
    n_filters, n_channels, kernel = weight.shape
    sample = torch.arange(kernel) - (kernel - 1) / 2
    frequency = (torch.arange(n_filters) + 0.5) / (2 * n_filters)
    phase = 2 * math.pi * torch.rand(n_filters, n_channels, 1)
    carrier = torch.cos(2 * math.pi * frequency[:, None, None] * sample + phase)
    size = torch.randn(n_filters, n_channels, 1) / math.sqrt(n_channels * kernel)
    with torch.no_grad():
        weight.copy_(2 * size * carrier * torch.hann_window(kernel, periodic=False))


MODELS: dict[str, Callable[..., Network]] = {
    "small_cnn": SmallCnn,
    "wdcnn": Wdcnn,
    "spectrum_cnn": SpectrumCnn,
    "order_cnn": OrderCnn,
}


def build_model(
    config: Mapping[str, Any], *, n_channels: int, n_classes: int, input_scale: Sequence[float] | None = None
) -> Network:
    """Network of a configuration: ``kind`` names an entry of `MODELS`, ``name`` is only shown, the rest are parameters.

    Raises
    ------
    ConfigError    for an unknown kind or parameters that it does not take
    """
    parameters = {key: value for key, value in config.items() if key not in ("kind", "name")}
    scale = [1.0] * n_channels if input_scale is None else input_scale
    kind = config.get("kind")
    if kind not in MODELS:
        raise ConfigError(f"no model kind '{kind}'; there is {', '.join(MODELS)}")
    try:
        return MODELS[kind](n_channels=n_channels, n_classes=n_classes, input_scale=scale, **parameters)
    except (TypeError, ValueError, RuntimeError) as error:
        raise ConfigError(f"model {kind}: {' '.join(str(error).split())}") from None


def check_window(model: nn.Module, n_channels: int, window_samples: int) -> None:
    """Refuse a window that the network cannot take, before anything is trained.

    Raises
    ------
    ConfigError    if it is too short
    """
    try:
        with torch.inference_mode():
            model.eval()(torch.zeros(1, n_channels, window_samples))
    except RuntimeError:
        raise ConfigError(
            f"window_samples={window_samples} is too short for this network; make it longer or choose another model"
        ) from None
