"""Compliance of single pairs of spur teeth."""

import numpy as np

from gensig.mesh.pair_table import PairTable


def pair_compliance(
    table: PairTable, position: np.ndarray, pinion_kind: int = 0, wheel_kind: int = 0
) -> np.ndarray:
    """Compliance of a single tooth pair under the table's load, (phase,) m/N."""
    pinion = table.pinion.compliance[pinion_kind]
    wheel = table.wheel.compliance[wheel_kind]
    nodes = table.position
    return np.interp(position, nodes, pinion) + np.interp(position, nodes, wheel)
