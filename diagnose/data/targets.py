"""Further targets of a training: severity, gear and tooth of the fault of a record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn.functional import (
    binary_cross_entropy_with_logits,
    cross_entropy,
    log_softmax,
)

from diagnose.data.teeth import START
from diagnose.data.windows import FloatArray, IntArray

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

# The gear that has the fault; none: neither of the two whose turns networks look at.
GEARS = ("none", "pinion", "wheel")

# Base pitches before and after a tooth comes into mesh, in which its fault may show; assumed.
BEFORE, AFTER = 0.3, 2.2
NEVER = -30.0  # log-probability of positions that are not the fault's
TOOTH_COLUMNS = ("fault_gear", "fault_tooth", *START)


def record_targets(dataset: Dataset, record: IntArray) -> dict[str, NDArray[Any]]:
    """Severity and gear of each window's record, if the data set has them.

    Returns
    -------
    severity : (window,) from 0 to 1, NaN for a healthy record
    gear : (window,) index in `diagnose.data.targets.GEARS`; faults of the further gears of a
        drive line are on none of them
    """
    targets: dict[str, NDArray[Any]] = {}
    if "severity" in dataset.column_names:
        severity = np.asarray(dataset.column("severity"), dtype=np.float32)[record]
        targets["severity"] = np.where(severity > 0, severity, np.float32(np.nan))
    if "fault_gear" in dataset.column_names:
        names = np.asarray(dataset.column("fault_gear"))[record]
        numbers = {gear: number for number, gear in enumerate(GEARS)}
        gears = [numbers.get(str(name), 0) for name in names]
        targets["gear"] = np.array(gears, dtype=np.int64)
    return targets


def fault_positions(
    dataset: Dataset,
    record: IntArray,
    passages: FloatArray,
    n_teeth: IntArray,
) -> FloatArray:
    """Positions on a gear's turn at which the fault comes into mesh.

    They are counted in teeth from the first sample of the window.

    Parameters
    ----------
    dataset, record : (window,) record of each window
    passages : (window,) passages of a tooth from the record's first sample to the window's
    n_teeth : (window, gear) of pinion and wheel

    Returns
    -------
    (window,) from 0 to the gear's teeth; NaN without a fault of one tooth, or if the data set
    lacks one of `TOOTH_COLUMNS`
    """
    position = np.full(len(record), np.nan)
    if not set(TOOTH_COLUMNS) <= set(dataset.column_names):
        return position
    column = {name: np.asarray(dataset.column(name))[record] for name in TOOTH_COLUMNS}
    for gear, teeth in zip(GEARS[1:], n_teeth.T, strict=True):
        on_gear = (column["fault_gear"] == gear) & (column["fault_tooth"] >= 0)
        first = column[f"start_tooth_{gear}"] + column["start_phase"] + passages
        position[on_gear] = np.mod(column["fault_tooth"] - first, teeth)[on_gear]
    return position


def tooth_entries(
    dataset: Dataset, record: IntArray, passages: FloatArray
) -> NDArray[np.float32]:
    """Places in a passage at which a tooth comes into mesh, the same for both gears.

    Parameters
    ----------
    dataset, record : (window,) record of each window
    passages : (window,) passages of a tooth from the record's first sample to the window's

    Returns
    -------
    (window,) share of a passage from the first sample of the window to the next entry; NaN if
    the data set does not say the start
    """
    if START[0] not in dataset.column_names:
        return np.full(len(record), np.nan, dtype=np.float32)
    phase = np.asarray(dataset.column(START[0]), dtype=float)[record]
    return np.mod(-phase - passages, 1.0).astype(np.float32)


def further_loss(
    answers: Mapping[str, torch.Tensor],
    label: torch.Tensor,
    targets: Mapping[str, torch.Tensor],
) -> torch.Tensor:
    """Sum of the losses of the severity and gear heads of a batch, if there are any.

    Parameters
    ----------
    answers : of `diagnose.networks.network.Network.answers`
    label : (window,) class, whose severity counts
    targets : of `record_targets`; a missing target and a NaN severity do not count
    """
    loss = next(iter(answers.values())).new_zeros(())
    if "severity" in answers and "severity" in targets:
        known = ~torch.isnan(targets["severity"])
        if known.any():
            predicted = answers["severity"][known, label[known]]
            true = targets["severity"][known]
            loss = loss + binary_cross_entropy_with_logits(predicted, true)
    if "gear" in answers and "gear" in targets:
        loss = loss + cross_entropy(answers["gear"], targets["gear"])
    return loss


def position_loss(
    places: torch.Tensor,
    label: torch.Tensor,
    gear: torch.Tensor,
    position: torch.Tensor,
    turns: Sequence[tuple[int, int]],
) -> torch.Tensor:
    """Loss of scores along a turn, which is small if they point at the tooth with the fault.

    The label of a record means that some tooth of a gear is bad. A simulated record also names
    it. Without that a network has to find by itself which of all teeth made the label, and
    learns the healthy teeth of its training gears by heart.

    Parameters
    ----------
    places : (window, class, position) scores along the turns of the `turns`, one after the other
    label : (window,) class
    gear : (window,) of `record_targets`; windows of gears outside `turns` do not count
    position : (window,) teeth, of `fault_positions`; NaN does not count
    turns : gear, as in ``gear``, and teeth of each gear that is looked at

    Returns
    -------
    mean over the windows that count of the negative log of the share of ``exp(score)`` at the
    fault; 0 if there are none
    """
    looked_at = torch.stack([gear == index for index, _ in turns]).any(dim=0)
    counted = torch.nonzero(looked_at & ~torch.isnan(position)).squeeze(1)
    if counted.numel() == 0:
        return places.new_zeros(())
    per_tooth = places.shape[-1] / sum(teeth for _, teeth in turns)
    inside = []
    for index, teeth in turns:
        at = torch.arange(round(teeth * per_tooth), device=places.device) / per_tooth
        since = torch.remainder(at[None] - position[counted, None], teeth)
        near = (since < AFTER) | (since > teeth - BEFORE)
        inside.append(near & (gear[counted, None] == index))
    share = log_softmax(places[counted, label[counted]], dim=1)
    at_fault = share.masked_fill(~torch.cat(inside, dim=1), NEVER)
    return -torch.logsumexp(at_fault, dim=1).mean()
