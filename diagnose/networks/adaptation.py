"""A trained network moved to a measured machine by its healthy recordings alone: healthy is
matched to healthy.

The statistics of the *healthy* training windows are stored with the network. What healthy windows
of the machine have instead is taken for the effect of its path, sensors and noise, and undone;
faulty windows are expected to be moved in the same way, which nothing here can check. Matching
all classes of the training to healthy windows, as these methods are published for unlabelled
mixtures, would take the faults themselves for a property of the simulation.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from diagnose.networks.domain import window_levels
from gensig.errors import ConfigError, DatasetError

if TYPE_CHECKING:
    from diagnose.data.windows import WindowSet
    from diagnose.networks.domain import Domain

FloatArray = NDArray[np.floating]

HEALTHY = "healthy"
PREFIX = "adaptation."
MOST_WINDOWS = 500  # of the training, evenly spaced, whose features are stored
LEAST_WINDOWS = 8  # assumed; a second at the default length: moments of fewer are those of the moment
HEAD = "head"  # of every network: what makes scores of features
RIDGE = 1.0  # on covariances of features of unit variance, as published


@dataclass(frozen=True, slots=True, kw_only=True)
class Statistics:
    """What windows look like inside a network.

    Attributes
    ----------
    mean, variance : batch-normalisation layer -> (channel,) of its input, over windows and positions
    features : (window, feature) that the class scores are linear in
    levels : (level,) mean of `diagnose.networks.domain.window_levels`
    """

    mean: Mapping[str, FloatArray]
    variance: Mapping[str, FloatArray]
    features: FloatArray
    levels: FloatArray

    def tensors(self) -> dict[str, NDArray[np.float32]]:
        """What is stored beside the weights."""
        named = {f"{PREFIX}mean.{name}": value for name, value in self.mean.items()}
        named |= {
            f"{PREFIX}variance.{name}": value for name, value in self.variance.items()
        }
        named |= {f"{PREFIX}features": self.features, f"{PREFIX}levels": self.levels}
        return {
            name: np.asarray(value, dtype=np.float32) for name, value in named.items()
        }


def statistics_from(tensors: Mapping[str, NDArray[Any]]) -> Statistics | None:
    """Statistics of a stored network; None where it has none.

    Raises
    ------
    DatasetError    for tensors that are no such thing
    """
    held = {
        name.removeprefix(PREFIX): value
        for name, value in tensors.items()
        if name.startswith(PREFIX)
    }
    if not held:
        return None
    whole = {name: np.asarray(value, dtype=float) for name, value in held.items()}
    mean, variance = (
        {
            name.removeprefix(part): value
            for name, value in whole.items()
            if name.startswith(part)
        }
        for part in ("mean.", "variance.")
    )
    if not {"features", "levels"} <= set(whole) or set(mean) != set(variance):
        raise DatasetError(
            "its healthy statistics are not whole; train the model again"
        )
    if (
        not all(np.isfinite(value).all() for value in whole.values())
        or whole["features"].ndim != 2
    ):
        raise DatasetError(
            "its healthy statistics hold what is no statistic; train the model again"
        )
    return Statistics(
        mean=mean, variance=variance, features=whole["features"], levels=whole["levels"]
    )


def healthy_statistics(
    model: nn.Module, train: WindowSet, class_names: tuple[str, ...]
) -> Statistics | None:
    """Statistics of the healthy training windows; None where no class is called so."""
    if HEALTHY not in class_names:
        return None
    healthy = np.flatnonzero(train.label == class_names.index(HEALTHY))
    return (
        statistics_of(model, chosen_windows(train, healthy)) if healthy.size else None
    )


def chosen_windows(windows: WindowSet, chosen: NDArray[np.integer]) -> WindowSet:
    """At most `MOST_WINDOWS` of the chosen ones, evenly spaced."""
    kept = (
        np.linspace(0, chosen.size - 1, min(chosen.size, MOST_WINDOWS))
        .round()
        .astype(int)
    )
    parts = {
        name: getattr(windows, name)[chosen[kept]]
        for name in ("segment", "start", "label", "record")
    }
    return replace(windows, **parts)


def statistics_of(model: nn.Module, windows: WindowSet) -> Statistics:
    """Statistics of windows, whatever their class, at their planned starts."""
    names = [name for name, _ in _norms(model)]
    moments, features = _observe(model, windows, names)
    return Statistics(
        mean={name: moments[name][0] for name in names},
        variance={name: moments[name][1] for name in names},
        features=features,
        levels=window_levels(windows, np.arange(len(windows))).mean(axis=0),
    )


def adapt_network(
    model: nn.Module, source: Statistics, windows: WindowSet, method: str
) -> nn.Module:
    """A copy of the network that sees these windows as the training's.

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
            f"the healthy recordings hold {len(windows)} window(s) of the model, and {LEAST_WINDOWS} are the least; "
            "give longer recordings or more of them"
        )
    adapted = copy.deepcopy(model).eval()
    METHODS[method](adapted, source, windows)
    return adapted


