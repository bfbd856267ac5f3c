"""The drive line of a configuration as a machine that runs."""

from __future__ import annotations

from dataclasses import replace

from gensig.driveline.engine_line import EngineLine, read_engine_line
from gensig.driveline.hot_line import hot_line
from gensig.driveline.machine import LineMachine
from gensig.dynamics.integrator import Solver
from gensig.errors import ConfigError
from gensig.mesh.options import refuse_papers_heat
from gensig.operation.options import read_operating
from gensig.options.configuration import Configuration, Section
from gensig.sensing.chain import stands_for_channels
from gensig.sensing.manufacturing import Quality
from gensig.sensing.options import read_sensing
from gensig.systems.registry import PairParts


def read_line_machine(config: Configuration) -> LineMachine:
    """The machine of a configuration whose system is a drive line.

    Raises
    ------
    ConfigError    for keys or tables that make no engine, and for a mesh that has no records
    """
    if _moves_laterally(config.section("system"), config.section("sensing")):
        config = config.with_keys("system", lateral=True)
    engine = read_engine_line(config)
    mesh_number = _record_mesh(engine)
    parts = PairParts(config)
    operating = read_operating(config.section("operating"))
    quality = config.section("quality").read(Quality)
    machine = LineMachine(
        material=parts.material,
        mesh=refuse_papers_heat(parts.mesh, "a drive line"),
        operating=operating,
        sensing=read_sensing(config.section("sensing")),
        quality=quality,
        solver=config.section("solver").read(Solver),
        engine=engine,
        mesh_number=mesh_number,
        slices=parts.slices,
        modification=parts.modification,
    )
    machine = replace(
        machine,
        operating=replace(operating, speed=operating.speed * machine.ratio),
        sensing=machine.sensing.of_machine(machine.channels),
    )
    if parts.heat.is_any:
        return hot_line(machine, parts.heat)
    return machine


def _moves_laterally(system: Section, sensing: Section) -> bool:
    """True where ``system.lateral`` is null and channels or nuisances need lateral motion."""
    if system.get("lateral") is not None:
        return False
    names = [str(name) for name in sensing.get("channels") or ()]
    has_bearing = any(name.endswith(("_x", "_y")) for name in names)
    return has_bearing or stands_for_channels(names) or bool(sensing.get("nuisances"))


def _record_mesh(engine: EngineLine) -> int:
    drive, names = engine.drive, engine.mesh_names
    if not names:
        raise ConfigError(
            f"{drive.name} has no mesh, and records follow the teeth of one; give a line with a "
            "row of edge_kind gear_mesh, and its gears in system.gears_csv"
        )
    if drive.record_mesh is None:
        return 0
    wanted = "/".join(str(node) for node in drive.record_mesh)
    if wanted not in names:
        raise ConfigError(
            f"system.record_mesh = {list(drive.record_mesh)}: no such mesh; there are "
            f"{', '.join(names)}, the driving "
            "node first"
        )
    return names.index(wanted)
