"""Records of drive lines from the two-evaluation core, several side by side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.running import RunningLine
from gensig.driveline.side_by_side import (
    LineDynamics,
    check_line,
    integrate_lines,
    line_dynamics,
)
from gensig.dynamics._layout import N_SEEN
from gensig.dynamics.backends.base import Integration
from gensig.dynamics.mesh_state import mesh_state
from gensig.errors import SimulationError
from gensig.faults.base import faulty_teeth
from gensig.systems.integration_checks import (
    checks,
    finer,
    is_too_coarse,
    not_finite,
)
from gensig.systems.run import CleanRecord, Run