def _adapt_norms(model: nn.Module, source: Statistics, windows: WindowSet) -> None:
    """Give each batch normalisation moments that make healthy inputs of the machine those of the
    training.

    With moments (m, v) of the network and (a, p) of healthy training inputs, healthy inputs of
    the machine with (b, q) need the mean b - (a - m) sqrt(q / p) and the variance v q / p. For a
    = m and p = v, a mixture taken for healthy, this is adaptive batch normalisation as published.
    Layer after layer, each behind those moved before.

    Source: Li, Wang, Shi, Liu & Hou (2016), "Revisiting batch normalization for practical domain
    adaptation", arXiv:1603.04779, algorithm 1. Healthy for healthy is ours.
    """
    norms = _norms(model)
    if not norms:
        raise ConfigError(
            "adabn moves batch normalisations, and this network has none; take coral"
        )
    if set(source.mean) != {name for name, _ in norms}:
        raise DatasetError("the healthy statistics belong to another network")
    for name, layer in norms:
        mean, variance = _observe(model, windows, [name])[0][name]
        assert layer.running_mean is not None
        assert layer.running_var is not None
        own_mean, own_variance = (
            value.double().numpy() for value in (layer.running_mean, layer.running_var)
        )
        if (
            source.mean[name].shape != own_mean.shape
            or source.variance[name].shape != own_mean.shape
        ):
            raise DatasetError("the healthy statistics belong to another network")
        ratio = (variance + layer.eps) / (source.variance[name] + layer.eps)
        moved = mean - (source.mean[name] - own_mean) * np.sqrt(ratio)
        spread = np.maximum((own_variance + layer.eps) * ratio - layer.eps, 0.0)
        layer.running_mean.copy_(torch.from_numpy(moved))
        layer.running_var.copy_(torch.from_numpy(spread))


