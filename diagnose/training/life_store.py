"""Stored networks of remaining lives: the files of a classifier, with hours and intervals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from diagnose.scoring.life_scores import intervals_hold
from diagnose.training.description_checks import LIFE, LIFE_COLUMNS
from diagnose.training.model_files import DESCRIPTION, one_line
from diagnose.training.store import (
    ModelDescription,
    read_description,
    with_weights,
)
from gensig.errors import DatasetError

if TYPE_CHECKING:
    from diagnose.training.remaining_life import LifeNetwork

AGE = "life_time_h"


@dataclass(frozen=True, slots=True, kw_only=True)
class LifeFacts:
    """Hours, intervals and inputs of a network; ``remaining_life`` in ``model.json``.

    Attributes
    ----------
    method : of the report, with or without the age
    early_life_h : level at which lives are cut in the training
    half_width_h : of the intervals about the predictions for records
    coverage : share of snapshots of new lives that the intervals should hold
    n_calibration_lives : number of validation lives behind the intervals
    told : columns that the network takes with the signal, in its order
    told_range : column -> least and greatest value of the training records
    """

    method: str
    early_life_h: float
    half_width_h: float
    coverage: float
    n_calibration_lives: int
    told: tuple[str, ...]
    told_range: dict[str, tuple[float, float]]

    def __post_init__(self) -> None:
        is_level = 0 < self.early_life_h < float("inf")
        if not (is_level and 0 <= self.half_width_h <= self.early_life_h):
            raise ValueError(
                f"early_life_h {self.early_life_h!r} and half_width_h "
                f"{self.half_width_h!r} are no hours"
            )
        if not 0 < self.coverage < 1:
            raise ValueError(f"coverage {self.coverage!r} must lie between 0 and 1")
        if set(self.told) != set(self.told_range):
            raise ValueError("told and told_range name different columns")
        if unknown := set(self.told) - set(LIFE_COLUMNS):
            raise ValueError(
                f"told names {', '.join(sorted(unknown))}; known: {', '.join(LIFE_COLUMNS)}"
            )

    @property
    def intervals_hold(self) -> bool:
        """True if there were enough calibration lives for intervals of the coverage."""
        return intervals_hold(self.n_calibration_lives, self.coverage)


def load_life_model(
    folder: str | Path,
) -> tuple[LifeNetwork, ModelDescription, LifeFacts]:
    """Network in evaluation mode, its description, and the facts of its hours.

    Raises
    ------
    DatasetError    for a folder without the two files, another schema, a classifier, or weights
        that do not belong to the network
    """
    from diagnose.training.remaining_life import LifeNetwork

    folder = Path(folder)
    description = read_description(folder)
    if description.remaining_life is None:
        raise DatasetError(
            f"{folder} is a classifier and says no remaining life: "
            "train with task=remaining_life"
        )
    facts = _facts(folder, description.remaining_life)
    n_told = len(facts.told)
    ones = [1.0] * len(description.channel_names)

    def build() -> LifeNetwork:
        told = np.zeros(n_told), np.ones(n_told)
        return LifeNetwork(description.network, ones, *told)

    silent = np.zeros((1, n_told), np.float32)
    return with_weights(build, description, folder, (silent,)), description, facts


def _facts(folder: Path, content: Mapping[str, Any]) -> LifeFacts:
    try:
        values = LIFE("remaining_life", content)
        return LifeFacts(**values)
    except (TypeError, ValueError) as error:
        reason = one_line(error)
        raise DatasetError(
            f"{folder / DESCRIPTION} does not describe a model of remaining lives: {reason}"
        ) from None
