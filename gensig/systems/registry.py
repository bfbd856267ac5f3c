"""Systems by their names in configurations, each built from one resolved configuration."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from gensig.dynamics.integrator import Solver
from gensig.dynamics.pair import Body, Rotor, Support, solid_disc
from gensig.errors import ConfigError
from gensig.geometry.contact import SIDES, GearPair
from gensig.geometry.gear import Gear
from gensig.material import Material
from gensig.mesh.modification import FlankModification, PairModification, sound_teeth
from gensig.mesh.options import (
    read_mesh_options,
    read_slice_options,
    refuse_papers_heat,
)
from gensig.mesh.thermal.heat import Heat
from gensig.operation.options import read_operating
from gensig.options.configuration import Configuration, Section
from gensig.sensing.manufacturing import Quality
from gensig.sensing.options import read_sensing
from gensig.systems.derived_sizes import completed, least_backlash
from gensig.systems.helical_pair import HelicalPair
from gensig.systems.hot_pair import Duty, as_configured
from gensig.systems.pair_machine import GearPairMachine
from gensig.systems.sliced_pair import SlicedPair
from gensig.systems.spur_pair import SpurPair
from gensig.systems.supports import (
    AS_GIVEN,
    DAMPING_RATIO,
    RADIAL,
    held_axially,
    on_bearings,
    put_on_bearings,
    read_holding,
)
from gensig.units import from_si, read, split_unit, to_si

COMMON_GEAR_KEYS = (
    "normal_module_mm",
    "pressure_angle_deg",
    "addendum_coefficient",
    "clearance_coefficient",
    "cutter_tip_radius_coefficient",
)
BODY_KEYS = ("mass_kg", "inertia_kg_m2", "support", "bearing", "shaft")
SLICED = "helical_pair"
LINE = "shaft_line"
SYSTEM_KEYS = ("kind", "supports", "motor", "load")


def read_spur_pair(config: Configuration) -> SpurPair:
    """Build a spur pair from the boundary keys of a configuration."""
    modification = read_modification(config)
    refuse_papers_heat(read_mesh_options(config.section("mesh")), "system=spur_pair")
    gear = config.section("gear")
    if _number("gear.helix_angle_deg", gear["helix_angle_deg"]) != 0.0:
        raise ConfigError(
            f"gear.helix_angle_deg = {gear['helix_angle_deg']:g}: system=spur_pair takes spur "
            "gears, 0; helical ones have system=helical_pair"
        )
    is_hot = read_heat(config).is_any
    flanks = read_sliced_pair(config) if is_hot else None
    pair = flanks.pair if flanks else read_pair(config)
    machine = _read_machine(config, pair)
    is_linear = machine["mesh"].law == "paper"
    if modification.is_any and is_linear:
        raise ConfigError(
            "modification opens gaps, which mesh.law=paper does not know: take "
            "mesh.law=one_sided"
        )
    if flanks is not None:
        if flanks.growth is not None and is_linear:
            raise ConfigError(
                "heat.growth opens gaps, which mesh.law=paper does not know: take "
                "mesh.law=one_sided, or heat.growth=false"
            )
        modification = replace(modification, growth=flanks.growth)
        machine["material"] = flanks.material
    sound_teeth(pair, modification)  # raises for reliefs that overlap
    slices = read_slice_options(config.section("mesh"))
    return SpurPair(pair=pair, slices=slices, modification=modification, **machine)


def read_helical_pair(config: Configuration) -> HelicalPair:
    """Build a helical pair, or a spur pair in slices, from the boundary keys of a configuration."""
    flanks = read_sliced_pair(config)
    machine = _read_machine(config, flanks.pair)
    bodies = {
        name: held_axially(machine[name], gear, read_gear_group(config).section(name))
        for name, gear in flanks.pair.gears.items()
    }
    return HelicalPair(pair=flanks.pair, flanks=flanks, **{**machine, **bodies})


def _read_machine(config: Configuration, pair: GearPair) -> dict[str, Any]:
    """Common fields of the machines of spur and helical pairs, by the names of the fields."""
    material = read_material(config)
    machine = config.section("system")
    for key in machine:
        if key not in SYSTEM_KEYS:
            known = ", ".join(SYSTEM_KEYS)
            raise ConfigError(f"system: unknown key '{key}'; known: {known}")
    operating = read_operating(config.section("operating"))
    quality = read(Quality, config.section("quality"), "quality")
    bodies = _read_bodies(config, pair, material, operating.torque, quality)
    return {
        "material": material,
        "mesh": read_mesh_options(config.section("mesh")),
        **bodies,
        "operating": operating,
        "sensing": read_sensing(config.section("sensing")),
        "quality": quality,
        "solver": read(Solver, config.section("solver"), "solver"),
        "motor": _read_rotor("system.motor", machine.get("motor")),
        "load": _read_rotor("system.load", machine.get("load")),
    }


def read_sliced_pair(config: Configuration) -> SlicedPair:
    """Build a spur or helical pair cut into slices, of any system of pairs.

    The pair has the effects of heat of the configuration.
    """
    _refuse_line(config)
    if read_heat(config).is_any:
        return as_configured(read_duty(config))
    return read_cold_pair(config)


def read_duty(config: Configuration) -> Duty:
    """The cold pair of a configuration with its heating and cooling."""
    speed = _number("operating.speed_rpm", config.section("operating")["speed_rpm"])
    return Duty(system=read_cold_pair(config), heat=read_heat(config), speed=speed)


def read_cold_pair(config: Configuration) -> SlicedPair:
    """The sliced pair of a configuration without heat.

    Raises
    ------
    ConfigError    for ``mesh.heat_law=paper`` where no teeth grow
    """
    mesh = config.section("mesh")
    options = read_mesh_options(mesh)
    if options.has_papers_heat and not read_heat(config).growth:
        raise ConfigError(
            f"mesh.heat_law = {options.heat_law} is for teeth that grow with heat: take "
            "heat=chongqing_rated or heat.growth=true, or mesh.heat_law=grown"
        )
    return SlicedPair(
        pair=read_pair(config),
        material=read_material(config),
        mesh=options,
        slices=read_slice_options(mesh),
        modification=read_modification(config),
        torque=_number("operating.torque_nm", config.section("operating")["torque_nm"]),
    )


def read_gear_group(config: Configuration) -> Section:
    """The group ``gear`` of a configuration, sizes that are null filled."""
    return completed(config.section("gear"))


def read_pair(config: Configuration) -> GearPair:
    """The two gears of a configuration; by default the wheel has the opposite hand.

    A backlash that is null is the recommended one.
    """
    gear = read_gear_group(config)
    helix = _number("gear.helix_angle_deg", gear["helix_angle_deg"])
    pinion, wheel = (
        _read_gear(name, gear, hand * helix)
        for name, hand in zip(SIDES, (1.0, -1.0), strict=True)
    )
    if gear["backlash_um"] is not None:
        backlash = _number("gear.backlash_um", gear["backlash_um"])
        return GearPair(pinion=pinion, wheel=wheel, backlash=backlash)
    pair = GearPair(pinion=pinion, wheel=wheel, backlash=0.0)
    distance = from_si("center_distance_mm", pair.center_distance)
    recommended = least_backlash(distance, gear["normal_module_mm"])
    return replace(pair, backlash=to_si("backlash_um", recommended))


def read_material(config: Configuration) -> Material:
    """The material of a configuration."""
    material = read(Material, config.section("material"), "material")
    ratio = material.poisson_ratio
    if ratio >= 0.5:
        raise ConfigError(f"material.poisson_ratio = {ratio:g} must be below 0.5")
    return material


def read_heat(config: Configuration) -> Heat:
    """Effects of heat of a configuration, and their parameters."""
    return read(Heat, config.section("heat"), "heat")


def read_modification(config: Configuration) -> PairModification:
    """Flank modifications of a configuration's gears."""
    sides = {}
    for name in SIDES:
        try:
            side = config.section("modification", name)
            sides[name] = read(FlankModification, side, f"modification.{name}")
        except ConfigError as error:
            text = str(error)
            if not text.startswith("modification"):
                text = f"modification.{name}.{text}"
            raise ConfigError(text) from None
    common = config.section("modification").without(*SIDES)
    return read(PairModification, common, "modification", **sides, growth=None)


