"""Base class of networks: scaled inputs, features, class scores and further heads."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import ClassVar

import torch
from torch import nn

from diagnose.data.inputs import NetworkInput
from diagnose.data.targets import GEARS
from gensig.errors import ConfigError

HEADS = ("severity", "gear")


class Network(nn.Module, ABC):
    """Windows (window, channel, sample) in, class scores (window, class) out.

    Parameters
    ----------
    input_scale : (channel,) typical RMS of each channel, which the input is divided by; stored
        with the weights

    Attributes
    ----------
    inputs : kind of input that the network reads; nothing else declares it
    """

    inputs: ClassVar[type[NetworkInput]]
    input_scale: torch.Tensor
    head: nn.Module
    places: nn.Module | None

    def __init__(self, input_scale: Sequence[float]) -> None:
        super().__init__()
        self.register_buffer(
            "input_scale",
            torch.tensor(list(input_scale), dtype=torch.float32)[:, None],
        )
        self.further = nn.ModuleDict()
        self.places = None
        # (index in GEARS, teeth) of each gear that the scores of `places` run around
        self.turns: tuple[tuple[int, int], ...] = ()

    @abstractmethod
    def look(self, windows: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor | None]:
        """Features (window, feature) of scaled windows.

        Also the maps (window, map, position) that they are the maximum of, or None.
        """

    def forward(self, windows: torch.Tensor) -> torch.Tensor:
        """Unnormalised class scores (window, class) of windows (window, channel, sample)."""
        return self.head(self.look(windows / self.input_scale)[0])

    def answers(self, windows: torch.Tensor) -> dict[str, torch.Tensor]:
        """All outputs of the network for windows, unnormalised.

        Returns
        -------
        classes : (window, class)
        severity, gear : (window, output) of further heads, if there are any; see `add_heads`
        places : (window, class, position) class scores along the turns, for a network on turns
        """
        features, maps = self.look(windows / self.input_scale)
        answers = {"classes": self.head(features)}
        answers |= {name: head(features) for name, head in self.further.items()}
        if maps is not None and self.places is not None:
            answers["places"] = self.places(maps)
        return answers

    def add_heads(self, names: Sequence[str], n_features: int, n_classes: int) -> None:
        """Add linear heads: a severity for each class, a score for each of `GEARS`.

        They are drawn last, so that the other weights start as without them.

        Raises
        ------
        ConfigError    for a head that does not exist
        """
        n_outputs = dict(zip(HEADS, (n_classes, len(GEARS)), strict=True))
        for name in names:
            if name not in n_outputs:
                raise ConfigError(f"no head '{name}'; there is {', '.join(HEADS)}")
            self.further[name] = nn.Linear(n_features, n_outputs[name])


def check_blocks(*options: Sequence[int]) -> None:
    """Refuse lists, of widths, kernels and strides, that are not equally long.

    Raises
    ------
    ConfigError    for lists of different lengths, and for empty ones
    """
    lengths = {len(values) for values in options}
    if len(lengths) > 1 or 0 in lengths:
        raise ConfigError(
            "model: widths, kernels and strides must be lists of the same length, "
            "one entry a block"
        )


def convolution_blocks(
    n_channels: int,
    widths: Sequence[int],
    kernels: Sequence[int],
    strides: Sequence[int],
    start: Callable[[torch.Tensor], None] = lambda weight: None,
) -> nn.Sequential:
    """Convolutions padded by half their kernels, each with batch normalisation and ReLU.

    Parameters
    ----------
    n_channels : of the input
    widths, kernels, strides : channels after each block, its kernel in its input's samples, its
        stride
    start : fills the weights of the first convolution, before those of the others are drawn
    """
    check_blocks(widths, kernels, strides)
    layers: list[nn.Module] = []
    for n_out, kernel, stride in zip(widths, kernels, strides, strict=True):
        convolution = nn.Conv1d(
            n_channels, n_out, kernel, stride, padding=kernel // 2, bias=False
        )
        if not layers:
            start(convolution.weight)
        layers += [convolution, nn.BatchNorm1d(n_out), nn.ReLU()]
        n_channels = n_out
    return nn.Sequential(*layers)
