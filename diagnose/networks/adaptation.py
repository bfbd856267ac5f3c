"""Adaptation of a trained network to a measured machine by its healthy recordings alone.

The statistics of the *healthy* training windows are stored with the network. The difference of
the machine's healthy windows is taken for the effect of its path, sensors and noise, and undone.
Faulty windows are assumed to differ in the same way, which nothing here can check. The methods
are published for unlabelled mixtures. Matching all classes of the training to healthy windows
would take the faults themselves for a property of the simulation.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from diagnose.data.windows import FloatArray
from diagnose.networks.domain import evenly_spaced, window_levels
from gensig.errors import ConfigError, DatasetError

if TYPE_CHECKING:
    from diagnose.data.windows import WindowSet
    from diagnose.networks.domain import Domain

HEALTHY = "healthy"
PREFIX = "adaptation."
MOST_WINDOWS = (
    500  # of the training, evenly spaced; of their features as many rows are stored
)
LEAST_WINDOWS = (
    8  # assumed; a second at the default length, for moments that are typical
)
HEAD = "head"  # attribute of every network that makes scores of features
OTHER_NETWORK = "the healthy statistics belong to another network"
RIDGE = 1.0  # on covariances of features of unit variance, as published


@dataclass(frozen=True, slots=True, kw_only=True)
class Statistics:
    """Moments and features of windows inside a network.

    Attributes
    ----------
    mean, variance : batch-normalisation layer -> (channel,) of its input, over windows and
        positions
    features : (row, feature) that the class scores are linear in; rows are windows, or their sites
    levels : (level,) mean of `diagnose.networks.domain.window_levels`
    """

    mean: Mapping[str, FloatArray]
    variance: Mapping[str, FloatArray]
    features: FloatArray
    levels: FloatArray

    def tensors(self) -> dict[str, NDArray[np.float32]]:
        """Name -> array, stored with the weights."""
        named = {"features": self.features, "levels": self.levels}
        named |= {f"mean.{name}": value for name, value in self.mean.items()}
        named |= {f"variance.{name}": value for name, value in self.variance.items()}
        return {
            PREFIX + name: value.astype(np.float32) for name, value in named.items()
        }


def statistics_from(tensors: Mapping[str, NDArray[Any]]) -> Statistics | None:
    """Statistics of a stored network; None if it has none.

    Raises
    ------
    DatasetError    for tensors that are no statistics
    """
    stored = _below(PREFIX, tensors)
    if not stored:
        return None
    mean, variance = _below("mean.", stored), _below("variance.", stored)
    if not {"features", "levels"} <= set(stored) or set(mean) != set(variance):
        raise DatasetError(
            "its healthy statistics are not whole; train the model again"
        )
    features, levels = stored["features"], stored["levels"]
    finite = all(np.isfinite(value).all() for value in stored.values())
    if not finite or features.ndim != 2:
        raise DatasetError(
            "its healthy statistics hold what is no statistic; train the model again"
        )
    return Statistics(mean=mean, variance=variance, features=features, levels=levels)


def _below(prefix: str, tensors: Mapping[str, NDArray[Any]]) -> dict[str, FloatArray]:
    """Arrays whose names begin with a prefix, by the rest of their names."""
    return {
        name.removeprefix(prefix): np.asarray(value, dtype=float)
        for name, value in tensors.items()
        if name.startswith(prefix)
    }


def healthy_statistics(
    model: nn.Module, train: WindowSet, class_names: tuple[str, ...]
) -> Statistics | None:
    """Statistics of the healthy training windows; None if there are none."""
    if HEALTHY not in class_names:
        return None
    healthy = np.flatnonzero(train.label == class_names.index(HEALTHY))
    if not healthy.size:
        return None
    return statistics_of(model, chosen_windows(train, healthy))


def chosen_windows(windows: WindowSet, chosen: NDArray[np.integer]) -> WindowSet:
    """At most `MOST_WINDOWS` of the chosen ones, evenly spaced."""
    return windows.subset(chosen[evenly_spaced(chosen.size, MOST_WINDOWS)])


def statistics_of(model: nn.Module, windows: WindowSet) -> Statistics:
    """Statistics of windows of any class, at their planned starts."""
    names = [name for name, _ in _norms(model)]
    moments, features = _observe(model, windows, names)
    kept = evenly_spaced(len(features), MOST_WINDOWS)
    return Statistics(
        mean={name: moments[name][0] for name in names},
        variance={name: moments[name][1] for name in names},
        features=features[kept],
        levels=window_levels(windows).mean(axis=0),
    )


def adapt_network(
    model: nn.Module, source: Statistics, windows: WindowSet, method: str
) -> nn.Module:
    """A copy of the network in which these windows look like those of the training.

    Parameters
    ----------
    model : as trained
    source : of its healthy training windows
    windows : healthy ones of the machine
    method : key of `METHODS`

    Raises
    ------
    ConfigError    for another method, too few windows, or a network that the method cannot move
    DatasetError    for statistics of another network
    """
    if method not in METHODS:
        raise ConfigError(f"no method '{method}'; there is {', '.join(METHODS)}")
    if len(windows) < LEAST_WINDOWS:
        raise ConfigError(
            f"the healthy recordings hold {len(windows)} window(s) of the model, "
            f"and {LEAST_WINDOWS} are the least; give longer recordings or more of them"
        )
    adapted = copy.deepcopy(model).eval()
    METHODS[method](adapted, source, windows)
    return adapted


def _adapt_norms(model: nn.Module, source: Statistics, windows: WindowSet) -> None:
    """Set the moments of each batch normalisation, so that healthy inputs of the machine look
    like those of the training.

    With moments (m, v) of the network and (a, p) of healthy training inputs, healthy inputs of
    the machine with (b, q) need the mean b - (a - m) sqrt(q / p) and the variance v q / p. For
    a = m and p = v, a mixture taken for healthy, this is adaptive batch normalisation as
    published. The layers are adapted in their order, each after those before it.

    Source: Li, Wang, Shi, Liu & Hou (2016), "Revisiting batch normalization for practical domain
    adaptation", arXiv:1603.04779, algorithm 1. Healthy for healthy is ours.
    """
    norms = _norms(model)
    if not norms:
        raise ConfigError(
            "adabn moves batch normalisations, and this network has none; take coral"
        )
    if set(source.mean) != {name for name, _ in norms}:
        raise DatasetError(OTHER_NETWORK)
    for name, layer in norms:
        mean, variance = _observe(model, windows, [name])[0][name]
        healthy_mean, healthy_variance = source.mean[name], source.variance[name]
        assert layer.running_mean is not None
        assert layer.running_var is not None
        old_mean = layer.running_mean.double().numpy()
        old_variance = layer.running_var.double().numpy()
        if not old_mean.shape == healthy_mean.shape == healthy_variance.shape:
            raise DatasetError(OTHER_NETWORK)
        ratio = (variance + layer.eps) / (healthy_variance + layer.eps)
        new_mean = mean - (healthy_mean - old_mean) * np.sqrt(ratio)
        new_variance = (old_variance + layer.eps) * ratio - layer.eps
        layer.running_mean.copy_(torch.from_numpy(new_mean))
        layer.running_var.copy_(torch.from_numpy(np.maximum(new_variance, 0.0)))


def _align_features(model: nn.Module, source: Statistics, windows: WindowSet) -> None:
    """Bring mean and covariance of the machine's healthy features to those of the training's.

    Rows x become (x - mean_t) C_t^(-1/2) C_s^(1/2) + mean_s, with C = cov + 1 of features divided
    by the standard deviation of the training's. This is the inverse of the published map from
    source to target. The scores are linear in the features, so that the map goes into their
    weights.

    Source: Sun, Feng & Saenko (2016), "Return of frustratingly easy domain adaptation", AAAI,
    algorithm 1. There sources are moved and a classifier is trained on them; healthy for healthy,
    and the means, are ours.
    """
    head = _head(model)
    target = _observe(model, windows, [])[1]
    if source.features.shape[1] != target.shape[1]:
        raise DatasetError(OTHER_NETWORK)
    scale = source.features.std(axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    inverse = _power(_covariance(target / scale), -0.5)
    root = _power(_covariance(source.features / scale), 0.5)
    mapping = (inverse @ root) * scale / scale[:, None]
    weight = head.weight.detach().double().numpy()
    bias = head.bias.detach().double().numpy()
    offset = source.features.mean(axis=0) - target.mean(axis=0) @ mapping
    with torch.no_grad():
        head.weight.copy_(torch.from_numpy(weight @ mapping.T))
        head.bias.copy_(torch.from_numpy(bias + weight @ offset))


METHODS: dict[str, Callable[[nn.Module, Statistics, WindowSet], None]] = {
    "adabn": _adapt_norms,
    "coral": _align_features,
}


def adapt_domain(domain: Domain, source: Statistics, windows: WindowSet) -> Domain:
    """The domain with levels shifted by the difference of the healthy ones, and its threshold.

    A path multiplies a spectrum and so adds to its logarithm, the same for faulty and healthy
    windows. Windows farther away than held-out simulated units are still unlike the training
    data.
    """
    if source.levels.shape != domain.levels.shape[1:]:
        raise DatasetError(
            "the healthy statistics belong to another out-of-distribution flag"
        )
    shift = window_levels(windows).mean(axis=0) - source.levels
    return replace(domain, levels=(domain.levels + shift).astype(np.float32))


def _norms(model: nn.Module) -> list[tuple[str, nn.BatchNorm1d]]:
    """Batch normalisations that keep moments, in the order of the network."""
    return [
        (name, layer)
        for name, layer in model.named_modules()
        if isinstance(layer, nn.BatchNorm1d) and layer.running_mean is not None
    ]


def _head(model: nn.Module) -> nn.Linear:
    """The last linear layer of the head, which makes the class scores."""
    layers = getattr(model, HEAD, nn.Identity()).modules()
    linear = [layer for layer in layers if isinstance(layer, nn.Linear)]
    if not linear:
        raise ConfigError(
            "the class scores of this network are not linear in features; adaptation needs that"
        )
    return linear[-1]


def _observe(
    model: nn.Module, windows: WindowSet, names: list[str], *, batch_size: int = 32
) -> tuple[dict[str, tuple[FloatArray, FloatArray]], FloatArray]:
    """Mean and variance of the input of the named layers, and (row, feature) of the head's.

    Rows are windows, or all sites of all windows for a network that scores sites.
    """
    sums: dict[str, Any] = dict.fromkeys(names, 0.0)
    squares: dict[str, Any] = dict.fromkeys(names, 0.0)
    counts = dict.fromkeys(names, 0)
    features: list[FloatArray] = []

    def add_moments(name: str, _: nn.Module, inputs: tuple[torch.Tensor, ...]) -> None:
        by_channel = inputs[0].double().transpose(0, 1).flatten(1).numpy()
        sums[name] = sums[name] + by_channel.sum(axis=1)
        squares[name] = squares[name] + np.square(by_channel).sum(axis=1)
        counts[name] += by_channel.shape[1]

    def add_features(_: nn.Module, inputs: tuple[torch.Tensor, ...]) -> None:
        features.append(inputs[0].double().flatten(0, -2).numpy())

    layers = dict(model.named_modules())
    hooks = [_head(model).register_forward_pre_hook(add_features)]
    for name in names:
        hook = partial(add_moments, name)
        hooks.append(layers[name].register_forward_pre_hook(hook))
    try:
        with torch.inference_mode():
            for block in windows.blocks(batch_size):
                model(torch.from_numpy(windows.cut(block)))
    finally:
        for handle in hooks:
            handle.remove()
    moments = {}
    for name in names:
        mean = sums[name] / counts[name]
        variance = squares[name] / counts[name] - mean**2
        moments[name] = mean, np.maximum(variance, 0.0)
    return moments, np.concatenate(features)


def _covariance(rows: FloatArray) -> FloatArray:
    """(feature, feature) of rows (window, feature), with `RIDGE` on its diagonal."""
    centered = rows - rows.mean(axis=0)
    return centered.T @ centered / max(len(rows) - 1, 1) + RIDGE * np.eye(rows.shape[1])


def _power(symmetric: FloatArray, exponent: float) -> FloatArray:
    """Power of a positive definite matrix."""
    values, vectors = np.linalg.eigh(symmetric)
    return (vectors * values**exponent) @ vectors.T
