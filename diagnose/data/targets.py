"""What a training knows of its records beside the class.

How severe the fault is, on which gear, and at which tooth.
"""

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

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

FloatArray = NDArray[np.floating]
Targets = Mapping[str, NDArray[Any]]

GEARS = ("none", "pinion", "wheel")  # the gear that has the fault

BEFORE, AFTER = (
    0.3,
    2.2,
)  # base pitches about where a tooth comes into mesh, in which its fault may show; assumed
NEVER = -30.0  # log-probability of places that are not the fault's


def record_targets(
    dataset: Dataset, record: NDArray[np.integer]
) -> dict[str, NDArray[Any]]:
    """Severity and gear of each window's record, as far as the data set has them.

    Returns
    -------
    severity : (window,) from 0 to 1, NaN for a sound record
    gear : (window,) index in `diagnose.data.targets.GEARS`
    """
    found: dict[str, NDArray[Any]] = {}
    if "severity" in dataset.column_names:
        severity = np.asarray(dataset.column("severity"), dtype=np.float32)[record]
        found["severity"] = np.where(severity > 0, severity, np.float32(np.nan))
    if "fault_gear" in dataset.column_names:
        names = np.asarray(dataset.column("fault_gear"))[record]
        found["gear"] = np.array(
            [GEARS.index(str(name) or GEARS[0]) for name in names], dtype=np.int64
        )
    return found


def fault_places(
    dataset: Dataset,
    record: NDArray[np.integer],
    passages: FloatArray,
    n_teeth: Sequence[int],
) -> FloatArray:
    """Where on its gear's turn a fault comes into mesh, in teeth from the first sample of the
    window.

    Parameters
    ----------
    dataset, record : (window,) record of each window
    passages : (window,) passages of a tooth from the record's first sample to the window's
    n_teeth : of pinion and wheel

    Returns
    -------
    (window,) from 0 to the gear's teeth; NaN without a fault of one tooth, or if the data set does not tell
    """
    place = np.full(len(record), np.nan)
    needed = (
        "fault_gear",
        "fault_tooth",
        "start_phase",
        "start_tooth_pinion",
        "start_tooth_wheel",
    )
    if not set(needed) <= set(dataset.column_names):
        return place
    column = {name: np.asarray(dataset.column(name))[record] for name in needed}
    for gear, teeth in zip(GEARS[1:], n_teeth, strict=True):
        mine = (column["fault_gear"] == gear) & (column["fault_tooth"] >= 0)
        first = column[f"start_tooth_{gear}"] + column["start_phase"] + passages
        place[mine] = np.mod(column["fault_tooth"] - first, teeth)[mine]
    return place


def further_loss(
    answers: Mapping[str, torch.Tensor],
    label: torch.Tensor,
    targets: Mapping[str, torch.Tensor],
) -> torch.Tensor:
    """Loss of the severity and gear heads of a batch, those that there are, each weighing as much
    as the other.

    Parameters
    ----------
    answers : of `diagnose.networks.network.Network.answers`
    label : (window,) class, whose severity counts
    targets : of `record_targets`; a NaN severity does not count, and what is missing does not either
    """
    loss = next(iter(answers.values())).new_zeros(())
    if "severity" in answers and "severity" in targets:
        known = ~torch.isnan(targets["severity"])
        if known.any():
            said = answers["severity"][known, label[known]]
            loss = loss + binary_cross_entropy_with_logits(
                said, targets["severity"][known]
            )
    if "gear" in answers and "gear" in targets:
        loss = loss + cross_entropy(answers["gear"], targets["gear"])
    return loss


def place_loss(
    places: torch.Tensor,
    label: torch.Tensor,
    gear: torch.Tensor,
    place: torch.Tensor,
    turns: Sequence[tuple[int, int]],
) -> torch.Tensor:
    """How far the scores of a fault's own class are from pointing at its tooth.

    A record says that somewhere on a gear one tooth is bad; a simulated one also says which.
    Without that a network has to find out by itself which of all teeth made the label, and learns
    the sound teeth of its training gears by heart.

    Parameters
    ----------
    places : (window, class, place) scores along the turns of the gears looked at, one after the other
    label : (window,) class
    gear : (window,) of `record_targets`; windows of gears that are not looked at are not counted
    place : (window,) teeth, of `fault_places`; NaN is not counted
    turns : gear, as in ``gear``, and teeth of each gear looked at

    Returns
    -------
    mean over the windows counted of the negative log of the share of ``exp(score)`` at the fault; 0 if there is none
    """
    looked_at = torch.stack([gear == index for index, _ in turns]).any(dim=0)
    counted = torch.nonzero(looked_at & ~torch.isnan(place)).squeeze(1)
    if counted.numel() == 0:
        return places.new_zeros(())
    per_tooth = places.shape[-1] / sum(teeth for _, teeth in turns)
    inside = []
    for index, teeth in turns:
        at = torch.arange(round(teeth * per_tooth), device=places.device) / per_tooth
        since = torch.remainder(at[None] - place[counted, None], teeth)
        inside.append(
            ((since < AFTER) | (since > teeth - BEFORE))
            & (gear[counted, None] == index)
        )
    share = log_softmax(places[counted, label[counted]], dim=1)
    return -torch.logsumexp(
        share.masked_fill(~torch.cat(inside, dim=1), NEVER), dim=1
    ).mean()
