"""At what speed and load a machine runs, and what drives it."""

from __future__ import annotations

from dataclasses import dataclass

from gensig.errors import ConfigError
from gensig.units import from_si, unit


@dataclass(frozen=True, slots=True, kw_only=True)
class Operating:
    """Set-point of the driving pinion and the soft speed source that holds it.

    The driver is T = T_set + k (integral of the set speed - angle) + c (set speed - speed), with k and c giving
    ``drive_frequency`` and ``drive_damping_ratio`` on the inertia reduced to the pinion.
    """

    speed: float = unit("rpm")
    torque: float = unit("nm")
    duration: float = unit("s")
    drive_frequency: float = unit("hz")
    drive_damping_ratio: float

    def __post_init__(self) -> None:
        for key, suffix in (("speed", "rpm"), ("torque", "nm"), ("duration", "s"), ("drive_frequency", "hz")):
            value = getattr(self, key)
            if not value > 0.0:
                name = f"{key}_{suffix}"
                raise ConfigError(f"operating.{name} = {from_si(name, value):g} must be positive")
        if not 0.0 < self.drive_damping_ratio <= 10.0:
            raise ConfigError(f"operating.drive_damping_ratio = {self.drive_damping_ratio:g} must lie in 0..10")