def _align_features(model: nn.Module, source: Statistics, windows: WindowSet) -> None:
    """Bring mean and covariance of the machine's healthy features to those of the training's.

    Rows x become (x - mean_t) C_t^(-1/2) C_s^(1/2) + mean_s, with C = cov + 1 of features divided
    by the standard deviation of the training's: the inverse of the published map from source to
    target. What scores features is linear, so that the map goes into its weights.

    Source: Sun, Feng & Saenko (2016), "Return of frustratingly easy domain adaptation", AAAI,
    algorithm 1. There sources are moved and a classifier is trained on them; healthy for healthy,
    and the means, are ours.
    """
    head = _head(model)
    target = _observe(model, windows, [])[1]
    if source.features.shape[1] != target.shape[1]:
        raise DatasetError("the healthy statistics belong to another network")
    scale = source.features.std(axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    inverse, root = (
        _power(_covariance(rows / scale), power)
        for rows, power in ((target, -0.5), (source.features, 0.5))
    )
    turn = (inverse @ root) * scale / scale[:, None]
    weight, bias = (
        value.detach().double().numpy() for value in (head.weight, head.bias)
    )
    offset = source.features.mean(axis=0) - target.mean(axis=0) @ turn
    with torch.no_grad():
        head.weight.copy_(torch.from_numpy(weight @ turn.T))
        head.bias.copy_(torch.from_numpy(bias + weight @ offset))


METHODS: dict[str, Callable[[nn.Module, Statistics, WindowSet], None]] = {
    "adabn": _adapt_norms,
    "coral": _align_features,
}


def adapt_domain(domain: Domain, source: Statistics, windows: WindowSet) -> Domain:
    """The known windows with their levels moved as healthy ones differ; the threshold stays.

    A path multiplies a spectrum and so adds to its logarithm, to faulty windows what it adds to
    healthy ones. What strays farther from them than held-out simulated units did is still unlike
    the training data.
    """
    if source.levels.shape != domain.levels.shape[1:]:
        raise DatasetError(
            "the healthy statistics belong to another out-of-distribution flag"
        )
    shift = window_levels(windows, np.arange(len(windows))).mean(axis=0) - source.levels
    return replace(domain, levels=(domain.levels + shift).astype(np.float32))


def _norms(model: nn.Module) -> list[tuple[str, nn.BatchNorm1d]]:
    """Batch normalisations that keep moments, in the order in which they are passed."""
    return [
        (name, layer)
        for name, layer in model.named_modules()
        if isinstance(layer, nn.BatchNorm1d) and layer.running_mean is not None
    ]


def _head(model: nn.Module) -> nn.Linear:
    """The last linear layer of what makes the class scores."""
    linear = [
        layer
        for layer in getattr(model, HEAD, nn.Identity()).modules()
        if isinstance(layer, nn.Linear)
    ]
    if not linear:
        raise ConfigError(
            "the class scores of this network are not linear in features; adaptation needs that"
        )
    return linear[-1]


def _observe(
    model: nn.Module, windows: WindowSet, names: list[str], *, batch_size: int = 32
) -> tuple[dict[str, tuple[FloatArray, FloatArray]], FloatArray]:
    """Mean and variance of the input of the named layers, and (window, feature) input of the
    class scores.
    """
    sums: dict[str, Any] = {name: 0.0 for name in names}
    squares: dict[str, Any] = {name: 0.0 for name in names}
    counts = dict.fromkeys(names, 0)
    features: list[FloatArray] = []

    def watch(name: str) -> Callable[[nn.Module, tuple[torch.Tensor, ...]], None]:
        def hook(_: nn.Module, inputs: tuple[torch.Tensor, ...]) -> None:
            by_channel = inputs[0].double().transpose(0, 1).flatten(1).numpy()
            sums[name] = sums[name] + by_channel.sum(axis=1)
            squares[name] = squares[name] + np.square(by_channel).sum(axis=1)
            counts[name] += by_channel.shape[1]

        return hook

    layers = dict(model.named_modules())
    hooks = [layers[name].register_forward_pre_hook(watch(name)) for name in names]
    hooks.append(
        _head(model).register_forward_pre_hook(
            lambda _, inputs: features.append(inputs[0].double().numpy())
        )
    )
    every = np.arange(len(windows))
    try:
        with torch.inference_mode():
            for block in np.array_split(every, -(-every.size // batch_size)):
                model(torch.from_numpy(windows.cut(block)))
    finally:
        for hook in hooks:
            hook.remove()
    mean = {name: sums[name] / counts[name] for name in names}
    moments = {
        name: (
            mean[name],
            np.maximum(squares[name] / counts[name] - mean[name] ** 2, 0.0),
        )
        for name in names
    }
    return moments, np.concatenate(features)


def _covariance(rows: FloatArray) -> FloatArray:
    """(feature, feature) of rows (window, feature), with `RIDGE` on its diagonal."""
    centered = rows - rows.mean(axis=0)
    return centered.T @ centered / max(len(rows) - 1, 1) + RIDGE * np.eye(rows.shape[1])


def _power(symmetric: FloatArray, exponent: float) -> FloatArray:
    """Power of a positive definite matrix."""
    values, vectors = np.linalg.eigh(symmetric)
    return (vectors * values**exponent) @ vectors.T
