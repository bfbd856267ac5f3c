"""Every fault by name: doing nothing, and in rising severity. The laws of faults run over all of
them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
import yaml

from gensig.faults.base import Fault, faulty_teeth
from gensig.faults.registry import FAULTS, read_faults
from gensig.mesh.pair_table import pair_table
from gensig.mesh.tooth_table import ToothTable
from gensig.systems.pair_machine import GearPairMachine

GEARS = ("pinion", "wheel")
FULL = 20.0  # mm, face width of the xiamen pair


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One way in which a fault grows: its option with one key at ``nothing``, then at values that
    rise.

    ``grows`` is False where more of it need not mean a larger deflection: proud flanks touch
    earlier.
    ``slack`` is how far the deflection may fall from one step to the next, as a share of it.
    """

    kind: str
    key: str
    nothing: Any
    rising: tuple[Any, ...]
    fixed: Mapping[str, Any]
    grows: bool = True
    slack: float = 1e-9

    def fault(self, value: Any, gear: str, tooth: Any = 0) -> Fault:
        """The fault with its key at a value."""
        return one(self.kind, gear=gear, tooth=tooth, **{**self.fixed, self.key: value})


def case(
    kind: str,
    key: str,
    *rising: Any,
    nothing: Any = 0.0,
    grows: bool = True,
    slack: float = 1e-9,
    **fixed: Any,
):
    return Case(
        kind=kind,
        key=key,
        nothing=nothing,
        rising=rising,
        fixed=fixed,
        grows=grows,
        slack=slack,
    )


CASES = {
    "crack_depth": case("crack", "crack_depth_mm", 0.3, 1.0, 2.0, 2.5),
    "crack_gamma": case(
        "crack", "crack_depth_mm", 0.3, 1.0, 2.0, 2.5, crack_start="gamma_mid"
    ),
    "crack_width": case(
        "crack", "crack_width_mm", 2.0, 7.0, 15.0, FULL, crack_depth_mm=2.0
    ),
    "crack_front": case(
        "crack",
        "crack_width_mm",
        5.0,
        15.0,
        FULL,
        crack_depth_mm=2.0,
        crack_front="parabolic",
    ),
    "crack_compression": case(
        "crack", "crack_depth_mm", 0.3, 1.0, 2.0, 2.5, crack_side="compression"
    ),
    "pit_width": case("pitting", "pit_width_mm", 1, 4, 12, 19, FULL),
    "pit_length": case("pitting", "pit_length_mm", 0.2, 0.5, 1.0, 1.5),
    "pit_depth": case("pitting", "pit_depth_mm", 0.01, 0.1, 0.5),
    "spall_width": case("spalling", "spall_width_mm", 1, 8, 16, FULL),
    "spall_length": case("spalling", "spall_length_mm", 0.3, 1.0, 2.0),
    "pitted_share": case("distributed_pitting", "pitted_share", 0.02, 0.1, 0.3),
    # proud edges touch earlier
    "damage": case("surface_damage", "damage", 0.2, 0.5, 1.0, grows=False),
    # the contact of a broken tooth moves down to its corner, where the tooth is stiffer: first
    # order in the load,
    # while the corner's gap is second order in the distance
    "broken": case("broken", "broken_height_mm", 0.1, 1.0, 2.0, 3.0, 4.5, slack=2e-3),
    "chip_height": case("chipped", "chip_height_mm", 0.5, 1.5, 3.0),
    "chip_width": case("chipped", "chip_width_mm", 1, 8, FULL),
    "chip_rectangular": case(
        "chipped", "chip_width_mm", 1, 8, 19, chip_shape="rectangular"
    ),
    "wear": case("wear", "wear_depth_um", 1, 20, 100),
    "wear_uniform": case("wear", "wear_depth_um", 1, 20, 100, wear_profile=None),
    "misalignment": case("misalignment", "misalignment_um", 1, 15, 60),
    "misalignment_other_end": case("misalignment", "misalignment_um", -1, -15, -60),
    "tip_relief": case("tip_relief", "relief_um", 1, 15, 50),
    "tip_relief_parabolic": case(
        "tip_relief",
        "relief_um",
        1,
        15,
        50,
        relief_length_mm=8.0,
        relief_curve="parabolic",
    ),
    "profile_form": case(
        "profile_error", "profile_form_um", 5, 20, 50, profile_slope_um=0.0
    ),
    "profile_slope": case(
        "profile_error", "profile_slope_um", 5, 20, 50, profile_form_um=0.0, grows=False
    ),
    "pitch_error": case("pitch_error", "pitch_error_um", 1, 20, 50),
    "pitch_error_proud": case(
        "pitch_error", "pitch_error_um", -1, -20, -50, grows=False
    ),
    "runout": case("runout", "eccentricity_um", 5, 40, 80),
}
# every kind, each at the size that its option has
KINDS = tuple(FAULTS)


@cache
def option(kind: str) -> Mapping[str, Any]:
    """The fault option of that name as its file has it, without what it varies."""
    values = yaml.safe_load(
        (files("gensig.configs") / "fault" / f"{kind}.yaml").read_text(encoding="utf-8")
    )
    return {key: value for key, value in values.items() if key != "vary"}


def one(kind: str, **changes: Any) -> Fault:
    """One fault: its option with keys replaced, as a configuration would."""
    (result,) = read_faults({**option(kind), **changes})
    return result


def heavy_table(system: GearPairMachine, *faults: Fault) -> ToothTable:
    """The table for pairs that carry the whole load alone, wherever they are."""
    teeth = faulty_teeth(system.pair, faults)
    return pair_table(
        system.pair, system.material, system.mesh, teeth, load=system.mesh_force
    )


@dataclass(frozen=True, kw_only=True)
class Side:
    """One gear's addend of a spur table, (kind, node) each, and the kinds of its teeth."""

    compliance: np.ndarray
    compliance_slope: np.ndarray
    gap: np.ndarray
    gap_slope: np.ndarray
    kind: np.ndarray
    present: np.ndarray


def side_of(table: ToothTable, gear: str) -> Side:
    number = ("pinion", "wheel").index(gear)
    teeth, part = (table.pinion, table.wheel)[number], table.parts[number]
    columns = part._asdict().items()
    return Side(
        **{name: np.squeeze(values, axis=(1 - number, 2)) for name, values in columns},
        kind=teeth.kind,
        present=teeth.present,
    )


def deflection(system: GearPairMachine, *faults: Fault, tooth: int = 0) -> np.ndarray:
    """Approach under which a pair carries the whole load alone: gap plus compliance times load, on
    the path, (node,) m.

    The pair is that of tooth ``tooth`` of the first fault's gear (the pinion without faults) and a
    sound mate.
    """
    gear = faults[0].gear if faults else "pinion"
    table = heavy_table(system, *faults)
    side, mate = (
        side_of(table, name)
        for name in (gear, "wheel" if gear == "pinion" else "pinion")
    )
    row = side.kind[tooth]
    if not side.present[row]:
        return np.full(np.count_nonzero(on_path(table)), np.inf)
    gap, compliance = (
        side.gap[row] + mate.gap[0],
        side.compliance[row] + mate.compliance[0],
    )
    return (gap + compliance * system.mesh_force)[on_path(table)]


def on_path(table: ToothTable) -> np.ndarray:
    return (table.position >= 0.0) & (table.position <= table.pair.path_of_contact)
