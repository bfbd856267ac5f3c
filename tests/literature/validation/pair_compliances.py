"""Compliance of single pairs of spur teeth."""

import numpy as np

from gensig.mesh.tooth_table import ToothTable


def pair_compliance(
    table: ToothTable, position: np.ndarray, pinion_kind: int = 0, wheel_kind: int = 0
) -> np.ndarray:
    """Compliance of a single tooth pair under the table's load, (phase,) m/N."""
    compliance = table.pairs.compliance[pinion_kind, wheel_kind, 0]
    return np.interp(position, table.position, compliance)
