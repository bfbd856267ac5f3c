"""Base classes of networks: scaled inputs, class scores, further answers and their loss."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar

import torch
from torch import nn
from torch.nn.functional import cross_entropy

from diagnose.data.inputs import NetworkInput
from diagnose.data.targets import GEARS, further_loss, position_loss
from gensig.errors import ConfigError

HEADS = ("severity", "gear")
HEADS_WEIGHT = 0.3  # of each further head against the classes; assumed


class Network(nn.Module, ABC):
    """Windows (window, channel, sample) in, class scores (window, class) out.

    Parameters
    ----------
    input_scale : (channel,) typical RMS of each channel, which the input is divided by; stored
        with the weights

    Attributes
    ----------
    inputs : kind of input that the network reads; nothing else declares it
    takes_reference : True if its configuration may have the key ``reference``
    """

    inputs: ClassVar[type[NetworkInput]]
    takes_reference: ClassVar[bool] = False
    input_scale: torch.Tensor

    def __init__(self, input_scale: Sequence[float]) -> None:
        super().__init__()
        self.register_buffer(
            "input_scale",
            torch.tensor(list(input_scale), dtype=torch.float32)[:, None],
        )

    @property
    @abstractmethod
    def head_names(self) -> tuple[str, ...]:
        """Names out of `HEADS` that the network answers besides the class."""

    @abstractmethod
    def forward(self, windows: torch.Tensor) -> torch.Tensor:
        """Unnormalised class scores (window, class) of windows (window, channel, sample)."""

    @abstractmethod
    def answers(self, windows: torch.Tensor) -> dict[str, torch.Tensor]:
        """All outputs for windows, unnormalised.

        Returns
        -------
        classes : (window, class)
        severity, gear : (window, output) of those in `head_names`
        """

    @abstractmethod
    def loss(
        self,
        windows: torch.Tensor,
        label: torch.Tensor,
        targets: Mapping[str, torch.Tensor],
        class_weight: torch.Tensor,
    ) -> torch.Tensor:
        """Loss of a batch.

        Parameters
        ----------
        windows : (window, channel, sample)
        label : (window,) class
        targets : (window,) each, of `diagnose.data.targets`, as far as the data set has them
        class_weight : (class,) of the cross-entropy
        """


class SiteNetwork(Network):
    """Network that scores every class at every site where a fault may be.

    Attributes
    ----------
    n_places : samples of a passage, in one of which a tooth comes into mesh
    """

    n_places: int

    @abstractmethod
    def sites(self, n_teeth: Sequence[int]) -> tuple[tuple[str, int], ...]:
        """Gear of `diagnose.data.targets.GEARS` and tooth of each site; -1 for no single tooth.

        Teeth are counted in the order of mesh from the first that comes into mesh.
        """

    @abstractmethod
    def entries(self, windows: torch.Tensor) -> torch.Tensor:
        """(window,) sample of a passage at which a tooth comes into mesh, as estimated."""

    @abstractmethod
    def site_scores(
        self, windows: torch.Tensor, entry: torch.Tensor | None = None
    ) -> torch.Tensor:
        """Unnormalised scores (window, site, class) of windows (window, channel, sample).

        ``entry`` (window,) is the sample of a passage at which a tooth comes into mesh; it is
        estimated where it is None.
        """


class FeatureNetwork(Network):
    """Class scores, severity and gear that are linear in the features of a window."""

    head: nn.Module
    places: nn.Module | None

    def __init__(self, input_scale: Sequence[float]) -> None:
        super().__init__(input_scale)
        self.further = nn.ModuleDict()
        self.places = None
        # (index in GEARS, teeth) of each gear that the scores of `places` run around
        self.turns: tuple[tuple[int, int], ...] = ()

    @abstractmethod
    def look(self, windows: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor | None]:
        """Features (window, feature) of scaled windows.

        Also the maps (window, map, position) that they are the maximum of, or None.
        """

    @property
    def head_names(self) -> tuple[str, ...]:
        """Names given to `add_heads`."""
        return tuple(self.further)

    def forward(self, windows: torch.Tensor) -> torch.Tensor:
        """Unnormalised class scores (window, class) of windows (window, channel, sample)."""
        return self.head(self.look(windows / self.input_scale)[0])

    def answers(self, windows: torch.Tensor) -> dict[str, torch.Tensor]:
        """All outputs for windows, unnormalised.

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

    def loss(
        self,
        windows: torch.Tensor,
        label: torch.Tensor,
        targets: Mapping[str, torch.Tensor],
        class_weight: torch.Tensor,
    ) -> torch.Tensor:
        """Cross-entropy of the classes, and losses of further heads and of the fault's tooth."""
        answers = self.answers(windows)
        loss = cross_entropy(answers["classes"], label, weight=class_weight)
        if self.further:
            loss = loss + HEADS_WEIGHT * further_loss(answers, label, targets)
        if "places" in answers and {"gear", "position"} <= set(targets):
            loss = loss + position_loss(
                answers["places"],
                label,
                targets["gear"],
                targets["position"],
                self.turns,
            )
        return loss

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
