"""Root stress of a mesh under the tooth force that a simulation in time found, teeth free to
part.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from gensig.arrays import Array
from gensig.driveline.engine_dampers import (
    DynamicRootStress,
    crank_of_passes,
    passes_of_a_cycle,
)
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.excitation.cycle import CYCLE
from gensig.driveline.excitation.cycle_statistics import typical_extremes, whole_cycles
from gensig.driveline.in_time import TimeResponse
from gensig.errors import ConfigError
from gensig.systems.root_strength import RootStrength


def root_stress_in_time(
    strength: RootStrength, line: EngineLine, mesh: int, response: TimeResponse
) -> DynamicRootStress:
    """Root stress of every pair that meets in the whole cycles of a run.

    ISO's stress and the load shares are those under the typical greatest force, the median over
    the cycles of the greatest in a cycle; single impacts are harder. A force on the back flanks
    bends the teeth the other way and is left out.

    Returns
    -------
    DynamicRootStress    with ``passes`` (pass, point) in the order in which the pairs meet

    Raises
    ------
    ConfigError    for a run shorter than two cycles, or a force that never closes the mesh
    """
    crank_angle, force = response.crank_angle, response.mesh_force[mesh]
    greatest = float(typical_extremes(force[None], crank_angle)[1][0])
    if not greatest > 0.0:
        raise ConfigError(
            f"mesh {line.mesh_names[mesh]}: nothing closes its driving flanks in time"
        )
    torque = greatest * strength.pair.pinion.base_radius
    loaded = replace(strength, flanks=replace(strength.flanks, torque=torque))
    history, in_cycle = loaded.history(), passes_of_a_cycle(line, mesh)
    n_cycles = len(whole_cycles(crank_angle))
    first = in_cycle * math.ceil(crank_angle[0] / CYCLE - 1e-9)
    crank = crank_of_passes(
        strength, line, mesh, history.roll, range(first, first + in_cycle * n_cycles)
    )
    inside = (crank[:, 0] >= crank_angle[0]) & (crank[:, -1] <= crank_angle[-1])
    if np.count_nonzero(inside) < in_cycle:
        raise ConfigError(
            "root stress in time needs two cycles of the crank at least; simulate longer"
        )
    share = np.maximum(np.interp(crank[inside], crank_angle, force), 0.0) / greatest
    return DynamicRootStress.of(loaded, history, share)


def typical_largest(passes: Array, in_cycle: int) -> float:
    """Median over the cycles of the largest root stress in a cycle, Pa, of passes (pass, point)."""
    whole = len(passes) // in_cycle
    return float(
        np.median(
            passes.max(axis=1)[: whole * in_cycle].reshape(whole, in_cycle).max(axis=1)
        )
    )
