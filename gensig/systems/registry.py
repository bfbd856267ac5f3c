"""Systems by the name that configurations use, each built from one resolved configuration."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from gensig.dynamics.integrator import Solver
from gensig.dynamics.pair import Body, Rotor, Support, solid_disc
from gensig.errors import ConfigError
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.material import Material
from gensig.mesh.options import read_mesh_options
from gensig.sensing.manufacturing import Quality
from gensig.sensing.reading import read_sensing
from gensig.systems.operation import read_operating
from gensig.systems.spur_pair import SpurPair
from gensig.systems.supports import AS_GIVEN, on_bearings, put_on_bearings, read_holding
from gensig.units import read, to_si

SIDES = ("pinion", "wheel")
COMMON_GEAR_KEYS = (
    "normal_module_mm",
    "pressure_angle_deg",
    "addendum_coefficient",
    "clearance_coefficient",
    "cutter_tip_radius_coefficient",
)
BODY_KEYS = ("mass_kg", "inertia_kg_m2", "support", "bearing", "shaft")
SYSTEM_KEYS = ("kind", "supports", "motor", "load")


def read_spur_pair(config: Mapping[str, Any]) -> SpurPair:
    """Build a spur pair from the boundary keys of a configuration."""
    gear = section(config, "gear")
    if _number("gear.helix_angle_deg", gear["helix_angle_deg"]) != 0.0:
        raise ConfigError(f"gear.helix_angle_deg = {gear['helix_angle_deg']:g}: system=spur_pair takes spur gears, 0")
    material = read(Material, section(config, "material"), "material")
    if material.poisson_ratio >= 0.5:
        raise ConfigError(f"material.poisson_ratio = {material.poisson_ratio:g} must be below 0.5")
    sides = {name: section(config, "gear", name) for name in SIDES}
    machine = section(config, "system")
    for key in machine:
        if key not in SYSTEM_KEYS:
            raise ConfigError(f"system: unknown key '{key}'; known: {', '.join(SYSTEM_KEYS)}")
    gears = {name: _read_gear(name, gear) for name in SIDES}
    operating, quality = (
        read_operating(section(config, "operating")),
        read(Quality, section(config, "quality"), "quality"),
    )
    bodies = {name: _read_body(gears[name], sides[name], material) for name in SIDES}
    held = {name: read_holding(gears[name], sides[name]) for name in SIDES}
    if on_bearings(machine.get("supports", AS_GIVEN), quality):
        force = operating.torque / gears["pinion"].base_radius
        bodies = {name: put_on_bearings(bodies[name], gears[name], held[name], material, force) for name in SIDES}
    return SpurPair(
        pair=GearPair(**gears, backlash=_number("gear.backlash_um", gear["backlash_um"])),
        material=material,
        mesh=read_mesh_options(section(config, "mesh")),
        pinion=bodies["pinion"],
        wheel=bodies["wheel"],
        operating=operating,
        sensing=read_sensing(section(config, "sensing")),
        quality=quality,
        solver=read(Solver, section(config, "solver"), "solver"),
        motor=_read_rotor("system.motor", machine.get("motor")),
        load=_read_rotor("system.load", machine.get("load")),
    )


SYSTEMS: dict[str, Callable[[Mapping[str, Any]], SpurPair]] = {"spur_pair": read_spur_pair}


def read_system(config: Mapping[str, Any]) -> SpurPair:
    """Build the system that ``system.kind`` names.

    Raises
    ------
    ConfigError, GeometryError    for keys or values that make no machine
    """
    kind = section(config, "system").get("kind")
    if kind not in SYSTEMS:
        raise ConfigError(f"system.kind = {kind!r}; allowed: {', '.join(SYSTEMS)}")
    return SYSTEMS[kind](config)


def section(config: Mapping[str, Any], *path: str) -> Mapping[str, Any]:
    """A group of keys of the configuration; ConfigError where there is none."""
    node: Any = config
    for name in path:
        node = node.get(name)
        if not isinstance(node, Mapping):
            place = ".".join(path)
            raise ConfigError(f"{place} = {node!r} must be a group of keys; choose an option or leave it alone")
    return node


def _read_gear(name: str, gear: Mapping[str, Any]) -> Gear:
    own = {key: value for key, value in section(gear, name).items() if key not in BODY_KEYS}
    return read(Gear, {**{key: gear[key] for key in COMMON_GEAR_KEYS}, **own}, f"gear.{name}", name=name)


def _read_body(gear: Gear, values: Mapping[str, Any], material: Material) -> Body:
    """Mass and inertia as given, or those of a solid disc on the pitch circle less the bore where null."""
    derived = solid_disc(gear.pitch_radius, gear.bore_radius, gear.face_width, material.density_kg_per_m3)
    given = [values["mass_kg"], values["inertia_kg_m2"]]
    mass, inertia = (
        fallback if value is None else _number(f"gear.{gear.name}.{key}", value)
        for value, fallback, key in zip(given, derived, ("mass_kg", "inertia_kg_m2"), strict=True)
    )
    for key, value in (("mass_kg", mass), ("inertia_kg_m2", inertia)):
        if not value > 0.0:
            raise ConfigError(f"gear.{gear.name}.{key} = {value:g} must be positive, or null to derive it")
    try:
        support = read(Support, section(values, "support"), "support")
    except ConfigError as error:
        raise ConfigError(f"gear.{gear.name}.{error}") from None
    return Body(mass=mass, inertia=inertia, support=support)


def _read_rotor(place: str, values: Any) -> Rotor | None:
    """A motor or a load; None where it is null, or its inertia."""
    if values is None or (isinstance(values, Mapping) and values.get("inertia_kg_m2", 0.0) is None):
        return None
    try:
        return read(Rotor, values, "rotor")
    except ConfigError as error:
        raise ConfigError(f"{place}{str(error).removeprefix('rotor')}") from None


def _number(key: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ConfigError(f"{key} = {value!r} is not a number")
    return to_si(key, float(value))
