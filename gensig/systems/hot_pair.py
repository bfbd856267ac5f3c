"""A sliced pair at work: temperatures of its gears, and effects of heat on mesh stiffness."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError, GeometryError
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.material import Material
from gensig.mesh.sliced.slices import LoadedContact, loaded_contact
from gensig.mesh.thermal.body_heat import (
    BodyHeat,
    solved_body,
    uniform_body,
    warming_body,
)
from gensig.mesh.thermal.heat import (
    Heat,
    contact_half_width,
    flash_temperature,
    friction_heat,
    rolling_speeds,
)
from gensig.mesh.thermal.paper_growth import (
    READINGS,
    PaperGrowth,
    gear_growth,
    no_growth,
)
from gensig.mesh.thermal.thermal_growth import GearGrowth, PairGrowth
from gensig.systems.sliced_pair import SlicedPair

COLD, TRUE, CONTACT_RATIO = "cold", "true", "contact_ratio"
APPARENT, SOFTENED = "apparent", "softened"
PAPER, PAPER_HOUSED = "paper", "paper_contact_ratio"
PAPER_COLD = "paper_cold"
PAPER_SUMS, PAPER_COLD_SUMS = "paper_components", "paper_cold_components"
# the variant that a variant of the paper's equations is compared with
COMPARED = {
    PAPER: PAPER_COLD,
    PAPER_HOUSED: PAPER_COLD,
    PAPER_SUMS: PAPER_COLD_SUMS,
}
N_FLASH_POSITIONS = 60


@dataclass(frozen=True, slots=True, kw_only=True)
class Duty:
    """A cold pair, its heating and cooling, and the pinion's speed in rad/s."""

    system: SlicedPair
    heat: Heat
    speed: float

    def __post_init__(self) -> None:
        if not self.speed > 0.0:
            raise ConfigError(
                f"operating.speed_rpm = {self.speed * 30.0 / math.pi:g} must be positive to heat "
                "gears"
            )

    @property
    def friction(self) -> float:
        """Coefficient of friction of the flanks, ``mesh.friction_coefficient``."""
        return self.system.mesh.friction_coefficient


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HotState:
    """Temperatures of a pair, from the loads on its cold flanks.

    Parameters
    ----------
    contact : LoadedContact           of the cold pair
    friction_heat : W
    pinion, wheel : BodyHeat
    flash_position : (position,) m    on the path of contact, from A
    flash : (position,) K             largest of all slices there, above the teeth's temperature;
        contact beyond the path is left out
    growth : PairGrowth
    """

    contact: LoadedContact
    friction_heat: float
    pinion: BodyHeat
    wheel: BodyHeat
    flash_position: Array
    flash: Array
    growth: PairGrowth


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Variant:
    """Mesh stiffness with a choice of effects of heat.

    Parameters
    ----------
    transverse_contact_ratio : of the pair as it meshes
    approach : (phase,) m            under the load
    mesh : (phase,) N/m              over one mesh period
    position : (position,)           of a pair's first slice, base pitches
    single : (position,) N/m         one pair, slices on the path
    """

    transverse_contact_ratio: float
    approach: Array
    mesh: Array
    position: Array
    single: Array


def hot_state(duty: Duty) -> HotState:
    """Temperatures of a pair at work.

    Raises
    ------
    ConfigError          for a gear without cooling
    ExtrapolationError   for temperatures beyond the material's data
    """
    system, heat = duty.system, duty.heat
    contact = loaded_contact(system.sliced_mesh(), system.phases(), system.mesh_force)
    loss = friction_heat(
        system.pair,
        contact.position,
        contact.line_load,
        force=system.mesh_force,
        friction=duty.friction,
        speed=duty.speed,
    )
    share, cooling = heat.pinion_heat_share, heat.at_speed(duty.speed)
    material = system.material
    pinion = _body(system.pair.pinion, share * loss, material, cooling)
    wheel = _body(system.pair.wheel, (1.0 - share) * loss, material, cooling)
    position, flash = _flash_along_path(duty, contact)
    return HotState(
        contact=contact,
        friction_heat=loss,
        pinion=pinion,
        wheel=wheel,
        flash_position=position,
        flash=flash,
        growth=PairGrowth(pinion=_growth(pinion, heat), wheel=_growth(wheel, heat)),
    )


