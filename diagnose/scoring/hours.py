"""Hours of a trained method: level at which lives are cut, intervals, and further inputs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from diagnose.data.windows import FloatArray

AGE = "life_time_h"
# columns that a network of remaining lives may take beside the signal
LIFE_COLUMNS = ("speed_rpm", "torque_nm", AGE)


@dataclass(frozen=True, slots=True, kw_only=True)
class LifeFacts:
    """Hours, intervals and inputs of a method; of a network ``remaining_life`` in ``model.json``.

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
    told: tuple[str, ...] = ()
    told_range: dict[str, tuple[float, float]] = field(default_factory=dict)

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


def interval(
    predicted: FloatArray, half_width: float, early_life: float
) -> tuple[FloatArray, FloatArray]:
    """Lower and upper ends in h about predictions, (...) each.

    The early level stands for itself and all longer lives.
    """
    low = np.maximum(predicted - half_width, 0.0)
    return low, np.minimum(predicted + half_width, early_life)


def intervals_hold(n_lives: int, coverage: float) -> bool:
    """True if the calibration lives are enough for a coverage, see `conformal_half_width`."""
    return bool((n_lives + 1) * (1 - coverage) >= 1 - 1e-9)
