"""Integration of lines of the same bodies and meshes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.side_by_side.line_dynamics import LineDynamics
from gensig.driveline.side_by_side.line_lanes import pack_lines
from gensig.dynamics.backends.base import Integration, Motions
from gensig.dynamics.backends.group_motions import integrate_machines
from gensig.dynamics.backends.group_run import Core
from gensig.dynamics.backends.nystroem import _line_chord_meshes, _line_spur_meshes
from gensig.dynamics.backends.nystroem._line_layout import line_scratch
from gensig.dynamics.backends.nystroem.stability import stable_rate
from gensig.dynamics.backends.step_limits import COARSE_STABILITY

Array = NDArray[np.float64]


def line_core(line: LineDynamics) -> Core[LineDynamics]:
    """The core for lines of the bodies and meshes of one."""
    meshes = _line_chord_meshes if line.has_chords else _line_spur_meshes
    n_meshes = len(line.teeth)
    return Core(
        pack=pack_lines,
        scratch=partial(_scratch, n_meshes),
        integrate=meshes.integrate,
        coarsest_oversampling=_coarsest_oversampling,
        settling_time=lambda line: line.settling_time,
        n_meshes=n_meshes,
        n_angles=len(line.angles),
    )


def integrate_lines(
    machines: Sequence[LineDynamics], integration: Integration
) -> Motions:
    """Motions of lines of the same bodies and meshes; rows as ``Motions`` says."""
    first = machines[0]
    core = line_core(first)
    motions = integrate_machines(machines, integration, core)
    angles = [
        angle + line.rest[list(line.angles), None]
        for angle, line in zip(motions.angle, machines, strict=True)
    ]
    return replace(motions, angle=angles)


def _scratch(
    n_meshes: int, n_dof: int, n_channels: int, precision: str
) -> tuple[NDArray[Any], Array, NDArray[np.int64]]:
    return line_scratch(n_meshes, n_dof, precision)


def _coarsest_oversampling(
    line: LineDynamics, oversampling: int, sampling_rate: float
) -> int:
    least = stable_rate(line.stiff_rates) / (COARSE_STABILITY * sampling_rate)
    return min(oversampling, math.ceil(least))
