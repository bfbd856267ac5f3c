"""Registry of networks, and networks built from configurations."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import torch
from torch import nn

from diagnose.data.inputs import NetworkInput
from diagnose.networks.network import Network
from diagnose.networks.order_cnn import OrderCnn
from diagnose.networks.small_cnn import SmallCnn
from diagnose.networks.spectrum import SpectrumCnn
from diagnose.networks.wdcnn import Wdcnn
from gensig.errors import ConfigError
from gensig.options.configuration import Section

# Kind in a configuration -> network; each declares what it reads as its ``inputs``.
MODELS: dict[str, type[Network]] = {
    "small_cnn": SmallCnn,
    "wdcnn": Wdcnn,
    "spectrum_cnn": SpectrumCnn,
    "order_cnn": OrderCnn,
}


def build_model(
    config: Section,
    *,
    n_channels: int,
    n_classes: int,
    input_scale: Sequence[float] | None = None,
) -> Network:
    """Network of a configuration, whose ``kind`` names an entry of `MODELS`.

    Parameters
    ----------
    config : parameters, ``kind``, and ``name``, which is only shown
    n_channels, n_classes : of the data
    input_scale : (channel,) divisor of the inputs; 1 if None

    Raises
    ------
    ConfigError    for an unknown kind or parameters that it does not take
    """
    make: Callable[..., Network] = _network_class(config)
    parameters = dict(config)
    del parameters["kind"]
    parameters.pop("name", None)
    if input_scale is None:
        input_scale = [1.0] * n_channels
    try:
        return make(
            n_channels=n_channels,
            n_classes=n_classes,
            input_scale=input_scale,
            **parameters,
        )
    except (TypeError, ValueError, RuntimeError) as error:
        reason = " ".join(str(error).split())
        raise ConfigError(f"model {config['kind']}: {reason}") from None


def input_of(config: Section) -> NetworkInput:
    """Input of the network of a completed configuration.

    Raises
    ------
    ConfigError    for an unknown kind
    """
    return _network_class(config).inputs.of(config)


def has_window_length(config: Section) -> bool:
    """True if the length of windows matters to the network of a configuration, completed or not.

    Raises
    ------
    ConfigError    for an unknown kind
    """
    return _network_class(config).inputs.has_window_length


def completed(
    config: Section,
    attributes: Mapping[str, Any],
    heads: Sequence[str],
) -> Section:
    """Configuration with its further heads, and the values that its input takes of a data set.

    Raises
    ------
    ConfigError    for an unknown kind, or a data set whose attributes lack what the input needs
    """
    if heads:
        config = config | {"heads": list(heads)}
    return _network_class(config).inputs.completed(config, attributes)


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
            f"window_samples={window_samples} is too short for this network; "
            "make it longer or choose another model"
        ) from None


def _network_class(config: Section) -> type[Network]:
    """Entry of `MODELS` that a configuration names.

    Raises
    ------
    ConfigError    for an unknown kind
    """
    kind = config.get("kind")
    if kind not in MODELS:
        raise ConfigError(f"no model kind '{kind}'; there is {', '.join(MODELS)}")
    return MODELS[kind]
