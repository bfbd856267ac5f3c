"""The backends of gear pairs by the name that ``solver.backend`` takes."""

from gensig.dynamics.backends.base import Backend
from gensig.dynamics.backends.nystroem.method import Nystroem

# of gear pairs, and of drive lines: ``gensig.driveline.side_by_side``
EXPLICIT_BACKEND = "nystroem"
# of configurations that name none, as those of version 0.9.0; left with 0.19.0
RETIRED_BACKEND = "runge_kutta"
# the implicit method of drive lines, which no gear pair has: ``gensig.driveline.time``
IMPLICIT_BACKEND = "newmark"
BACKENDS: dict[str, Backend] = {EXPLICIT_BACKEND: Nystroem()}


def backend_names() -> tuple[str, ...]:
    """Names that ``solver.backend`` may have."""
    return (*BACKENDS, IMPLICIT_BACKEND)
