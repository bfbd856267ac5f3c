"""The backends of gear pairs by the name that ``solver.backend`` takes."""

from gensig.dynamics.backends.base import Backend
from gensig.dynamics.backends.nystroem.method import Nystroem
from gensig.dynamics.backends.runge_kutta import RungeKutta

# of configurations without the key, as version 0.9.0 wrote them
UNNAMED_BACKEND = "runge_kutta"
# the implicit method of drive lines, which no gear pair has: ``gensig.driveline.time``
IMPLICIT_BACKEND = "newmark"
BACKENDS: dict[str, Backend] = {
    "runge_kutta": RungeKutta(),
    "nystroem": Nystroem(),
}


def backend_names() -> tuple[str, ...]:
    """Names that ``solver.backend`` may have."""
    return (*BACKENDS, IMPLICIT_BACKEND)
