"""Systems by their names in configurations, each built from one resolved configuration."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any, final

from gensig.dynamics.integrator import Solver
from gensig.dynamics.pair import Body, Rotor, Support, solid_disc
from gensig.errors import ConfigError
from gensig.geometry.contact import SIDES, GearPair
from gensig.geometry.gear import Gear
from gensig.material import Material
from gensig.mesh.modification import FlankModification, PairModification, sound_teeth
from gensig.mesh.options import (
    MeshOptions,
    SliceOptions,
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
from gensig.systems.hot_pair import Duty, as_configured
from gensig.systems.pair_machine import GearPairMachine
from gensig.systems.sliced_pair import SlicedPair
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


@final
class PairParts:
    """Parts of a gear pair's machine, each section of the configuration read once.

    A section is read when it is first asked for.
    """

    def __init__(self, config: Configuration) -> None:
        self._config = config

    def section(self, name: str) -> Section:
        """A group of keys."""
        return self._config.section(name)

    @cached_property
    def gear(self) -> Section:
        """The group ``gear``, sizes that are null filled."""
        return completed(self.section("gear"))

    @cached_property
    def pair(self) -> GearPair:
        """The two cold gears."""
        return read_pair(self.gear)

    @cached_property
    def material(self) -> Material:
        """The material of both gears."""
        return read_material(self.section("material"))

    @cached_property
    def heat(self) -> Heat:
        """Effects of heat, and their parameters."""
        return self.section("heat").read(Heat)

    @cached_property
    def mesh(self) -> MeshOptions:
        """Options of the mesh."""
        return read_mesh_options(self.section("mesh"))

    @cached_property
    def slices(self) -> SliceOptions:
        """Options of the slices of the teeth."""
        return read_slice_options(self.section("mesh"))

    @cached_property
    def modification(self) -> PairModification:
        """Modifications of the flanks."""
        return read_modification(self.section("modification"))

    @cached_property
    def flanks(self) -> SlicedPair:
        """The pair cut into slices, with its effects of heat."""
        _refuse_line(self.section("system"))
        if self.heat.is_any:
            return as_configured(self.duty)
        return self.cold_flanks

    @property
    def duty(self) -> Duty:
        """The cold pair with its heating and cooling."""
        speed = self.section("operating")["speed_rpm"]
        return Duty(
            system=self.cold_flanks,
            heat=self.heat,
            speed=_number("operating.speed_rpm", speed),
        )

    @cached_property
    def cold_flanks(self) -> SlicedPair:
        """The pair cut into slices, without heat.

        ConfigError for ``mesh.heat_law=paper`` where no teeth grow.
        """
        if self.mesh.has_papers_heat and not self.heat.growth:
            raise ConfigError(
                f"mesh.heat_law = {self.mesh.heat_law} is for teeth that grow with heat: take "
                "heat=chongqing_rated or heat.growth=true, or mesh.heat_law=grown"
            )
        torque = self.section("operating")["torque_nm"]
        return SlicedPair(
            pair=self.pair,
            material=self.material,
            mesh=self.mesh,
            slices=self.slices,
            modification=self.modification,
            torque=_number("operating.torque_nm", torque),
        )


def spur_pair(parts: PairParts) -> GearPairMachine:
    """A spur pair."""
    modification = parts.modification
    refuse_papers_heat(parts.mesh, "system=spur_pair")
    helix = parts.section("gear")["helix_angle_deg"]
    if _number("gear.helix_angle_deg", helix) != 0.0:
        raise ConfigError(
            f"gear.helix_angle_deg = {helix:g}: system=spur_pair takes spur gears, 0; helical "
            "ones have system=helical_pair"
        )
    flanks = parts.flanks if parts.heat.is_any else None
    pair = flanks.pair if flanks else parts.pair
    machine = _common_parts(parts, pair)
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
    return GearPairMachine(
        pair=pair,
        slices=parts.slices,
        has_whole_teeth=True,
        modification=modification,
        **machine,
    )


def helical_pair(parts: PairParts) -> GearPairMachine:
    """A helical pair, or a spur pair in slices."""
    flanks = parts.flanks
    machine = _common_parts(parts, flanks.pair)
    bodies = {
        name: held_axially(machine[name], gear, parts.gear.section(name))
        for name, gear in flanks.pair.gears.items()
    }
    machine |= bodies
    machine["material"] = flanks.material
    return GearPairMachine(
        pair=flanks.pair,
        slices=flanks.slices,
        has_whole_teeth=False,
        modification=replace(flanks.modification, growth=flanks.growth),
        hot_teeth=flanks.hot_teeth,
        **machine,
    )


def _common_parts(parts: PairParts, pair: GearPair) -> dict[str, Any]:
    """Common fields of the machines of spur and helical pairs, by the names of the fields."""
    material = parts.material
    machine = parts.section("system")
    for key in machine:
        if key not in SYSTEM_KEYS:
            known = ", ".join(SYSTEM_KEYS)
            raise ConfigError(f"system: unknown key '{key}'; known: {known}")
    operating = read_operating(parts.section("operating"))
    quality = parts.section("quality").read(Quality)
    bodies = _read_bodies(parts, pair, operating.torque, quality)
    return {
        "material": material,
        "mesh": parts.mesh,
        **bodies,
        "operating": operating,
        "sensing": read_sensing(parts.section("sensing")),
        "quality": quality,
        "solver": parts.section("solver").read(Solver),
        "motor": _read_rotor("system.motor", machine.get("motor")),
        "load": _read_rotor("system.load", machine.get("load")),
    }


def read_pair(gear: Section) -> GearPair:
    """The two gears of the group ``gear``; by default the wheel has the opposite hand.

    A backlash that is null is the recommended one.
    """
    gear = completed(gear)
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


def read_material(section: Section) -> Material:
    """The material of the group ``material``."""
    material = section.read(Material)
    ratio = material.poisson_ratio
    if ratio >= 0.5:
        raise ConfigError(f"material.poisson_ratio = {ratio:g} must be below 0.5")
    return material


def read_modification(section: Section) -> PairModification:
    """Flank modifications of both gears, of the group ``modification``."""
    sides = {}
    for name in SIDES:
        try:
            sides[name] = section.section(name).read(FlankModification)
        except ConfigError as error:
            text = str(error)
            if not text.startswith("modification"):
                text = f"modification.{name}.{text}"
            raise ConfigError(text) from None
    return section.without(*SIDES).read(PairModification, **sides, growth=None)


SYSTEMS: dict[str, Callable[[PairParts], GearPairMachine]] = {
    "spur_pair": spur_pair,
    SLICED: helical_pair,
}


def read_system(config: Configuration) -> GearPairMachine:
    """Build the system that ``system.kind`` names.

    Raises
    ------
    ConfigError, GeometryError    for invalid keys or values
    """
    kind = config.section("system").get("kind")
    _refuse_line(config.section("system"))
    if config.get("excitation") is not None:
        raise ConfigError(
            "excitation turns a drive line (system=engine_gear_train, gensig forced-response); "
            f"system={kind} turns as operating says, leave excitation out"
        )
    if kind not in SYSTEMS:
        allowed = ", ".join((*SYSTEMS, LINE))
        raise ConfigError(f"system.kind = {kind!r}; allowed: {allowed}")
    machine = SYSTEMS[kind](PairParts(config))
    return replace(machine, sensing=machine.sensing.of_machine(machine.channels))


def read_sliced_pair(config: Configuration) -> SlicedPair:
    """Build a spur or helical pair cut into slices, of any system of pairs.

    The pair has the effects of heat of the configuration.
    """
    return PairParts(config).flanks


def _refuse_line(machine: Section) -> None:
    """Raise ConfigError for a drive line."""
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
    parts: PairParts, pair: GearPair, torque: float, quality: Quality
) -> dict[str, Body]:
    """Both gears on their supports, by name.

    With ``system.supports=bearings`` bearings carry ``torque`` in N m of the pinion. Without it
    what is null of a support follows from bearings at the rated torque.
    """
    is_on_bearings = on_bearings(parts.section("system").get("supports", AS_GIVEN))
    sizes, material = parts.gear, parts.material
    bodies, ratio = {}, DAMPING_RATIO
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
