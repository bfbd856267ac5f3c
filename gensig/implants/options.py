"""Choices of a set of implants."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gensig.errors import ConfigError

PATHS = ("twin", "none")
RESIDUALS = ("physics", "noise_bursts", "shuffled_phases", "none")
MOST_RECORDS = 1_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class ImplantOptions:
    """Choices of a set of implants.

    Attributes
    ----------
    gain_db : dB    ends of the uniform law of the residual's level over the carrier's
    path : "twin" fits the response from the simulated sensor to the carrier's, "none" leaves it out
    residual : "physics", or a control: "noise_bursts", "shuffled_phases", "none"
    n_records : of the set
    duration : s    of a record; None is by the length of the recordings
    held_out : share of the blocks of each recording, its last ones, that carry nothing
    plain_healthy : share of the healthy records that carry nothing, as the machine itself does
    seed : every drawn number follows from it

    Raises
    ------
    ConfigError    with one line, for a value that cannot be used
    """

    gain_db: tuple[float, float] = (-10.0, 10.0)
    path: str = "twin"
    residual: str = "physics"
    n_records: int = 600
    duration: float | None = None
    held_out: float = 0.25
    plain_healthy: float = 0.5
    seed: int = 0

    def __post_init__(self) -> None:
        low, high = self.gain_db
        if not (
            math.isfinite(low) and math.isfinite(high) and -60 <= low <= high <= 60
        ):
            raise ConfigError(
                f"--gain-db {low:g} {high:g}: give the lower end first, both in -60..60 dB"
            )
        for name, value, allowed in (
            ("--path", self.path, PATHS),
            ("--residual", self.residual, RESIDUALS),
        ):
            if value not in allowed:
                raise ConfigError(f"{name} {value}: allowed are {', '.join(allowed)}")
        if not 1 <= self.n_records <= MOST_RECORDS:
            raise ConfigError(
                f"--records {self.n_records} must lie in 1..{MOST_RECORDS}"
            )
        if self.duration is not None and not 0.0 < self.duration < math.inf:
            raise ConfigError(f"--duration {self.duration:g} s must be positive")
        if not 0.0 < self.held_out < 1.0:
            raise ConfigError(
                f"--held-out {self.held_out:g} must be a share between 0 and 1"
            )
        if not 0.0 <= self.plain_healthy <= 1.0:
            raise ConfigError(
                f"--plain-healthy {self.plain_healthy:g} must be a share from 0 to 1"
            )
        if self.seed < 0:
            raise ConfigError(f"--seed {self.seed} must not be negative")
