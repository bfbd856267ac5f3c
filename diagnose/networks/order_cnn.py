"""A network on the turns of both gears: the same filters on every tooth, then the maximum."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import torch
from torch import nn
from torch.nn.functional import pad, relu

from diagnose.data.inputs import NetworkInput
from diagnose.data.packed_turns import HEADER
from diagnose.data.targets import GEARS
from diagnose.data.turns import Turns
from diagnose.networks.network import FeatureNetwork, check_blocks
from gensig.errors import ConfigError


class OrderCnn(FeatureNetwork):
    """Convolutions around the turn of either gear, compared with the gear's mean; maximum over
    its teeth.

    The input is `diagnose.data.packed_turns`: the difference of each tooth from the mean
    passage, gear by gear, and that passage. It is the same at every speed, except for the
    frequency response. Responses of the first filters are compressed by the inverse hyperbolic
    sine: impacts of tooth engagement are 30 dB above the effects of cracks and pits between them.

    Parameters
    ----------
    n_channels, n_classes : of the data
    input_scale : (channel,) what the input is divided by; stored with the weights
    n_teeth : of the driving and the driven gear
    samples_per_tooth : of the turns
    gears : whose turns are looked at, pinion or wheel or both
    widths, kernels, strides : channels after each block, its kernel in its input's samples, its
        stride
    compression : factor on the first responses before they are compressed, at the start of a
        training
    dropout : share of pooled features dropped in training
    heads : see `diagnose.settings.HEADS`
    """

    inputs: ClassVar[type[NetworkInput]] = Turns

    def __init__(
        self,
        *,
        n_channels: int,
        n_classes: int,
        input_scale: Sequence[float],
        n_teeth: Sequence[int],
        samples_per_tooth: int,
        gears: Sequence[str],
        widths: Sequence[int],
        kernels: Sequence[int],
        strides: Sequence[int],
        compression: float,
        dropout: float,
        heads: Sequence[str] = (),
    ) -> None:
        super().__init__(input_scale)
        check_blocks(widths, kernels, strides)
        if any(kernel % 2 == 0 for kernel in kernels):
            raise ConfigError(
                "model: kernels must be odd, so that a turn stays as long as it is"
            )
        self.n_points = [HEADER, *(z * samples_per_tooth for z in (*n_teeth, 1))]
        self.n_teeth = list(n_teeth)
        known, named = set(GEARS[1:]), set(gears)
        if not named or not named <= known or len(named) < len(gears):
            raise ConfigError(
                f"model: gears must be a list out of {', '.join(GEARS[1:])}"
            )
        self.gears = [GEARS.index(gear) - 1 for gear in gears]
        self.turns = tuple((gear + 1, n_teeth[gear]) for gear in self.gears)
        self.kernels = list(kernels)
        inputs = (2 * n_channels, *widths[:-1])
        blocks = zip(inputs, widths, kernels, strides, strict=True)
        self.convolutions = nn.ModuleList(
            nn.Conv1d(n_in, n_out, kernel, stride=stride, bias=False)
            for n_in, n_out, kernel, stride in blocks
        )
        self.norms = nn.ModuleList(nn.BatchNorm1d(width) for width in widths)
        self.compression = nn.Parameter(torch.full((widths[0], 1), float(compression)))
        self.compare = nn.Conv1d(2 * widths[-1], widths[-1], 1, bias=False)
        self.compare_norm = nn.BatchNorm1d(widths[-1])
        n_features = len(gears) * widths[-1]
        self.head = nn.Sequential(nn.Dropout(dropout), nn.Linear(n_features, n_classes))
        self.places = nn.Conv1d(widths[-1], n_classes, 1)
        self.add_heads(heads, n_features, n_classes)

    def look(self, windows: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Maximum over each gear's turn, one gear after the other, and the maps of all turns."""
        _, *turns, mesh = windows.split(self.n_points, dim=-1)
        parts = []
        for gear in self.gears:
            mean_passage = mesh.repeat(1, 1, self.n_teeth[gear])
            parts.append(torch.cat([turns[gear], mean_passage], dim=1))
        blocks = zip(self.convolutions, self.norms, self.kernels, strict=True)
        for index, (convolution, norm, kernel) in enumerate(blocks):
            parts = [convolution(_around(part, kernel)) for part in parts]
            if index == 0:
                parts = [torch.asinh(self.compression * part) for part in parts]
            parts = _together(norm, parts)
        compared = []
        for part in parts:
            mean = part.mean(dim=-1, keepdim=True).expand_as(part)
            compared.append(self.compare(torch.cat([part, mean], dim=1)))
        parts = _together(self.compare_norm, compared)
        features = torch.cat([part.amax(dim=-1) for part in parts], dim=1)
        return features, torch.cat(parts, dim=-1)


def _together(norm: nn.Module, parts: Sequence[torch.Tensor]) -> list[torch.Tensor]:
    """Normalise the turns of all gears by the same statistics, then rectify."""
    lengths = [part.shape[-1] for part in parts]
    return list(relu(norm(torch.cat(list(parts), dim=-1))).split(lengths, dim=-1))


def _around(x: torch.Tensor, kernel: int) -> torch.Tensor:
    """A turn continued periodically by half a kernel on either side."""
    return pad(x, (kernel // 2, kernel // 2), mode="circular")
