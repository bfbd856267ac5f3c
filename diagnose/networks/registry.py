"""Registry of networks, and networks built from configurations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from diagnose.data.inputs import NetworkInput
from diagnose.networks.network import Network
from diagnose.networks.order_cnn import OrderCnn
from diagnose.networks.small_cnn import SmallCnn
from diagnose.networks.tooth_network import ToothNetwork
from gensig.errors import ConfigError
from gensig.options.configuration import Section

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

# Kind in a configuration -> network; each declares what it reads as its ``inputs``.
MODELS: dict[str, type[Network]] = {
    "small_cnn": SmallCnn,
    "order_cnn": OrderCnn,
    "tooth_network": ToothNetwork,
}

# Keys of a network's file that its class does not take: its name, its schedule, its input and
# the network that is trained where it cannot be.
OTHERWISE = "otherwise"
INPUT_KEYS = ("halves", "each_channel", "whitened", "redraws")  # of the input alone
NOT_OF_NETWORK = ("name", "kind", "training", OTHERWISE, *INPUT_KEYS)
# errors of parameters that make no network, as an empty list of widths or a stride of 0
UNFIT = (
    TypeError,
    ValueError,
    RuntimeError,
    ArithmeticError,
    LookupError,
    AttributeError,
)


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
    config : parameters, ``kind``, and keys of `NOT_OF_NETWORK`
    n_channels, n_classes : of the data
    input_scale : (channel,) divisor of the inputs; 1 if None

    Raises
    ------
    ConfigError    for an unknown kind or parameters that it does not take
    """
    make: Callable[..., Network] = _network_class(config)
    parameters = {key: config[key] for key in config if key not in NOT_OF_NETWORK}
    if input_scale is None:
        input_scale = [1.0] * n_channels
    try:
        return make(
            n_channels=n_channels,
            n_classes=n_classes,
            input_scale=input_scale,
            **parameters,
        )
    except UNFIT as error:
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


def takes_reference(config: Section) -> bool:
    """True if the network of a configuration can compare with a healthy record of the machine.

    Raises
    ------
    ConfigError    for an unknown kind
    """
    return _network_class(config).takes_reference


def completed(
    config: Section,
    dataset: Dataset,
    heads: Sequence[str],
) -> Section:
    """Configuration with its further heads, and the values that its input takes of a data set.

    Raises
    ------
    ConfigError    for an unknown kind, or a data set that lacks what the input needs
    """
    if heads:
        config = config | {"heads": list(heads)}
    return _network_class(config).inputs.completed(config, dataset)


def check_example(model: nn.Module, example: NDArray[np.float32]) -> None:
    """Refuse an input (1, channel, point) that the network cannot take, before it is trained.

    Raises
    ------
    ConfigError    if it is too short
    """
    try:
        with torch.inference_mode():
            model.eval()(torch.from_numpy(example))
    except RuntimeError:
        raise ConfigError(
            f"window_samples={example.shape[-1]} is too short for this network; "
            "make it longer or choose another model"
        ) from None


def check_window(model: nn.Module, n_channels: int, window_samples: int) -> None:
    """Refuse windows of a length that the network cannot take.

    Raises
    ------
    ConfigError    if they are too short
    """
    check_example(model, np.zeros((1, n_channels, window_samples), dtype=np.float32))


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
