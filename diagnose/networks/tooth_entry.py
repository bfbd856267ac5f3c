"""Estimate of the place in a passage at which a tooth comes into mesh."""

from __future__ import annotations

from typing import final

import torch
from torch import nn
from torch.nn.functional import cross_entropy, pad, relu

KERNELS = (9, 9, 5)  # of three circular convolutions; assumed


@final
class EntryEstimator(nn.Module):
    """Place of the entry in the mean passage of a mesh, by circular convolutions.

    Whatever turns the passage turns the scores of the places by as much. The network thus needs
    no example of every place.

    Parameters
    ----------
    n_channels : of the vibration
    n_places : samples of a passage
    width : filters of each convolution
    """

    def __init__(self, n_channels: int, n_places: int, width: int) -> None:
        super().__init__()
        self.n_places = n_places
        inputs = (n_channels, width, width)
        self.convolutions = nn.ModuleList(
            nn.Conv1d(n_in, width, kernel)
            for n_in, kernel in zip(inputs, KERNELS, strict=True)
        )
        self.score = nn.Conv1d(width, 1, 1)

    def forward(self, mesh: torch.Tensor) -> torch.Tensor:
        """Scores (window, place) of mean passages (window, channel, sample)."""
        maps = _of_unit_power(mesh)
        for convolution, kernel in zip(self.convolutions, KERNELS, strict=True):
            half = kernel // 2
            maps = relu(convolution(pad(maps, (half, half), mode="circular")))
        return self.score(maps).squeeze(1)

    def entry(self, mesh: torch.Tensor) -> torch.Tensor:
        """(window,) sample of the passage with the largest score."""
        return self(mesh).argmax(dim=1)

    def loss(self, mesh: torch.Tensor, entry: torch.Tensor) -> torch.Tensor:
        """Cross-entropy of known entries; 0 without any.

        Parameters
        ----------
        mesh : (window, channel, sample)
        entry : (window,) share of a passage from its first sample to the entry; NaN is not known
        """
        known = ~torch.isnan(entry)
        if not known.any():
            return mesh.new_zeros(())
        place = sample_of(entry[known], self.n_places)
        return cross_entropy(self(mesh[known]), place)


def sample_of(entry: torch.Tensor, n_places: int) -> torch.Tensor:
    """(window,) nearest sample of a passage, from the share of a passage."""
    return torch.remainder(torch.round(entry * n_places).long(), n_places)


def rolled(signals: torch.Tensor, shift: torch.Tensor) -> torch.Tensor:
    """Periodic signals (window, channel, sample) that begin ``shift`` (window,) samples later."""
    n_samples = signals.shape[-1]
    sample = torch.arange(n_samples, device=signals.device)
    index = torch.remainder(sample + shift[:, None], n_samples)
    return signals.gather(-1, index[:, None].expand_as(signals))


def _of_unit_power(signals: torch.Tensor) -> torch.Tensor:
    """Signals (window, channel, sample) divided by the root of their mean square."""
    power = signals.square().mean(dim=-1, keepdim=True)
    return signals / torch.sqrt(power + 1e-12)