def paper_growth(duty: Duty, state: HotState) -> PaperGrowth:
    """Growth of the teeth by the reading that ``mesh.heat_law`` names."""
    system, heat = duty.system, duty.heat
    name, pair = system.mesh.heat_law, system.pair
    sides = {
        side: gear_growth(
            gear,
            READINGS[name],
            bore_rise=float(body.temperature[0]) - heat.reference_temperature,
            tooth_rise=body.tooth - heat.reference_temperature,
            expansion=heat.expansion,
            poisson_ratio=system.material.poisson_ratio,
        )
        for (side, gear), body in zip(
            pair.gears.items(), (state.pinion, state.wheel), strict=True
        )
    }
    return PaperGrowth(
        reading=name,
        **sides,
        flash_position=tuple(state.flash_position.tolist()),
        flash_strain=tuple((heat.expansion * state.flash).tolist()),
    )


def heated(
    duty: Duty,
    state: HotState,
    *,
    growth: bool,
    center_distance: bool,
    softening: bool,
    papers: bool = False,
) -> SlicedPair:
    """The pair with chosen effects of heat.

    Parameters
    ----------
    papers : growth is that of ``mesh.heat_law``, not gensig's own: the teeth alone grow, by the
        paper's equations
    growth : the pair grows as a whole by the strain of its base pitches, housing and shafts alike;
        the remaining differences of its gears, in base pitch and between body and teeth, are a
        deviation of the flanks
    center_distance : the shafts have the distance of the housing at its own temperature
    softening : Young's modulus at the teeth's temperatures; 1 / E is the mean of both gears'

    Raises
    ------
    GeometryError    for growth beyond the backlash
    """
    system, heat = duty.system, duty.heat
    cold, material = system.pair, system.material
    strain = state.growth.strain(cold)
    if growth and papers:
        system = replace(system, hot_teeth=paper_growth(duty, state))
    elif growth:
        pair = _grown(cold, state.growth, strain)
        system = replace(system, pair=pair, growth=state.growth)
    if center_distance:
        rise = heat.housing_temperature - heat.reference_temperature
        housing = heat.expansion * rise
        pair = _in_housing(cold, system.pair, state.growth, strain, housing)
        system = replace(system, pair=pair)
    if softening:
        bodies = state.pinion, state.wheel
        compliance = sum(1.0 / heat.modulus_ratio(body.tooth) for body in bodies)
        modulus = material.youngs_modulus * 2.0 / compliance
        system = replace(system, material=replace(material, youngs_modulus=modulus))
    return system


def as_configured(duty: Duty) -> SlicedPair:
    """The pair with the effects that its ``heat`` switches on; the cold pair without any."""
    heat = duty.heat
    if not heat.is_any:
        return duty.system
    return heated(
        duty,
        hot_state(duty),
        growth=heat.growth,
        center_distance=heat.center_distance,
        softening=heat.softening,
        papers=duty.system.mesh.has_papers_heat,
    )


