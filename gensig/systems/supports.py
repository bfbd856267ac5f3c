"""What holds a gear: supports as given, or stiffness from its bearings and shaft.

Damping as given, or from a ratio.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gensig.dynamics.bearing import BallBearing, Shaft, support_stiffness
from gensig.dynamics.pair import Body
from gensig.errors import ConfigError
from gensig.geometry.gear import Gear
from gensig.material import Material
from gensig.options.configuration import Section
from gensig.sensing.manufacturing import Gearbox, Quality
from gensig.units import from_si, read, to_si

AS_GIVEN = "as_given"
KINDS = (AS_GIVEN, "bearings")
AXIAL_SHARE = 0.5  # assumed: axial over radial stiffness of a gear between rolling bearings, one of which locates
KEYS_OF_AXIS = {
    "stiffness_z": "stiffness_z_n_per_m",
    "stiffness_tilt": "stiffness_tilt_nm_per_rad",
    "damping_z": "damping_z_ns_per_m",
    "damping_tilt": "damping_tilt_nms_per_rad",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Holding:
    """Shaft of a gear and the bearing at either end of it; None where they are not known."""

    bearing: BallBearing | None
    shaft: Shaft | None


def read_holding(gear: Gear, values: Section) -> Holding:
    """Bearing and shaft of the boundary keys of one gear; a shaft whose diameter is null fills
    the bore.

    Raises
    ------
    ConfigError    for sizes that make none
    """
    bearing, shaft = values.get("bearing"), values.get("shaft")
    if isinstance(shaft, Mapping) and shaft.get("diameter_mm", 0.0) is None:
        shaft = {**shaft, "diameter_mm": from_si("diameter_mm", 2.0 * gear.bore_radius)}
    try:
        return Holding(
            bearing=None if bearing is None else read(BallBearing, bearing, "bearing"),
            shaft=None if shaft is None else read(Shaft, shaft, "shaft"),
        )
    except ConfigError as error:
        raise ConfigError(f"gear.{gear.name}.{error}") from None


def on_bearings(kind: Any, quality: Quality) -> bool:
    """Whether ``system.supports`` asks for stiffness from bearings.

    ConfigError for what cannot be used.
    """
    if kind not in KINDS:
        raise ConfigError(f"system.supports = {kind!r}; allowed: {', '.join(KINDS)}")
    if kind == AS_GIVEN:
        return False
    if quality.support_damping_ratio is None:
        raise ConfigError(
            "system.supports = bearings says nothing of damping; give quality.support_damping_ratio_low and "
            "support_damping_ratio_high, for instance 0.01 and 0.1"
        )
    return True


def put_on_bearings(
    body: Body, gear: Gear, holding: Holding, material: Material, force: float
) -> Body:
    """The gear held by its shaft and bearings under the static mesh ``force`` in N; its damping
    is left to a ratio.

    Along the axis and against tilting it is held as given: radial contact says nothing of that.

    Raises
    ------
    ConfigError    where bearing or shaft are not known
    """
    if holding.bearing is None or holding.shaft is None:
        key = "bearing" if holding.bearing is None else "shaft"
        raise ConfigError(
            f"gear.{gear.name}.{key} = null: system.supports = bearings needs its sizes; give them, or take "
            "system.supports=as_given"
        )
    across, along = support_stiffness(holding.bearing, holding.shaft, material, force)
    held = replace(
        body.support,
        stiffness_x=across,
        stiffness_y=along,
        damping_x=0.0,
        damping_y=0.0,
    )
    return replace(body, support=held)


def held_axially(body: Body, gear: Gear, values: Section) -> Body:
    """A gear that also moves along its axis and tilts; what its source does not say of that
    follows from the rest.

    Tilting is held by half of the mean radial stiffness at either end of ``shaft.span_mm``, k
    span^2 / 4, the axis by ``AXIAL_SHARE`` of it, and dampers are to radial ones as springs are.
    A uniform disc of the gear's mass, inertia and face width tilts with J / 2 + m b^2 / 12.

    Raises
    ------
    ConfigError    where no support and no shaft says how the gear is held
    """
    given, support = values["support"], body.support
    radial, damping = (
        0.5 * (support.stiffness_x + support.stiffness_y),
        0.5 * (support.damping_x + support.damping_y),
    )
    if not radial > 0.0:
        raise ConfigError(
            f"gear.{gear.name}.support: a helical pair needs a radial stiffness above 0 on its bearings"
        )
    derived = {"stiffness_z": AXIAL_SHARE * radial}
    if given.get("stiffness_tilt_nm_per_rad") is None:
        shaft = values.get("shaft")
        if not isinstance(shaft, Mapping):
            raise ConfigError(
                f"gear.{gear.name}.support.stiffness_tilt_nm_per_rad = null is derived from shaft.span_mm; give either"
            )
        derived["stiffness_tilt"] = (
            0.25 * radial * to_si("span_mm", shaft["span_mm"]) ** 2
        )
    springs = {
        "stiffness_z": support.stiffness_z,
        "stiffness_tilt": support.stiffness_tilt,
    }
    springs |= {
        name: value
        for name, value in derived.items()
        if given.get(KEYS_OF_AXIS[name]) is None
    }
    dampers = {
        name: getattr(support, name)
        if given.get(KEYS_OF_AXIS[name]) is not None
        else springs[name.replace("damping", "stiffness")] * damping / radial
        for name in ("damping_z", "damping_tilt")
    }
    tilting = 0.5 * body.inertia + body.mass * gear.face_width**2 / 12.0
    return replace(
        body, support=replace(support, **springs, **dampers), tilt_inertia=tilting
    )


def in_gearbox(body: Body, gearbox: Gearbox, axes: slice, quality: Quality) -> Body:
    """A gear on its support in one gearbox; ``axes`` are the two places of its x and y among the
    four supports.

    Stiffness scatters about what it is, along the axis and in tilting as the mean of both radial
    ones. So does damping, unless ``quality`` has a range of damping ratios: then the ratio is the
    gearbox's, and without one the middle of the range.
    """
    support, stiffness, damping = (
        body.support,
        gearbox.stiffness_factor[axes],
        gearbox.damping_factor[axes],
    )
    stiffer, more_damped = (
        float(np.sqrt(stiffness.prod())),
        float(np.sqrt(damping.prod())),
    )
    scattered = replace(
        support,
        stiffness_x=support.stiffness_x * float(stiffness[0]),
        stiffness_y=support.stiffness_y * float(stiffness[1]),
        damping_x=support.damping_x * float(damping[0]),
        damping_y=support.damping_y * float(damping[1]),
        stiffness_z=support.stiffness_z * stiffer,
        damping_z=support.damping_z * more_damped,
        stiffness_tilt=support.stiffness_tilt * stiffer,
        damping_tilt=support.damping_tilt * more_damped,
    )
    nominal = quality.support_damping_ratio
    if nominal is not None:
        ratio = (
            np.full(2, nominal)
            if gearbox.damping_ratio is None
            else gearbox.damping_ratio[axes]
        )
        scattered = scattered.damped(body, float(ratio[0]), float(ratio[1]))
    return replace(body, support=scattered)