SYSTEMS: dict[str, Callable[[Configuration], GearPairMachine]] = {
    "spur_pair": read_spur_pair,
    SLICED: read_helical_pair,
}


def read_system(config: Configuration) -> GearPairMachine:
    """Build the system that ``system.kind`` names.

    Raises
    ------
    ConfigError, GeometryError    for invalid keys or values
    """
    kind = config.section("system").get("kind")
    _refuse_line(config)
    if config.get("excitation") is not None:
        raise ConfigError(
            "excitation turns a drive line (system=engine_gear_train, gensig forced-response); "
            f"system={kind} turns as operating says, leave excitation out"
        )
    if kind not in SYSTEMS:
        allowed = ", ".join((*SYSTEMS, LINE))
        raise ConfigError(f"system.kind = {kind!r}; allowed: {allowed}")
    machine = SYSTEMS[kind](config)
    return replace(machine, sensing=machine.sensing.of_machine(machine.channels))


def _refuse_line(config: Configuration) -> None:
    """Raise ConfigError for a drive line."""
    machine = config.section("system")
    if machine.get("kind") == LINE:
        raise ConfigError(
            f"system={machine.get('name')} is a drive line from tables, for gensig modes, "
            "forced-response, stiffness, simulate, generate; this is done with "
            f"system={', '.join(SYSTEMS)}"
        )


