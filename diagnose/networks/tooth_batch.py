"""Teeth of all gears of a batch in one axis, whatever their numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self, final

import torch

from diagnose.data.packed_turns import HEADER
from diagnose.networks.sisters import TINY, permuted, standardised


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class ToothBatch:
    """Places of the teeth of packed turns, see `diagnose.data.packed_turns`.

    All driving gears come first, window by window, then all driven ones.

    Attributes
    ----------
    n_teeth : (window, gear) of the driving and the driven gear
    window : (tooth,) window of each tooth
    gear : (tooth,) 0 for driving, 1 for driven
    number : (tooth,) in its gear, from the first that passes
    first : (tooth,) place of tooth 0 of its gear
    """

    n_teeth: torch.Tensor
    window: torch.Tensor
    gear: torch.Tensor
    number: torch.Tensor
    first: torch.Tensor

    @classmethod
    def of(cls, windows: torch.Tensor) -> Self:
        """Teeth of packed turns (window, channel, point)."""
        n_teeth = windows[:, 0, :HEADER].round().long()
        n_windows = len(n_teeth)
        counts = n_teeth.T.flatten()
        turn = torch.arange(len(counts), device=windows.device)
        turn_of = turn.repeat_interleave(counts)
        first = (counts.cumsum(0) - counts)[turn_of]
        place = torch.arange(len(turn_of), device=windows.device)
        return cls(
            n_teeth=n_teeth,
            window=turn_of % n_windows,
            gear=turn_of // n_windows,
            number=place - first,
            first=first,
        )

    @property
    def counts(self) -> list[int]:
        """Teeth of each turn, the driving gears of all windows first."""
        counts: list[int] = self.n_teeth.T.flatten().tolist()
        return counts

    @property
    def turn(self) -> torch.Tensor:
        """(tooth,) turn of each tooth: its window, behind all windows for the driven gear."""
        return self.gear * len(self.n_teeth) + self.window

    @property
    def count(self) -> torch.Tensor:
        """(tooth,) teeth of the gear of each tooth."""
        return self.n_teeth[self.window, self.gear]

    @property
    def site(self) -> torch.Tensor:
        """(tooth,) number of each tooth among those of both gears of its window."""
        return self.number + self.gear * self.n_teeth[self.window, 0]

    def neighbor(self, steps: int) -> torch.Tensor:
        """(tooth,) place of the tooth that passes some teeth later."""
        return self.first + (self.number + steps) % self.count

    def samples(
        self,
        windows: torch.Tensor,
        start: torch.Tensor,
        n_samples: int,
        margin: int,
        n_kinds: int,
    ) -> torch.Tensor:
        """Samples of every tooth and of its neighbors beside it.

        Parameters
        ----------
        windows : (window, channel, point) packed turns of one or more kinds
        start : (window,) sample of a passage at which teeth begin
        n_samples : of a passage
        margin : samples before and behind
        n_kinds : of turns of either gear

        Returns
        -------
        (tooth, channel, sample) the channels of the first kind of turns first
        """
        counts, starts = self.n_teeth.tolist(), start.tolist()
        teeth = []
        for gear in range(self.n_teeth.shape[1]):
            for window, n_teeth, entry in zip(windows, counts, starts, strict=True):
                turn = _turn(window, n_teeth, gear, n_samples, n_kinds)
                turn = turn.roll(margin - entry, dims=-1)
                wide = torch.cat([turn, turn[:, : 2 * margin]], dim=-1)
                teeth.append(wide.unfold(-1, n_samples + 2 * margin, n_samples))
        return torch.cat(teeth, dim=1).transpose(0, 1)

    def passages(
        self, windows: torch.Tensor, start: torch.Tensor, n_samples: int, margin: int
    ) -> torch.Tensor:
        """Mean passages (window, channel, sample), as `samples` has those of teeth."""
        at = torch.arange(-margin, n_samples + margin, device=windows.device)
        begin = HEADER + n_samples * self.n_teeth.sum(dim=1)
        index = begin[:, None] + (at + start[:, None]) % n_samples
        window = torch.arange(len(windows), device=windows.device)
        return windows[window[:, None], :, index].transpose(1, 2)

    def means(self, teeth: torch.Tensor) -> torch.Tensor:
        """Means (turn, ...) over the teeth of every turn, of values (tooth, ...)."""
        counts = self.n_teeth.T.flatten()
        sums = teeth.new_zeros(len(counts), *teeth.shape[1:])
        sums = sums.index_add(0, self.turn, teeth)
        return sums / counts.view(-1, *[1] * (teeth.ndim - 1))

    def spreads(self, apart: torch.Tensor) -> torch.Tensor:
        """Root mean squares (turn, ...) over the teeth of every turn."""
        return torch.sqrt(self.means(apart.square()) + TINY)

    def against_sisters(self, teeth: torch.Tensor, floor: float) -> torch.Tensor:
        """Values (tooth, ...) standardised over the teeth of their turn, place by place.

        ``floor`` is added to the spread of the teeth.
        """
        return standardised(teeth, self.counts, floor)

    def of_teeth(self, turns: torch.Tensor) -> torch.Tensor:
        """Values (tooth, ...) of the turn of every tooth, of values (turn, ...)."""
        return turns.index_select(0, self.turn)

    def with_margins(self, teeth: torch.Tensor, margin: int) -> torch.Tensor:
        """Values (tooth, map, place) with the last and first places of the neighbors beside."""
        if margin == 0:
            return teeth
        last, next_ = self.neighbor(-1), self.neighbor(1)
        before = permuted(teeth[..., -margin:], last, next_)
        behind = permuted(teeth[..., :margin], next_, last)
        return torch.cat([before, teeth, behind], dim=-1)


def _turn(
    window: torch.Tensor,
    n_teeth: Sequence[int],
    gear: int,
    n_samples: int,
    n_kinds: int,
) -> torch.Tensor:
    """Turns (channel, sample) of one gear in packed turns (channel, point), kind by kind."""
    length, both = n_samples * n_teeth[gear], n_samples * sum(n_teeth)
    begin = HEADER + n_samples * sum(n_teeth[:gear])
    kinds = [window[:, begin : begin + length]]
    begin += n_samples  # the mean passage stands behind the first kind
    for kind in range(1, n_kinds):
        first = begin + kind * both
        kinds.append(window[:, first : first + length])
    return torch.cat(kinds)
