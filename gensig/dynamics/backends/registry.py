"""The backends by the name that ``solver.backend`` takes."""

from gensig.dynamics.backends.base import Backend
from gensig.dynamics.backends.nystroem.method import Nystroem
from gensig.dynamics.backends.runge_kutta import RungeKutta

DEFAULT_BACKEND = "runge_kutta"
BACKENDS: dict[str, Backend] = {
    "runge_kutta": RungeKutta(),
    "nystroem": Nystroem(),
}
