"""A drive line at work: each of its meshes is heated by its own friction, as a pair is.

``docs/theory/heat.md``.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from gensig.driveline.machine import LineMachine
from gensig.driveline.running import named_by_side, reference_force
from gensig.driveline.teeth import MeshHeat, is_tabulated
from gensig.errors import GensigError
from gensig.geometry.contact import GearPair
from gensig.mesh.thermal.heat import Heat
from gensig.systems.hot_pair import Duty, HotState, heated, hot_state


def hot_line(machine: LineMachine, heat: Heat) -> LineMachine:
    """The machine with the effects of heat on all meshes that are made of teeth.

    Each mesh has the temperatures of its own mean force and speed at the set-point; a gear in two
    meshes has those of either in either (assumed). Gears keep the size of their drawing: the
    common strain of a pair, some 0.05 %, is left out, the differences of its gears are not.

    Raises
    ------
    GensigError    as ``hot_pair.hot_state`` and ``hot_pair.heated``, with the mesh
    """
    engine, forces = machine.engine, machine.mesh_forces
    drive, pairs = engine.drive, list(engine.drive.pairs)
    effects: list[MeshHeat | None] = [None] * len(pairs)
    crank = machine.operating.speed / machine.ratio
    for number, mesh in enumerate(drive.line.meshes):
        if not is_tabulated(drive, machine.mesh_number, number):
            continue
        node = drive.numbers[drive.line.gears[mesh.driving].node]
        force = reference_force(engine, number, float(forces[number]))
        law = replace(machine.law, modification=machine.modified(number))
        duty = Duty(
            system=law.flanks(named_by_side(pairs[number]), force),
            heat=heat,
            speed=crank * abs(engine.ratios[node]),
        )
        try:
            pair, effects[number] = _mesh_at_work(duty)
        except GensigError as error:
            text = f"mesh {engine.mesh_names[number]}: {error}"
            raise type(error)(text) from None
        pairs[number] = replace(
            pairs[number],
            backlash=pair.backlash,
            center_distance_change=pair.center_distance_change,
        )
    hot = replace(engine, drive=replace(drive, pairs=tuple(pairs)))
    return replace(machine, engine=hot, heat=tuple(effects))


@lru_cache(maxsize=64)
def _state(duty: Duty) -> HotState:
    return hot_state(duty)


def _mesh_at_work(duty: Duty) -> tuple[GearPair, MeshHeat]:
    """The pair at its hot center distance, and the effects on its teeth."""
    state, heat = _state(duty), duty.heat
    system = heated(
        duty,
        state,
        growth=False,
        center_distance=heat.center_distance,
        softening=heat.softening,
    )
    growth = None
    if heat.growth:
        growth = state.growth
    return system.pair, MeshHeat(material=system.material, growth=growth)
