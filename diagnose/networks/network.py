"""What the networks have in common.

Scaled inputs, features, class scores, and further heads on the same features.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
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
    input_scale : (channel,) typical RMS of each channel, which the input is divided by; stored with the weights

    Attributes
    ----------
    inputs : kind of input that the network reads; the only place where this is said
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
        self.turns: tuple[
            tuple[int, int], ...
        ] = ()  # (index in GEARS, teeth) of each gear that places run around

    @abstractmethod
    def look(self, windows: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor | None]:
        """Features (window, feature) of scaled windows, and what they are the maximum of,
        (window, map, place).
        """

    def forward(self, windows: torch.Tensor) -> torch.Tensor:
        """Unnormalised class scores (window, class) of windows (window, channel, sample)."""
        return self.head(self.look(windows / self.input_scale)[0])

    def answers(self, windows: torch.Tensor) -> dict[str, torch.Tensor]:
        """Everything that the network says of windows, unnormalised.

        Returns
        -------
        classes : (window, class)
        severity, gear : (window, output) of the further heads that there are, see `add_heads`
        places : (window, class, place) where the network sees a class, for one that looks at turns
        """
        features, maps = self.look(windows / self.input_scale)
        said = {
            "classes": self.head(features),
            **{name: head(features) for name, head in self.further.items()},
        }
        return (
            said
            if maps is None or self.places is None
            else {**said, "places": self.places(maps)}
        )

    def add_heads(self, names: Sequence[str], n_features: int, n_classes: int) -> None:
        """Add linear heads: a severity for each class, a score for each of `GEARS`.

        They are drawn last, so that the other weights start as they do without.

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
            "model: widths, kernels and strides must be lists of the same length, one entry a block",
        )