def stiffness_variants(duty: Duty, state: HotState) -> dict[str, Variant]:
    """Mesh stiffness with each effect of heat; effects that are switched off are left out.

    cold : no heat
    true : the gears grow, the housing with them
    contact_ratio : the gears grow, the housing has its own temperature
    apparent : force over approach including the thermal part, eq. (35) of the thermal paper: the
        cold approach less the distance by which the teeth's growth separates the gears. A preload,
        not a stiffness. Left out if the growth is larger than the approach
    softened : as ``true``, with Young's modulus at temperature
    paper : by the reading of the paper's equations that ``mesh.heat_law`` names
    paper_contact_ratio : as ``paper``, the housing has its own temperature
    paper_cold : by the same equations without growth; equal to ``cold``, but for misprints
    paper_components, paper_cold_components : as both, by the literal eq. (14)
    """

    def variant(*, center_distance: bool = False, softening: bool = False) -> Variant:
        effects = {"center_distance": center_distance, "softening": softening}
        return _variant(heated(duty, state, growth=duty.heat.growth, **effects))

    heat, cold = duty.heat, _variant(duty.system)
    variants = {COLD: cold}
    if heat.growth:
        variants[TRUE] = variant()
    if heat.center_distance:
        variants[CONTACT_RATIO] = variant(center_distance=True)
    thermal = state.growth.teeth_alone(duty.system.pair)
    if heat.growth and thermal < float(cold.approach.min()):
        left = cold.approach - thermal
        factor = float(cold.approach.mean() / left.mean())
        variants[APPARENT] = replace(
            cold,
            approach=left,
            mesh=duty.system.mesh_force / left,
            single=cold.single * factor,
        )
    if heat.softening:
        variants[SOFTENED] = variant(softening=True)
    if duty.system.mesh.has_papers_heat:
        variants |= _paper_variants(duty, state)
    return variants


def _paper_variants(duty: Duty, state: HotState) -> dict[str, Variant]:
    """The variants of the paper's equations."""
    effects = {"growth": True, "softening": False, "papers": True}
    hot = heated(duty, state, center_distance=False, **effects)
    at_rest = replace(duty.system, hot_teeth=no_growth(duty.system.mesh.heat_law))
    variants = {PAPER_COLD: _variant(at_rest), PAPER: _variant(hot)}
    if duty.heat.center_distance:
        housed = heated(duty, state, center_distance=True, **effects)
        variants[PAPER_HOUSED] = _variant(housed)
    for name, of_slices, system in (
        (PAPER_COLD_SUMS, PAPER_COLD, at_rest),
        (PAPER_SUMS, PAPER, hot),
    ):
        mesh, single = system.component_sums()
        variants[name] = replace(
            variants[of_slices],
            approach=system.mesh_force / mesh,
            mesh=mesh,
            single=single,
        )
    return variants


def compared(variants: dict[str, Variant], name: str) -> Variant:
    """The cold variant to compare another with: by the same equations, where those are the paper's.

    The paper's equations without growth are compared with the cold pair.
    """
    return variants[COMPARED.get(name, COLD)]


def sweep(duty: Duty, name: str, values: Sequence[float]) -> list[dict[str, Variant]]:
    """Stiffness variants over one working condition, the others constant.

    Parameters
    ----------
    name : ``friction`` (coefficient), ``torque`` (N m) or ``speed`` (rad/s) of the pinion
    """
    variants = []
    for value in values:
        if name == "friction":
            mesh = replace(duty.system.mesh, friction_coefficient=value)
            changed = replace(duty, system=replace(duty.system, mesh=mesh))
        elif name == "torque":
            changed = replace(duty, system=replace(duty.system, torque=value))
        elif name == "speed":
            changed = replace(duty, speed=value)
        else:
            raise ConfigError(
                f"a sweep over {name!r}; allowed: friction, torque, speed"
            )
        variants.append(stiffness_variants(changed, hot_state(changed)))
    return variants


def flash_skin_growth(duty: Duty, state: HotState) -> float:
    """Upper bound of the lift of a flank's surface by the flash temperature, m.

    The heat of one passing contact reaches sqrt(g t / (rho c)) deep in the time t in which the
    contact's width passes. That skin, held by the cold tooth around it, expands by (1 + nu) /
    (1 - nu) times its free expansion.
    """
    pair, material, heat = duty.system.pair, duty.system.material, duty.heat
    load = float(state.contact.line_load.max())
    hottest = state.flash_position[[int(np.argmax(state.flash))]]
    width = 2.0 * float(contact_half_width(pair, hottest, load, material)[0])
    slowest = min(float(v[0]) for v in rolling_speeds(pair, hottest, duty.speed))
    capacity = slowest * material.density_kg_per_m3 * heat.specific_heat
    depth = math.sqrt(heat.conductivity * width / capacity)
    held = (1.0 + material.poisson_ratio) / (1.0 - material.poisson_ratio)
    return held * heat.expansion * float(state.flash.max()) * depth


