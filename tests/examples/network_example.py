"""Example of a new network: one module, one line in the registry, and one YAML file.

In a checkout this file would be ``diagnose/networks/envelope_cnn.py``. Two steps follow. One is
the entry ``"envelope_cnn": EnvelopeCnn`` in `diagnose.networks.registry.MODELS`. The other is the
file ``configs/model/envelope.yaml`` with `CONFIG` as its content.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import torch
from torch import nn

from diagnose.data.inputs import NetworkInput
from diagnose.data.window_input import Windows
from diagnose.networks.network import FeatureNetwork

CONFIG = {"name": "envelope", "kind": "envelope_cnn", "kernel": 16, "width": 8}


class EnvelopeCnn(FeatureNetwork):
    """Learned band-pass filters, with the mean and the maximum of their outputs.

    Parameters
    ----------
    n_channels, n_classes : of the data
    input_scale : (channel,) divisor of the input; stored with the weights
    kernel : samples of a filter
    width : number of filters
    heads : see `diagnose.settings.HEADS`
    """

    inputs: ClassVar[type[NetworkInput]] = Windows  # or Turns

    def __init__(
        self,
        *,
        n_channels: int,
        n_classes: int,
        input_scale: Sequence[float],
        kernel: int,
        width: int,
        heads: Sequence[str] = (),
    ) -> None:
        super().__init__(input_scale)
        self.filters = nn.Conv1d(n_channels, width, kernel, bias=False)
        self.norm = nn.BatchNorm1d(width)
        # novelty expects the name "head"
        self.head = nn.Linear(2 * width, n_classes)
        self.add_heads(heads, 2 * width, n_classes)

    def look(self, windows: torch.Tensor) -> tuple[torch.Tensor, None]:
        """Mean and maximum of every filter's envelope; no map of positions on a turn."""
        envelope = self.norm(self.filters(windows)).abs()
        return torch.cat([envelope.mean(dim=-1), envelope.amax(dim=-1)], dim=1), None
