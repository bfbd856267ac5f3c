"""The tooth network, which a study trains by default: every tooth against its sisters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar, final

import torch
from torch import nn
from torch.nn.functional import cross_entropy, log_softmax, relu, relu_

from diagnose.data.inputs import NetworkInput
from diagnose.data.packed_turns import HEADER
from diagnose.data.targets import GEARS, further_loss
from diagnose.data.turns import NO_REFERENCE, Turns
from diagnose.networks.network import SiteNetwork, check_blocks
from diagnose.networks.tooth_batch import TINY, ToothBatch
from diagnose.networks.tooth_entry import EntryEstimator, sample_of
from gensig.errors import ConfigError

SPREAD_FLOOR = 0.1  # of a response over the teeth, beside responses of about unit variance; assumed
LEVEL_FLOOR = 0.02  # of the mean square of a turn, under the logarithm; assumed
JITTER = 1  # samples by which entries known in training are moved at random; assumed
SEVERITY_WEIGHT = 0.3  # of the severity beside the class; assumed
NEVER = -1e4  # score of a site that a window does not have


@final
class ToothNetwork(SiteNetwork):
    """Scores of every class at every site: no gear, a whole gear, and each tooth of either gear.

    The input is `diagnose.data.packed_turns`, of gears with any numbers of teeth. Its passages
    are turned so that each begins with the entry of a tooth, which is estimated from the mean
    passage. The same filters run around both gears. Their responses at a tooth are standardised
    against those of the other teeth at the same place of the passage, before and after the second
    convolution. Healthy teeth differ among each other, and a faulty tooth differs from them in
    another way. The score of a class for the record is the log-sum-exp of its scores at all
    sites.

    Parameters
    ----------
    n_channels, n_classes : of the data
    input_scale : (channel,) what the input is divided by; stored with the weights
    samples_per_tooth : of the turns
    widths, kernels, strides : of the convolutions around a turn: channels after each, its kernel
        in its input's samples, its stride
    n_passages : passages from the entry of a tooth that are looked at for it
    n_hidden : numbers that describe a site
    compression : factor on the first responses before they are compressed, at the start of a
        training
    entry_width : filters of the estimate of the entry
    dropout : share of the numbers of a site dropped in training
    level_samples : samples over which a response is squared and averaged, odd; the logarithms of
        these levels are further maps of the first convolution. 0: no such maps
    unexplained : True if the turns of what no other tooth explains follow in the input
    reference : ``"none"``, or another word where what a healthy record does not explain follows
    """

    about: torch.Tensor
    inputs: ClassVar[type[NetworkInput]] = Turns
    takes_reference: ClassVar[bool] = True

    def __init__(
        self,
        *,
        n_channels: int,
        n_classes: int,
        input_scale: Sequence[float],
        samples_per_tooth: int,
        widths: Sequence[int],
        kernels: Sequence[int],
        strides: Sequence[int],
        n_passages: int,
        n_hidden: int,
        compression: float,
        entry_width: int,
        dropout: float,
        level_samples: int = 0,
        unexplained: bool = False,
        reference: str = NO_REFERENCE,
    ) -> None:
        super().__init__(input_scale)
        self.n_kinds = 1 + unexplained + (reference != NO_REFERENCE)
        self.n_positions = _positions(samples_per_tooth, widths, kernels, strides)
        self.samples_per_tooth = self.n_places = samples_per_tooth
        self.n_passages = n_passages
        self.of_mesh = nn.Conv1d(
            n_channels, widths[0], kernels[0], strides[0], bias=False
        )
        self.level_samples = _checked_level(level_samples)
        about = _means_about(samples_per_tooth // strides[0], level_samples)
        self.register_buffer("about", about, persistent=False)
        first = widths[0] * (2 if level_samples else 1)
        inputs = (self.n_kinds * n_channels, first, *widths[1:-1])
        # The responses of the first filters are standardised before `threshold` is added.
        self.convolutions = nn.ModuleList(
            nn.Conv1d(n_in, n_out, kernel, stride, bias=index > 0)
            for index, (n_in, n_out, kernel, stride) in enumerate(
                zip(inputs, widths, kernels, strides, strict=True)
            )
        )
        self.threshold = nn.Parameter(torch.zeros(first, 1))
        self.margins = [kernel // 2 for kernel in kernels]
        self.compression = nn.Parameter(torch.full((widths[0], 1), float(compression)))
        n_responses = widths[-1] * self.n_positions
        self.of_tooth = nn.Conv1d(
            widths[-1], n_hidden, n_passages * self.n_positions, self.n_positions
        )
        self.of_usual = nn.Linear(n_responses, n_hidden)
        self.of_gear = nn.Linear(2 * n_responses, n_hidden)
        self.of_record = nn.Linear((len(GEARS) - 1) * n_hidden, n_hidden)
        self.dropout = nn.Dropout(dropout)
        self.head = nn.Linear(n_hidden, n_classes)
        self.severity = nn.Linear(n_hidden, n_classes)
        self.entry = EntryEstimator(n_channels, samples_per_tooth, entry_width)

    @property
    def head_names(self) -> tuple[str, ...]:
        """Severity and gear, which every tooth network answers."""
        return "severity", "gear"

    def forward(self, windows: torch.Tensor) -> torch.Tensor:
        """Unnormalised class scores (window, class), with the estimated entry of a tooth."""
        return torch.logsumexp(self.site_scores(windows), dim=1)

    def site_scores(
        self, windows: torch.Tensor, entry: torch.Tensor | None = None
    ) -> torch.Tensor:
        """Unnormalised scores (window, site, class); the sites are those of `sites`.

        Windows of gears with fewer teeth than others have scores of -10,000 behind their own.
        ``entry`` (window,) is the sample of a passage at which a tooth comes into mesh; it is
        estimated where it is None.
        """
        return self._answers(windows, self._start(windows, entry))["sites"]

    def entries(self, windows: torch.Tensor) -> torch.Tensor:
        """(window,) sample of a passage at which a tooth is estimated to come into mesh."""
        return self._start(windows, None)

    def sites(self, n_teeth: Sequence[int]) -> tuple[tuple[str, int], ...]:
        """Gear of `diagnose.data.targets.GEARS` and tooth of each site; -1 for no single tooth.

        Teeth are counted in the order of mesh from the first that comes into mesh.
        """
        whole = tuple((gear, -1) for gear in GEARS)
        teeth = tuple(
            (gear, tooth)
            for gear, number in zip(GEARS[1:], n_teeth, strict=True)
            for tooth in range(number)
        )
        return whole + teeth

    def answers(self, windows: torch.Tensor) -> dict[str, torch.Tensor]:
        """All outputs for windows, unnormalised.

        Returns
        -------
        classes, severity : (window, class)
        gear : (window, gear) log-probability of `diagnose.data.targets.GEARS`
        sites : (window, site, class)
        """
        return self._answers(windows, self._start(windows, None))

    def loss(
        self,
        windows: torch.Tensor,
        label: torch.Tensor,
        targets: Mapping[str, torch.Tensor],
        class_weight: torch.Tensor,
    ) -> torch.Tensor:
        """Cross-entropy of the class, of its site where it is known, and of the entry.

        Entries that are known are used, moved by a sample at random, and others are estimated.
        """
        start = self._start(windows, None)
        loss = self.input_scale.new_zeros(())
        if "entry" in targets:
            entry = targets["entry"]
            loss = loss + self.entry.loss(self._mean_passages(windows), entry)
            known = ~torch.isnan(entry)
            near = sample_of(torch.nan_to_num(entry), self.samples_per_tooth)
            near = near + torch.randint_like(near, -JITTER, JITTER + 1)
            start = torch.where(known, near, start)
        answers = self._answers(windows, start)
        loss = loss + cross_entropy(answers["classes"], label, weight=class_weight)
        loss = loss + SEVERITY_WEIGHT * further_loss(
            {"severity": answers["severity"]}, label, targets
        )
        if {"gear", "position", "entry"} <= set(targets):
            n_teeth = ToothBatch.of(windows).n_teeth
            site = self._known_site(targets, n_teeth)
            of_class = answers["sites"][torch.arange(len(label)), :, label]
            loss = loss + cross_entropy(of_class, site)
        return loss

    def _start(self, windows: torch.Tensor, entry: torch.Tensor | None) -> torch.Tensor:
        """(window,) sample of the passage at which a tooth comes into mesh, given or estimated."""
        if entry is not None:
            return entry
        with torch.no_grad():
            return self.entry.entry(self._mean_passages(windows))

    def _mean_passages(self, windows: torch.Tensor) -> torch.Tensor:
        """Mean passages (window, channel, sample) as they are recorded."""
        nothing = torch.zeros(len(windows), dtype=torch.long, device=windows.device)
        batch = ToothBatch.of(windows)
        passages = batch.passages(windows, nothing, self.samples_per_tooth, 0)
        return passages / self.input_scale

    def _answers(
        self, windows: torch.Tensor, start: torch.Tensor
    ) -> dict[str, torch.Tensor]:
        """Answers with teeth that come into mesh at given samples (window,) of a passage."""
        batch = ToothBatch.of(windows)
        numbers = self._sites(windows, batch, start)
        place = torch.arange(numbers.shape[1], device=windows.device) - len(GEARS)
        is_missing = place >= batch.n_teeth.sum(dim=1, keepdim=True)
        scores = self.head(numbers) - _log_sites(place, batch.n_teeth)[..., None]
        scores = scores.masked_fill(is_missing[..., None], NEVER)
        share = torch.softmax(scores, dim=1).detach()
        severity = (share * self.severity(numbers)).sum(dim=1)
        of_site = torch.logsumexp(log_softmax(scores.flatten(1), 1).view_as(scores), 2)
        on_driven = place >= batch.n_teeth[:, :1]
        gear = torch.where(place < 0, place + len(GEARS), 1 + on_driven.long())
        of_gear = [
            torch.logsumexp(of_site.masked_fill(gear != index, NEVER), dim=1)
            for index in range(len(GEARS))
        ]
        return {
            "classes": torch.logsumexp(scores, dim=1),
            "severity": severity,
            "gear": torch.stack(of_gear, dim=1),
            "sites": scores,
        }

    def _sites(
        self, windows: torch.Tensor, batch: ToothBatch, start: torch.Tensor
    ) -> torch.Tensor:
        """Numbers (window, site, number) that describe the sites; 0 for those that miss."""
        teeth = self._responses(windows, batch, start)
        mean = batch.means(teeth)
        spread = batch.spreads(teeth - batch.of_teeth(mean))
        whole = relu(self.of_gear(torch.cat([mean, spread], dim=1).flatten(1)))
        apart = batch.against_sisters(teeth, SPREAD_FLOOR)
        usual = self.of_usual(mean.flatten(1))
        single = relu(self._of_passages(batch, apart) + batch.of_teeth(usual))
        driving, driven = whole.split(len(windows))
        record = relu(self.of_record(torch.cat([driving, driven], dim=1)))
        sites = torch.stack([record, driving, driven], dim=1)
        n_most = int(batch.n_teeth.sum(dim=1).max())
        flat = single.new_zeros(len(windows) * n_most, single.shape[-1])
        flat = flat.index_copy(0, batch.window * n_most + batch.site, single)
        of_teeth = flat.view(len(windows), n_most, -1)
        return self.dropout(torch.cat([sites, of_teeth], dim=1))

    def _of_passages(self, batch: ToothBatch, apart: torch.Tensor) -> torch.Tensor:
        """Numbers (tooth, number) of the passages from the entry of each tooth.

        They are `of_tooth` of a tooth and of those that pass after it, (tooth, map, position).
        """
        assert self.of_tooth.bias is not None
        weights = self.of_tooth.weight.split(self.n_positions, dim=-1)
        numbers = self.of_tooth.bias.expand(len(apart), -1)
        for step, weight in enumerate(weights):
            of_passage = apart.flatten(1) @ weight.flatten(1).T
            numbers = numbers + of_passage.index_select(0, batch.neighbor(step))
        return numbers

    def _responses(
        self, windows: torch.Tensor, batch: ToothBatch, start: torch.Tensor
    ) -> torch.Tensor:
        """Responses (tooth, map, position) of the filters at every tooth."""
        n_samples, margin = self.samples_per_tooth, self.margins[0]
        passages = batch.passages(windows, start, n_samples, margin)
        usual = self.of_mesh(passages / self.input_scale)
        samples = batch.samples(windows, start, n_samples, margin, self.n_kinds)
        scale = self.input_scale.repeat(self.n_kinds, 1)
        responses = self.convolutions[0](samples / scale) + usual.index_select(
            0, batch.window
        )
        teeth = batch.against_sisters(
            _compressed(self.compression * responses), SPREAD_FLOOR
        )
        if self.level_samples:
            levels = self._levels(responses, batch)
            levels = batch.against_sisters(levels, SPREAD_FLOOR)
            teeth = torch.cat([teeth, levels], dim=1)
        teeth = relu_(teeth + self.threshold)
        for convolution, margin in zip(
            self.convolutions[1:], self.margins[1:], strict=True
        ):
            teeth = relu_(convolution(batch.with_margins(teeth, margin)))
        return teeth

    def _levels(self, responses: torch.Tensor, batch: ToothBatch) -> torch.Tensor:
        """Logarithms of the mean squares of responses (tooth, map, position) about each place.

        They tell how loud a tooth is, whatever the frequency at which the machine rings.
        """
        square = responses.square()
        usual = batch.of_teeth(batch.means(square).mean(dim=-1, keepdim=True))
        about = square @ self.about
        return torch.log(about / (usual + TINY) + LEVEL_FLOOR)

    def _known_site(
        self, targets: Mapping[str, torch.Tensor], n_teeth: torch.Tensor
    ) -> torch.Tensor:
        """(window,) site of the fault of each window, in the order of `sites`.

        ``n_teeth`` (window, gear) are those of the driving and the driven gear.
        """
        gear, position = targets["gear"], targets["position"]
        entry = torch.nan_to_num(targets["entry"])
        begin = sample_of(entry, self.samples_per_tooth) / self.samples_per_tooth
        passage = torch.round(torch.nan_to_num(position) - begin)
        site = gear.clone()
        first = torch.full_like(gear, len(GEARS))
        for index in range(1, len(GEARS)):
            of_gear = n_teeth[:, index - 1]
            tooth = torch.remainder(passage, of_gear)
            on_tooth = (gear == index) & ~torch.isnan(position)
            site = torch.where(on_tooth, first + tooth.long(), site)
            first = first + of_gear
        return site


def teeth_of(windows: torch.Tensor) -> list[int]:
    """Teeth of both gears of the first of some packed turns (window, channel, point)."""
    return windows[0, 0, :HEADER].round().long().tolist()


def _log_sites(place: torch.Tensor, n_teeth: torch.Tensor) -> torch.Tensor:
    """(window, site) logarithm of the number of teeth among which a site is one.

    ``place`` (site,) counts teeth from 0 and is below 0 for whole gears, whose logarithm is 0. A
    fault is as probable on a gear of many teeth as on one of few.
    """
    on_driven = place >= n_teeth[:, :1]
    teeth = torch.where(on_driven, n_teeth[:, 1:], n_teeth[:, :1])
    return torch.where(place < 0, 0.0, teeth.float().log())


def _positions(
    samples_per_tooth: int,
    widths: Sequence[int],
    kernels: Sequence[int],
    strides: Sequence[int],
) -> int:
    """Positions of a passage after all convolutions.

    Raises
    ------
    ConfigError    for lists that do not fit, even kernels, kernels longer than the passages on
        either side of a tooth, and strides that do not divide a passage
    """
    check_blocks(widths, kernels, strides)
    if any(kernel % 2 == 0 for kernel in kernels):
        raise ConfigError(
            "model: kernels must be odd, so that a turn stays as long as it is"
        )
    shrunk = math.prod(strides)
    if samples_per_tooth % shrunk:
        raise ConfigError(
            f"model: strides make {shrunk} samples one, which does not divide the "
            f"{samples_per_tooth} samples of a tooth"
        )
    length = samples_per_tooth
    for kernel, stride in zip(kernels, strides, strict=True):
        if kernel // 2 > length:
            raise ConfigError(
                f"model: a kernel of {kernel} reaches beyond the neighboring teeth, "
                f"{length} samples each: take a shorter one"
            )
        length //= stride
    return length


def _checked_level(level_samples: int) -> int:
    """The number of samples, which must be odd or 0."""
    if level_samples < 0 or (level_samples and level_samples % 2 == 0):
        raise ConfigError(
            f"model: level_samples must be odd, or 0 for none, not {level_samples}"
        )
    return level_samples


def _means_about(n_places: int, n_samples: int) -> torch.Tensor:
    """(place, place) weights of the mean over so many places about each, fewer at the ends."""
    place = torch.arange(n_places)
    near = (place - place[:, None]).abs() <= n_samples // 2
    return near / near.sum(dim=0)


def _compressed(responses: torch.Tensor) -> torch.Tensor:
    """Responses of the same sign that grow as the root of large ones."""
    return responses * torch.rsqrt(1.0 + responses.abs())
