"""Facts of a stored network of remaining lives: its hours, intervals and inputs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from diagnose.scoring.life_scores import intervals_hold
from diagnose.training.description_checks import LIFE, LIFE_COLUMNS

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


def life_facts(name: str, value: Any) -> LifeFacts:
    """Facts of the content of ``model.json``."""
    return LifeFacts(**LIFE(name, value))