def _body(gear: Gear, input_heat: float, material: Material, heat: Heat) -> BodyHeat:
    temperature = getattr(heat, f"{gear.name}_temperature")
    if temperature is not None:
        body = uniform_body(gear, temperature)
    else:
        bore = getattr(heat, f"{gear.name}_bore_temperature")
        body = solved_body(gear, input_heat, heat, bore_temperature=bore)
        if heat.running_time is not None:
            body = warming_body(body, gear, material, heat, heat.running_time)
    for value in (body.tooth, float(body.temperature[0])):
        text = f"{gear.name}: a temperature of {value:.4g} degrees Celsius"
        heat.require_known(value, text)
    return body


def _growth(body: BodyHeat, heat: Heat) -> GearGrowth:
    return GearGrowth(
        tooth=heat.expansion * (body.tooth - heat.reference_temperature),
        body=heat.expansion * (body.mean - heat.reference_temperature),
    )


def _flash_along_path(duty: Duty, contact: LoadedContact) -> tuple[Array, Array]:
    """Largest flash temperature of every stretch of the path, (position,) m and K."""
    pair = duty.system.pair
    flash = flash_temperature(
        pair,
        contact.position,
        contact.line_load,
        duty.system.material,
        duty.heat,
        friction=duty.friction,
        speed=duty.speed,
    )
    edges = np.linspace(0.0, pair.path_of_contact, N_FLASH_POSITIONS + 1)
    stretch = np.searchsorted(edges, contact.position) - 1
    inside = (stretch >= 0) & (stretch < N_FLASH_POSITIONS)
    largest = np.zeros(N_FLASH_POSITIONS)
    np.maximum.at(largest, stretch[inside], flash[inside])
    return 0.5 * (edges[1:] + edges[:-1]), largest


def _grown(pair: GearPair, growth: PairGrowth, strain: float) -> GearPair:
    """The pair enlarged by its common strain, with the width of its teeth and the bores grown."""
    sides = (pair.pinion, growth.pinion), (pair.wheel, growth.wheel)
    pinion, wheel = (
        replace(
            gear,
            normal_module=gear.normal_module * (1.0 + strain),
            face_width=gear.face_width * (1.0 + of_gear.tooth),
            bore_radius=gear.bore_radius * (1.0 + of_gear.body),
        )
        for gear, of_gear in sides
    )
    change = pair.center_distance_change
    return replace(pair, pinion=pinion, wheel=wheel, center_distance_change=change)


def _in_housing(
    cold: GearPair, pair: GearPair, growth: PairGrowth, strain: float, housing: float
) -> GearPair:
    """The pair at the shafts' distance of a housing with a strain of its own."""
    closing = growth.closing(cold, housing)
    if closing > cold.backlash:
        raise GeometryError(
            f"the gears jam: heat makes them grow {closing * 1e6:.0f} um more than the housing "
            "lets them, along the line of action, and gear.backlash_um is "
            f"{cold.backlash * 1e6:g}; raise it, cool the gears, or warm the housing "
            "(heat.housing_temperature_degc)"
        )
    # relative to gears that have, or have not, grown in this description
    scale = pair.pinion.normal_module / cold.pinion.normal_module
    change = cold.center_distance * scale * ((1.0 + housing) / (1.0 + strain) - 1.0)
    backlash = cold.backlash - closing
    try:
        return replace(pair, backlash=backlash, center_distance_change=change)
    except GeometryError as error:
        text = f"gears grown against the housing by heat: {error}"
        raise GeometryError(text) from None


def _variant(system: SlicedPair) -> Variant:
    result = system.transmission_error()
    position, single = system.single_pair()
    return Variant(
        transverse_contact_ratio=system.pair.transverse_contact_ratio,
        approach=result.error,
        mesh=result.contact.stiffness,
        position=position / system.pair.base_pitch,
        single=single,
    )
