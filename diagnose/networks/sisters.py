"""Operations on the teeth of a batch of turns that have gradients in closed form.

Torch's own operations would pass over the teeth of the whole batch some thirty times. Here a turn
is standardised while it lies in the cache of a processor.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, final

import torch

TINY = 1e-12  # under a root, for its gradient at 0


def standardised(
    teeth: torch.Tensor, counts: Sequence[int], floor: float
) -> torch.Tensor:
    """Values standardised over the teeth of their turn, place by place.

    Parameters
    ----------
    teeth : (tooth, ...) the teeth of a turn one after the other, turn by turn
    counts : teeth of each turn
    floor : added to the spread of the teeth

    Returns
    -------
    (tooth, ...) deviations from the mean over the teeth, over their root mean square and ``floor``
    """
    result: torch.Tensor = _Standardised.apply(teeth, tuple(counts), floor)
    return result


def permuted(
    teeth: torch.Tensor, place: torch.Tensor, inverse: torch.Tensor
) -> torch.Tensor:
    """Values (tooth, ...) in another order.

    Parameters
    ----------
    place : (tooth,) where each value is taken from, every place once
    inverse : (tooth,) where it is taken back from
    """
    result: torch.Tensor = _Permuted.apply(teeth, place, inverse)
    return result


@final
class _Standardised(torch.autograd.Function):
    """Standardised values and their derivative."""

    @staticmethod
    def forward(
        ctx: Any, teeth: torch.Tensor, counts: tuple[int, ...], floor: float
    ) -> torch.Tensor:
        result = torch.empty_like(teeth)
        spreads = teeth.new_empty(len(counts), *teeth.shape[1:])
        turns = zip(teeth.split(counts), result.split(counts), spreads, strict=True)
        for turn, apart, spread in turns:
            torch.sub(turn, turn.mean(dim=0), out=apart)
            spread.copy_(apart.square().mean(dim=0).add_(TINY).sqrt_())
            apart.div_(spread + floor)
        ctx.save_for_backward(result, spreads)
        ctx.counts, ctx.floor = counts, floor
        return result

    @staticmethod
    def backward(ctx: Any, *gradients: torch.Tensor) -> tuple[torch.Tensor, None, None]:
        # With the mean m, a = x - m, s = sqrt(mean(a^2) + TINY) and z = a / (s + floor):
        # dx = (g - mean(g)) / (s + floor) - z mean(g z) / s
        result, spreads = ctx.saved_tensors
        of_teeth = torch.empty_like(result)
        turns = zip(
            gradients[0].split(ctx.counts),
            result.split(ctx.counts),
            of_teeth.split(ctx.counts),
            spreads,
            strict=True,
        )
        for gradient, apart, of_turn, spread in turns:
            along = torch.mul(gradient, apart).mean(dim=0).div_(spread)
            torch.sub(gradient, gradient.mean(dim=0), out=of_turn)
            of_turn.div_(spread + ctx.floor).addcmul_(apart, along, value=-1.0)
        return of_teeth, None, None


@final
class _Permuted(torch.autograd.Function):
    """Another order; the derivative is put back in the first one, without sums."""

    @staticmethod
    def forward(
        ctx: Any, teeth: torch.Tensor, place: torch.Tensor, inverse: torch.Tensor
    ) -> torch.Tensor:
        ctx.save_for_backward(inverse)
        return teeth.index_select(0, place)

    @staticmethod
    def backward(ctx: Any, *gradients: torch.Tensor) -> tuple[torch.Tensor, None, None]:
        (inverse,) = ctx.saved_tensors
        return gradients[0].index_select(0, inverse), None, None
