"""ISO 6336-1, Method B, and our own stiffness per face width beside it, by the names that the
rows use.
"""

from __future__ import annotations

from collections.abc import Callable

from gensig.mesh import iso6336
from validation.case import Case
from validation.checks.geometry_checks import Check
from validation.checks.mesh_checks import (
    largest_pair_stiffness,
    mean_mesh_stiffness,
)


def _line_load(case: Case, at: str = "") -> float:
    """Tangential force at the reference circle per face width, N/m."""
    pinion = case.pair.pinion
    return case.system.operating.torque / pinion.pitch_radius / pinion.face_width


def _per_width(stiffness: Callable[..., float]) -> Check:
    """``at`` is ``stiff``, at 100 N/mm or more; ``own_load``, at that of the torque; or
    ``theoretical``, C_M = 1.
    """

    def check(case: Case, at: str) -> float:
        if at == "own_load":
            return stiffness(case.pair, line_load=_line_load(case))
        if at == "theoretical":
            return stiffness(case.pair, correction_factor=1.0)
        return stiffness(case.pair)

    return check


def _over_face(check: Check) -> Check:
    return lambda case, at: check(case, at) * case.pair.pinion.face_width


def _low_load_factor(case: Case, at: str) -> float:
    return _iso_single(case, "own_load") / _iso_single(case, "stiff")


_iso_single, _iso_mesh = (
    _per_width(iso6336.single_stiffness),
    _per_width(iso6336.mesh_stiffness),
)

STANDARD: dict[str, Check] = {
    "iso_flexibility": lambda case, at: iso6336.flexibility(case.pair),
    "iso_theoretical_single": lambda case, at: 1.0 / iso6336.flexibility(case.pair),
    "iso_basic_rack_factor": lambda case, at: iso6336.basic_rack_factor(
        case.pair.pinion
    ),
    "iso_single": _iso_single,
    "iso_single_over_face": _over_face(_iso_single),
    "iso_mesh": _iso_mesh,
    "iso_mesh_over_face": _over_face(_iso_mesh),
    "iso_low_load_factor": _low_load_factor,
    "line_load": _line_load,
    "single_per_width": lambda case, at: (
        largest_pair_stiffness(case) / case.pair.pinion.face_width
    ),
    "mesh_per_width": lambda case, at: (
        mean_mesh_stiffness(case, "cycle") / case.pair.pinion.face_width
    ),
}