def _read_gear(name: str, gear: Section, helix_angle: float) -> Gear:
    side = gear.section(name).without(*BODY_KEYS)
    values = {**{key: gear[key] for key in COMMON_GEAR_KEYS}, **side}
    if "helix_angle_deg" in side:
        return read(Gear, values, f"gear.{name}", name=name)
    return read(Gear, values, f"gear.{name}", name=name, helix_angle=helix_angle)


def _read_bodies(
    config: Configuration,
    pair: GearPair,
    material: Material,
    torque: float,
    quality: Quality,
) -> dict[str, Body]:
    """Both gears on their supports, by name.

    With ``system.supports=bearings`` bearings carry ``torque`` in N m of the pinion. Without it
    what is null of a support follows from bearings at the rated torque.
    """
    is_on_bearings = on_bearings(config.section("system").get("supports", AS_GIVEN))
    sizes, bodies, ratio = read_gear_group(config), {}, DAMPING_RATIO
    if is_on_bearings and quality.support_damping_ratio is not None:
        ratio = 0.0  # drawn for each gearbox
    for name, gear in pair.gears.items():
        side = sizes.section(name)
        bodies[name], derived = _read_body(gear, side, material)
        holding = read_holding(gear, side)
        if is_on_bearings:
            derived = RADIAL
        elif derived:
            torque = _number("gear.rated_torque_nm", sizes["rated_torque_nm"])
        if derived:
            bodies[name] = put_on_bearings(
                bodies[name],
                gear,
                holding,
                material,
                torque / pair.pinion.base_radius,
                damping_ratio=ratio,
                keys=derived,
            )
    return bodies


def _read_body(
    gear: Gear, values: Section, material: Material
) -> tuple[Body, tuple[str, ...]]:
    """Mass, inertia and support of a gear, and what of its radial support is null.

    Mass and inertia that are null are those of a solid disc on the pitch circle less the bore. A
    radial support that is null, 0 here, follows from bearing and shaft.
    """
    group, density = f"gear.{gear.name}", material.density_kg_per_m3
    disc = solid_disc(gear.pitch_radius, gear.bore_radius, gear.face_width, density)
    inertias = dict(zip(("mass_kg", "inertia_kg_m2"), disc, strict=True))
    for key in inertias:
        if values[key] is not None:
            inertias[key] = _number(f"{group}.{key}", values[key])
    for key, value in inertias.items():
        if not value > 0.0:
            raise ConfigError(
                f"{group}.{key} = {value:g} must be positive, or null to derive it"
            )
    support = values.section("support")
    nulls = [key for key, value in support.items() if value is None]
    derived = [key for key in nulls if split_unit(key)[0] in RADIAL]
    support = support.without(*nulls) | dict.fromkeys(derived, 0.0)
    body = Body(
        mass=inertias["mass_kg"],
        inertia=inertias["inertia_kg_m2"],
        support=read(Support, support, f"{group}.support"),
    )
    return body, tuple(split_unit(key)[0] for key in derived)


def _read_rotor(key: str, values: Any) -> Rotor | None:
    """A motor or a load; None if it is null, or its inertia."""
    if values is None:
        return None
    if isinstance(values, Mapping) and values.get("inertia_kg_m2", 0.0) is None:
        return None
    try:
        return read(Rotor, values, "rotor")
    except ConfigError as error:
        raise ConfigError(f"{key}{str(error).removeprefix('rotor')}") from None


def _number(key: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ConfigError(f"{key} = {value!r} is not a number")
    return to_si(key, float(value))
