"""Static approach while one tooth passes the mesh, and how far back a tooth may stand."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from gensig.arrays import Array
from gensig.dynamics.helical import pitches
from gensig.faults.base import Fault
from gensig.faults.broken import MissingTooth
from gensig.mesh.load_distribution import pair_states, static_mesh
from gensig.systems.base import Machine

PER_PITCH = 512  # rolls in a base pitch


def tooth_reach(machine: Machine, gear: str) -> float:
    """Largest distance that a tooth may stand behind its place and still touch its mate, m.

    Behind it the neighbouring pairs carry the whole load, as if it were missing. They yield, and
    the gears come nearer by their deflection; where the teeth before and after leave the path of
    contact, by the gap at their tips too. The reach is the most by which the flank without the
    error would then be inside its mate, over the passage of the tooth:

        reach = max over roll of (approach - shared compliance x force - gap of the healthy pair)

    with the approach of the mesh without that tooth. It grows with the torque. Static, at the
    set-point, with teeth that have no other errors. A tooth farther back is never loaded: the
    machine moves as without it.

    Raises
    ------
    KeyError    for a gear that the machine does not have
    """
    at, side = machine.at_gear(gear)
    missing = MissingTooth(gear=side, tooth=0)
    sound, without = at.mesh_table(), at.mesh_table((missing,))
    roll = _passage(at)
    place, present = pair_states(without, roll), pair_states(sound, roll)
    approach = static_mesh(without, place, at.mesh_force).approach
    local = approach - sound.shared_compliance * at.mesh_force
    open_, closed = place.gap[:, :, 0], present.gap[:, :, 0]
    is_gone = np.isinf(open_) & np.isfinite(closed)
    inside = np.where(is_gone, local[:, None] - closed, -np.inf)
    return max(float(inside.max()), 0.0)


def passage_approach(
    machine: Machine, faults: Sequence[Fault], gears: Collection[str] = ()
) -> list[Array]:
    """Static approach of the mesh of every gear with faults while its faulty tooth passes.

    (roll,) m each, in the order of the gears' names; those of ``gears`` too, with faults or
    without. The lowest faulty tooth of a gear is put at tooth 0, so that equal faults of
    different teeth give equal values.

    Raises
    ------
    FaultError, ExtrapolationError    for faults that do not fit their teeth
    """
    approaches = []
    for gear in sorted({*gears, *(fault.gear for fault in faults)}):
        at, side = machine.at_gear(gear)
        own = [fault for fault in faults if fault.gear == gear]
        first = min((max(fault.first_tooth, 0) for fault in own), default=0)
        moved = tuple(
            replace(fault, gear=side, tooth=_from(fault.tooth, first)) for fault in own
        )
        table = at.mesh_table(moved)
        states = pair_states(table, _passage(at))
        approaches.append(static_mesh(table, states, at.mesh_force).approach)
    return approaches


def _passage(machine: Machine) -> Array:
    """Rolls over which tooth 0 of either gear can touch, (roll,) m."""
    first, last = pitches(machine.mesh_table())
    n_rolls = (last - first + 2) * PER_PITCH
    roll = first - 1 + (np.arange(n_rolls) + 0.5) / PER_PITCH
    return machine.pair.base_pitch * roll


def _from(
    tooth: int | str | tuple[int, ...], first: int
) -> int | str | tuple[int, ...]:
    """The teeth counted from ``first`` on."""
    if isinstance(tooth, str):
        return tooth
    if isinstance(tooth, int):
        return tooth - first
    return tuple(number - first for number in tooth)
