"""Options of the integration: the section ``solver`` of a configuration."""

from __future__ import annotations

from dataclasses import dataclass

from gensig.dynamics._vector import PRECISIONS
from gensig.dynamics.backends.registry import BACKENDS, DEFAULT_BACKEND
from gensig.errors import ConfigError

FINEST = 64  # steps per sample that are tried where the error is too large


@dataclass(frozen=True, slots=True, kw_only=True)
class Solver:
    """Options of the integration.

    Parameters
    ----------
    oversampling : internal steps per output sample
    precision : of the numbers, ``float64`` or ``float32``
    max_error : a record with a larger error is integrated again with twice as many steps, up to
        64; None does not compute the error
    backend : the method, a name in ``BACKENDS``
    """

    oversampling: int
    precision: str
    max_error: float | None = None
    backend: str = DEFAULT_BACKEND

    def __post_init__(self) -> None:
        if not 2 <= self.oversampling <= 256:
            raise ConfigError(
                f"solver.oversampling = {self.oversampling} must lie in 2..256"
            )
        if self.precision not in PRECISIONS:
            raise ConfigError(
                f"solver.precision = {self.precision!r}; allowed: {', '.join(PRECISIONS)}"
            )
        if self.max_error is not None and not 1e-6 <= self.max_error <= 1.0:
            raise ConfigError(
                f"solver.max_error = {self.max_error:g} must lie in 1e-6..1, or be null"
            )
        if self.backend not in BACKENDS:
            raise ConfigError(
                f"solver.backend = {self.backend!r}; allowed: {', '.join(BACKENDS)}"
            )
