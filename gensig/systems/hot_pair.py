"""A sliced pair at work.

How hot its gears get, what each effect of heat does to its mesh stiffness.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError, GeometryError
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.mesh.sliced.slices import LoadedContact, loaded_contact
from gensig.mesh.thermal.body_heat import BodyHeat, solved_body, uniform_body
from gensig.mesh.thermal.heat import (
    Heat,
    contact_half_width,
    flash_temperature,
    friction_heat,
    rolling_speeds,
)
from gensig.mesh.thermal.thermal_growth import GearGrowth, PairGrowth
from gensig.systems.sliced_pair import SlicedPair

Array = NDArray[np.float64]

COLD, TRUE, CONTACT_RATIO, APPARENT, SOFTENED = (
    "cold",
    "true",
    "contact_ratio",
    "apparent",
    "softened",
)
N_FLASH_POSITIONS = 60


@dataclass(frozen=True, slots=True, kw_only=True)
class Duty:
    """A cold pair, how it is heated and cooled, and the pinion's speed in rad/s."""

    system: SlicedPair
    heat: Heat
    speed: float

    def __post_init__(self) -> None:
        if not self.speed > 0.0:
            raise ConfigError(
                f"operating.speed_rpm = {self.speed * 30.0 / math.pi:g} must be positive to heat gears"
            )

    @property
    def friction(self) -> float:
        """Coefficient of friction of the flanks, ``mesh.friction_coefficient``."""
        return self.system.mesh.friction_coefficient


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HotState:
    """How hot a pair is, from the loads that its cold flanks have.

    Parameters
    ----------
    contact : LoadedContact           of the cold pair
    friction_heat : W
    pinion, wheel : BodyHeat
    flash_position : (position,) m    on the path of contact, from A
    flash : (position,) K             largest of all slices that pass there, above the teeth's temperature; corners
        that bear beyond the path are left out
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
    """Mesh stiffness with some effects of heat.

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
    ConfigError          where nothing cools a gear
    ExtrapolationError   for temperatures beyond the material's data
    """
    system, heat = duty.system, duty.heat
    contact = loaded_contact(system.sliced_mesh(), system.phases(), system.mesh_force)
    loss = friction_heat(
        system.pair, contact.position, contact.line_load,
        force=system.mesh_force, friction=duty.friction, speed=duty.speed,
    )  # fmt: skip
    share, cooling = heat.pinion_heat_share, heat.at_speed(duty.speed)
    pinion = _body(
        system.pair.pinion,
        share * loss,
        cooling,
        heat.pinion_temperature,
        heat.pinion_bore_temperature,
    )
    wheel = _body(
        system.pair.wheel,
        (1.0 - share) * loss,
        cooling,
        heat.wheel_temperature,
        heat.wheel_bore_temperature,
    )
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


def heated(
    duty: Duty, state: HotState, *, growth: bool, center_distance: bool, softening: bool
) -> SlicedPair:
    """The pair with the effects of heat that are asked for.

    growth : the pair grows as a whole by the strain of its base pitches, housing and shafts alike; what its gears
        differ from that, in base pitch and between body and teeth, is a deviation of the flanks
    center_distance : the shafts keep the distance that the housing's own temperature gives them
    softening : Young's modulus at the teeth's temperatures; 1 / E is the mean of both gears'

    Raises
    ------
    GeometryError    where the gears grow more than the backlash lets them
    """
    system = duty.system
    if growth or center_distance:
        strain = state.growth.strain(system.pair)
        housing = duty.heat.expansion * (
            duty.heat.housing_temperature - duty.heat.reference_temperature
        )
        pair = _grown(system.pair, state.growth, strain) if growth else system.pair
        if center_distance:
            pair = _in_housing(system.pair, pair, state.growth, strain, housing)
        system = replace(system, pair=pair, growth=state.growth if growth else None)
    if softening:
        ratios = [
            duty.heat.modulus_ratio(body.tooth) for body in (state.pinion, state.wheel)
        ]
        modulus = (
            system.material.youngs_modulus * 2.0 / sum(1.0 / ratio for ratio in ratios)
        )
        system = replace(
            system, material=replace(system.material, youngs_modulus=modulus)
        )
    return system


def as_configured(duty: Duty) -> SlicedPair:
    """The pair with the effects that its ``heat`` switches on.

    The pair itself where it switches none.
    """
    heat = duty.heat
    if not heat.is_any:
        return duty.system
    return heated(
        duty, hot_state(duty),
        growth=heat.growth, center_distance=heat.center_distance, softening=heat.softening,
    )  # fmt: skip


def stiffness_variants(duty: Duty, state: HotState) -> dict[str, Variant]:
    """Mesh stiffness, each effect of heat for itself; effects that are switched off are left out.

    cold : no heat
    true : the gears grow, the housing with them
    contact_ratio : the gears grow, the housing has its own temperature
    apparent : force over approach with the thermal part in it, eq. (35) of the thermal paper: the cold approach less
        what the teeth's growth moves the gears apart. A preload, no stiffness. Left out where the growth is larger
    softened : as ``true``, with Young's modulus at temperature
    """
    heat = duty.heat
    found = {COLD: _variant(duty.system)}
    if heat.growth:
        found[TRUE] = _variant(
            heated(duty, state, growth=True, center_distance=False, softening=False)
        )
    if heat.center_distance:
        found[CONTACT_RATIO] = _variant(
            heated(
                duty, state, growth=heat.growth, center_distance=True, softening=False
            )
        )
    if heat.growth:
        cold, thermal = found[COLD], state.growth.teeth_alone(duty.system.pair)
        if thermal < float(cold.approach.min()):
            left = cold.approach - thermal
            factor = float(cold.approach.mean() / left.mean())
            found[APPARENT] = replace(
                cold,
                approach=left,
                mesh=duty.system.mesh_force / left,
                single=cold.single * factor,
            )
    if heat.softening:
        found[SOFTENED] = _variant(
            heated(
                duty, state, growth=heat.growth, center_distance=False, softening=True
            )
        )
    return found


def sweep(duty: Duty, name: str, values: Sequence[float]) -> list[dict[str, Variant]]:
    """Stiffness variants over one working condition, the others kept.

    Parameters
    ----------
    name : ``friction`` (coefficient), ``torque`` (N m, of the pinion) or ``speed`` (rad/s, of the pinion)
    """
    found = []
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
        found.append(stiffness_variants(changed, hot_state(changed)))
    return found


def flash_skin_growth(duty: Duty, state: HotState) -> float:
    """How far the flash temperature lifts the surface of a flank, m: an upper bound.

    The heat of one passing contact reaches sqrt(g t / (rho c)) deep in the time t that the
    contact's width takes to pass; that skin, held by the cold tooth around it, expands by (1 +
    nu) / (1 - nu) times its free expansion.
    """
    pair, material, heat = duty.system.pair, duty.system.material, duty.heat
    load = float(state.contact.line_load.max())
    hottest = state.flash_position[[int(np.argmax(state.flash))]]
    width = 2.0 * float(contact_half_width(pair, hottest, load, material)[0])
    slowest = min(float(one[0]) for one in rolling_speeds(pair, hottest, duty.speed))
    depth = math.sqrt(
        heat.conductivity
        * width
        / (slowest * material.density_kg_per_m3 * heat.specific_heat)
    )
    held = (1.0 + material.poisson_ratio) / (1.0 - material.poisson_ratio)
    return held * heat.expansion * float(state.flash.max()) * depth


def _body(
    gear: Gear, input_heat: float, heat: Heat, known: float | None, bore: float | None
) -> BodyHeat:
    body = (
        uniform_body(gear, known)
        if known is not None
        else solved_body(gear, input_heat, heat, bore_temperature=bore)
    )
    for temperature in (body.tooth, float(body.temperature[0])):
        heat.require_known(
            temperature,
            f"{gear.name}: a temperature of {temperature:.4g} degrees Celsius",
        )
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
        pair, contact.position, contact.line_load, duty.system.material, duty.heat,
        friction=duty.friction, speed=duty.speed,
    )  # fmt: skip
    edges = np.linspace(0.0, pair.path_of_contact, N_FLASH_POSITIONS + 1)
    place = np.searchsorted(edges, contact.position) - 1
    inside = (place >= 0) & (place < N_FLASH_POSITIONS)
    largest = np.zeros(N_FLASH_POSITIONS)
    np.maximum.at(largest, place[inside], flash[inside])
    return 0.5 * (edges[1:] + edges[:-1]), largest


def _grown(pair: GearPair, growth: PairGrowth, strain: float) -> GearPair:
    """The pair made larger by its common strain, each gear as wide as its teeth and with the bore
    that its body has.
    """
    pinion, wheel = (
        replace(
            gear,
            normal_module=gear.normal_module * (1.0 + strain),
            face_width=gear.face_width * (1.0 + own.tooth),
            bore_radius=gear.bore_radius * (1.0 + own.body),
        )
        for gear, own in ((pair.pinion, growth.pinion), (pair.wheel, growth.wheel))
    )
    return replace(
        pair,
        pinion=pinion,
        wheel=wheel,
        center_distance_change=pair.center_distance_change,
    )


def _in_housing(
    cold: GearPair, pair: GearPair, growth: PairGrowth, strain: float, housing: float
) -> GearPair:
    """The pair at the shafts' distance in a housing with its own strain."""
    closing = growth.closing(cold, housing)
    if closing > cold.backlash:
        raise GeometryError(
            f"the gears jam: heat makes them grow {closing * 1e6:.0f} um more than the housing lets them, along the "
            f"line of action, and gear.backlash_um is {cold.backlash * 1e6:g}; raise it, cool the gears, or warm the "
            f"housing (heat.housing_temperature_degc)"
        )
    # relative to gears that have, or have not, grown in this description
    scale = pair.pinion.normal_module / cold.pinion.normal_module
    change = cold.center_distance * scale * ((1.0 + housing) / (1.0 + strain) - 1.0)
    try:
        return replace(
            pair, backlash=cold.backlash - closing, center_distance_change=change
        )
    except GeometryError as error:
        raise GeometryError(
            f"gears grown against the housing by heat: {error}"
        ) from None


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
