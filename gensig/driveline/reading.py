"""The drive line of a configuration as a machine that runs."""

from __future__ import annotations

from dataclasses import replace

from gensig.driveline.engine_line import EngineLine, read_engine_line
from gensig.driveline.hot_line import hot_line
from gensig.driveline.machine import LineMachine
from gensig.dynamics.integrator import Solver
from gensig.errors import ConfigError
from gensig.mesh.options import (
    read_mesh_options,
    read_slice_options,
    refuse_papers_heat,
)
from gensig.operation.options import read_operating
from gensig.options.configuration import Configuration
from gensig.sensing.chain import stands_for_channels
from gensig.sensing.manufacturing import Quality
from gensig.sensing.options import read_sensing
from gensig.systems.registry import read_heat, read_material, read_modification
from gensig.units import read


def read_line_machine(config: Configuration) -> LineMachine:
    """The machine of a configuration whose system is a drive line.

    Raises
    ------
    ConfigError    for keys or tables that make no engine, and for a mesh that has no records
    """
    engine = read_engine_line(_with_lateral_motion(config))
    mesh_number = _record_mesh(engine)
    operating, quality = (
        read_operating(config.section("operating")),
        read(Quality, config.section("quality"), "quality"),
    )
    machine = LineMachine(
        material=read_material(config),
        mesh=refuse_papers_heat(
            read_mesh_options(config.section("mesh")), "a drive line"
        ),
        operating=operating,
        sensing=read_sensing(config.section("sensing")),
        quality=quality,
        solver=read(Solver, config.section("solver"), "solver"),
        engine=engine,
        mesh_number=mesh_number,
        slices=read_slice_options(config.section("mesh")),
        modification=read_modification(config),
    )
    machine = replace(
        machine,
        operating=replace(operating, speed=operating.speed * machine.ratio),
        sensing=machine.sensing.of_machine(machine.channels),
    )
    heat = read_heat(config)
    if heat.is_any:
        return hot_line(machine, heat)
    return machine


def _with_lateral_motion(config: Configuration) -> Configuration:
    """A configuration whose ``system.lateral`` null is true where channels or nuisances need it."""
    if config.section("system").get("lateral") is not None:
        return config
    sensing = config.section("sensing")
    names = [str(name) for name in sensing.get("channels") or ()]
    has_bearing = any(name.endswith(("_x", "_y")) for name in names)
    every = stands_for_channels(names)
    needed = has_bearing or every or bool(sensing.get("nuisances"))
    return config.with_keys("system", lateral=needed)


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
