"""Networks of remaining lives on disk: the files of a classifier, the hours and the intervals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from diagnose.scoring.life_scores import intervals_hold
from diagnose.training.store import (
    DESCRIPTION,
    ModelDescription,
    load_weights,
    model_description,
    read_description,
    save_model,
)
from gensig.errors import DatasetError

if TYPE_CHECKING:
    from diagnose.data.windows import Task
    from diagnose.networks.domain import Domain
    from diagnose.settings import TrainSettings
    from diagnose.training.life_network import LifeNetwork

AGE = "life_time_h"


@dataclass(frozen=True, slots=True, kw_only=True)
class LifeFacts:
    """What a network of remaining lives says and is told; ``remaining_life`` in ``model.json``.

    Attributes
    ----------
    method : of the report, with or without the age
    early_life_h : level at which it was trained that lives are cut
    half_width_h : of the intervals about what it says of a record
    coverage : share of snapshots of new lives that they are to hold
    n_calibration_lives : validation lives that they come from
    told : columns that it is told beside the signal, in its order
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
        if not 0 < self.early_life_h < float("inf") or not 0 <= self.half_width_h <= self.early_life_h:
            raise ValueError(f"early_life_h {self.early_life_h!r} and half_width_h {self.half_width_h!r} are no hours")
        if not 0 < self.coverage < 1:
            raise ValueError(f"coverage {self.coverage!r} must lie between 0 and 1")
        if set(self.told) != set(self.told_range):
            raise ValueError("told and told_range name different columns")

    @property
    def intervals_hold(self) -> bool:
        """Whether there were enough calibration lives for an interval that says something."""
        return intervals_hold(self.n_calibration_lives, self.coverage)


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredLife:
    """A trained network as it goes on disk; `diagnose.training.store.Trained` for its description.

    Attributes
    ----------
    facts : what it says and is told
    weights : name -> array
    domain : what it takes for known
    protocol, seed, best_epoch : of its training
    temperature : 1, there are no probabilities
    """

    facts: LifeFacts
    weights: dict[str, np.ndarray]
    domain: Domain | None
    protocol: str
    seed: int
    best_epoch: int
    temperature: float = 1.0


def save_life_model(folder: Path, task: Task, settings: TrainSettings, stored: StoredLife) -> None:
    """Write a network into a new folder."""
    description = replace(model_description(task, settings, stored), remaining_life=asdict(stored.facts))
    known = {} if stored.domain is None else stored.domain.tensors()
    save_model(folder, stored.weights | known, description)


def load_life_model(folder: str | Path) -> tuple[LifeNetwork, ModelDescription, LifeFacts]:
    """Network in evaluation mode, its description, and what its hours are.

    Raises
    ------
    DatasetError    for a folder without the two files, another schema, a classifier, or weights that do not belong to
        the network
    """
    from diagnose.training.life_network import LifeNetwork

    folder = Path(folder)
    description = read_description(folder)
    if description.remaining_life is None:
        raise DatasetError(f"{folder} is a classifier and says no remaining life: train with task=remaining_life")
    facts = _facts(folder, description.remaining_life)
    n_told = len(facts.told)
    ones = [1.0] * len(description.channel_names)
    model = LifeNetwork(description.model, ones, np.zeros(n_told), np.ones(n_told))
    load_weights(model, folder)
    return model.eval(), description, facts


def _facts(folder: Path, content: Mapping[str, Any]) -> LifeFacts:
    try:
        ranges = {str(name): (float(low), float(high)) for name, (low, high) in content["told_range"].items()}
        numbers = {name: float(content[name]) for name in ("early_life_h", "half_width_h", "coverage")}
        return LifeFacts(
            **{
                **content,
                **numbers,
                "n_calibration_lives": int(content["n_calibration_lives"]),
                "told": tuple(str(name) for name in content["told"]),
                "told_range": ranges,
            }
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        reason = " ".join(str(error).split())[:160]
        raise DatasetError(f"{folder / DESCRIPTION} does not describe a model of remaining lives: {reason}") from None
