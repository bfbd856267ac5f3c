"""Windows in m/s^2 for a graph: normalisation, pooling of one length, examples of all levels."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from gensig.errors import GensigError

if TYPE_CHECKING:
    from diagnose.training.store import ModelDescription

N_CHECKED = 6


class RawWindows(nn.Module):
    """A network behind the normalisation of its windows, as one graph.

    Parameters
    ----------
    model : of normalised windows
    normalise : as in `diagnose.data.windows.Task`
    answer, unit : of `diagnose.recordings.stored_network.Graph`
    """

    def __init__(
        self,
        model: nn.Module,
        normalise: str,
        answer: Callable[..., torch.Tensor],
        unit: float,
    ) -> None:
        super().__init__()
        self.model, self.normalise = model, normalise
        self.answer, self.unit = answer, unit

    def forward(self, *inputs: torch.Tensor) -> torch.Tensor:
        """Answer in its unit for (window, channel, sample) in m/s^2 and further inputs."""
        acceleration, *further = inputs
        windows = without_level(acceleration, self.normalise)
        return self.unit * self.answer(self.model, windows, *further)


def without_level(acceleration: torch.Tensor, normalise: str) -> torch.Tensor:
    """`diagnose.data.windows.normalised` of (window, channel, sample), as a graph."""
    windows = acceleration - acceleration.mean(dim=-1, keepdim=True)
    if normalise != "rms":
        return windows
    level = (windows * windows).mean(dim=-1, keepdim=True).sqrt()
    return windows / torch.where(level > 0, level, torch.ones_like(level))


class EqualParts(nn.Module):
    """Mean or maximum over parts as of torch's adaptive pooling, for one length.

    ONNX has no operator that does it.
    """

    def __init__(self, n_samples: int, n_parts: int, *, maximum: bool) -> None:
        super().__init__()
        self.parts = [
            slice(i * n_samples // n_parts, -(-(i + 1) * n_samples // n_parts))
            for i in range(n_parts)
        ]
        self.reduce = torch.amax if maximum else torch.mean

    def forward(self, maps: torch.Tensor) -> torch.Tensor:
        """(window, channel, part) of (window, channel, sample)."""
        reduced = [self.reduce(maps[..., part], dim=-1) for part in self.parts]
        return torch.stack(reduced, dim=-1)


def raw_examples(
    model: nn.Module, description: ModelDescription
) -> NDArray[np.float32]:
    """(window, channel, sample) m/s2: noise and tones beside an offset, and a silent channel.

    Levels go from a tenth to ten times what the network divides its input by, the RMS of its
    training.
    """
    rng = np.random.default_rng(0)
    shape = (N_CHECKED, len(description.channel_names), description.window_samples)
    time = np.arange(description.window_samples)
    tones = np.sin(2 * np.pi * rng.uniform(0.001, 0.4, shape[:2])[..., None] * time)
    scales = [
        value for name, value in model.named_buffers() if name.endswith("input_scale")
    ]
    typical = scales[0].numpy()  # (channel, 1)
    level = np.geomspace(0.1, 10.0, N_CHECKED)[:, None, None] * typical
    windows = level * (rng.standard_normal(shape) + 2.0 * tones + 0.5)
    windows[-1, 0] = 0.0
    return windows.astype(np.float32)


def with_fixed_pooling(model: nn.Module, *inputs: torch.Tensor) -> nn.Module:
    """A copy whose adaptive poolings are those of inputs of this length."""
    fixed = copy.deepcopy(model).eval()
    adaptive = (nn.AdaptiveAvgPool1d, nn.AdaptiveMaxPool1d)
    pools = {
        name: module
        for name, module in fixed.named_modules()
        if isinstance(module, adaptive)
    }
    lengths: dict[nn.Module, int] = {}

    def measure(module: nn.Module, given: tuple[torch.Tensor, ...]) -> None:
        lengths[module] = int(given[0].shape[-1])

    hooks = [module.register_forward_pre_hook(measure) for module in pools.values()]
    try:
        with torch.inference_mode():
            fixed(*inputs)
    except RuntimeError:
        raise GensigError(
            "this network does not take windows of acceleration; it cannot be written as ONNX",
        ) from None
    for hook in hooks:
        hook.remove()
    for name, module in pools.items():
        n_parts = int(np.ravel(module.output_size)[0])
        maximum = isinstance(module, nn.AdaptiveMaxPool1d)
        parts = EqualParts(lengths[module], n_parts, maximum=maximum)
        parent, _, last = name.rpartition(".")
        setattr(fixed.get_submodule(parent), last, parts)
    return fixed
