"""Supports of gears: as given, or with stiffness from bearings and shaft.

Damping is as given, or from a ratio.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gensig.dynamics.bearing import BallBearing, Shaft, support_stiffness
from gensig.dynamics.pair import Body, Support
from gensig.errors import ConfigError
from gensig.geometry.gear import Gear
from gensig.material import Material
from gensig.options.configuration import Section
from gensig.sensing.manufacturing import Gearbox, Quality
from gensig.units import from_si, read, to_si

AS_GIVEN = "as_given"
KINDS = (AS_GIVEN, "bearings")
# assumed: of each gear on its support, where nothing else is known of its damping
DAMPING_RATIO = 0.03
STIFFNESS = ("stiffness_x", "stiffness_y")  # across the line of action and along it
DAMPING = ("damping_x", "damping_y")
RADIAL = STIFFNESS + DAMPING
# assumed: axial over radial stiffness of a gear between rolling bearings, one of which locates
AXIAL_SHARE = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Holding:
    """Shaft of a gear and the bearing at either end of it; None if not known."""

    bearing: BallBearing | None
    shaft: Shaft | None


def read_holding(gear: Gear, values: Section) -> Holding:
    """Bearing and shaft of the boundary keys of one gear.

    A shaft whose diameter is null fills the bore.

    Raises
    ------
    ConfigError    for impossible sizes
    """
    bearing, shaft = values.get("bearing"), values.get("shaft")
    if isinstance(shaft, Mapping) and shaft.get("diameter_mm", 0.0) is None:
        shaft = {**shaft, "diameter_mm": from_si("diameter_mm", 2.0 * gear.bore_radius)}
    try:
        if bearing is not None:
            bearing = read(BallBearing, bearing, "bearing")
        if shaft is not None:
            shaft = read(Shaft, shaft, "shaft")
        return Holding(bearing=bearing, shaft=shaft)
    except ConfigError as error:
        raise ConfigError(f"gear.{gear.name}.{error}") from None


def on_bearings(kind: Any) -> bool:
    """True if ``system.supports`` asks for stiffness from bearings.

    ConfigError for an unknown kind.
    """
    if kind not in KINDS:
        raise ConfigError(f"system.supports = {kind!r}; allowed: {', '.join(KINDS)}")
    return bool(kind != AS_GIVEN)


def put_on_bearings(
    body: Body,
    gear: Gear,
    holding: Holding,
    material: Material,
    force: float,
    *,
    damping_ratio: float = DAMPING_RATIO,
    keys: Sequence[str] = RADIAL,
) -> Body:
    """The gear on its shaft and bearings under the static mesh ``force`` in N.

    ``keys`` are the stiffnesses and dampings that follow from them, others are as given. So are
    axial and tilt stiffness: radial contact does not determine them. Damping is that of
    ``damping_ratio`` of the gear alone on its support.

    Raises
    ------
    ConfigError    if bearing or shaft are not known
    """
    support = body.support
    if set(keys) & set(STIFFNESS):
        stiffness = _stiffness(gear, holding, material, force)
        derived = dict(zip(STIFFNESS, stiffness, strict=True))
        support = replace(
            support, **{key: derived[key] for key in STIFFNESS if key in keys}
        )
    held = (support.stiffness_x, support.stiffness_y)
    dampers = {
        key: 2.0 * damping_ratio * math.sqrt(stiffness * body.mass)
        for key, stiffness in zip(DAMPING, held, strict=True)
        if key in keys
    }
    return replace(body, support=replace(support, **dampers))


def _stiffness(
    gear: Gear, holding: Holding, material: Material, force: float
) -> tuple[float, float]:
    """Radial stiffness across and along the line of action, N/m."""
    for key in ("bearing", "shaft"):
        if getattr(holding, key) is None:
            raise ConfigError(
                f"gear.{gear.name}.{key} = null: system.supports = bearings, and a stiffness of "
                f"gear.{gear.name}.support that is null, need its sizes; give them, or all of "
                f"gear.{gear.name}.support with system.supports=as_given"
            )
    assert holding.bearing is not None
    assert holding.shaft is not None
    return support_stiffness(holding.bearing, holding.shaft, material, force)


def held_axially(body: Body, gear: Gear, values: Section) -> Body:
    """A gear that also moves along its axis and tilts.

    Keys that are null are derived. Half of the mean radial stiffness at either end of
    ``shaft.span_mm`` gives the tilt stiffness k span^2 / 4; the axial stiffness is ``AXIAL_SHARE``
    of it. Dampers have the ratio of damping to stiffness of the radial ones. A uniform disc of
    the gear's mass, inertia and face width has the tilt inertia J / 2 + m b^2 / 12.

    Raises
    ------
    ConfigError    if neither support nor shaft determine the stiffness
    """
    given, support = values["support"], body.support
    radial = 0.5 * (support.stiffness_x + support.stiffness_y)
    damping = 0.5 * (support.damping_x + support.damping_y)
    if not radial > 0.0:
        raise ConfigError(
            f"gear.{gear.name}.support: a helical pair needs a radial stiffness above 0 on its "
            "bearings"
        )
    if given.get("stiffness_z_n_per_m") is None:
        support = replace(support, stiffness_z=AXIAL_SHARE * radial)
    if given.get("stiffness_tilt_nm_per_rad") is None:
        shaft = values.get("shaft")
        if not isinstance(shaft, Mapping):
            raise ConfigError(
                f"gear.{gear.name}.support.stiffness_tilt_nm_per_rad = null is derived from "
                "shaft.span_mm; give either"
            )
        tilt = 0.25 * radial * to_si("span_mm", shaft["span_mm"]) ** 2
        support = replace(support, stiffness_tilt=tilt)
    if given.get("damping_z_ns_per_m") is None:
        axial = support.stiffness_z * damping / radial
        support = replace(support, damping_z=axial)
    if given.get("damping_tilt_nms_per_rad") is None:
        tilt = support.stiffness_tilt * damping / radial
        support = replace(support, damping_tilt=tilt)
    tilt_inertia = 0.5 * body.inertia + body.mass * gear.face_width**2 / 12.0
    return replace(body, support=support, tilt_inertia=tilt_inertia)


def in_gearbox(body: Body, gearbox: Gearbox, axes: slice, quality: Quality) -> Body:
    """A gear on its support in one gearbox.

    ``axes`` are the indices of its x and y among the four supports. Stiffness scatters about its
    nominal value; axial and tilt stiffness by the geometric mean of both radial factors. So does
    damping, unless ``quality`` has a range of damping ratios: then the ratio is the gearbox's, and
    without one the middle of the range.
    """
    support = body.support
    stiffness, damping = gearbox.stiffness_factor[axes], gearbox.damping_factor[axes]
    stiffer = float(np.sqrt(stiffness.prod()))
    more_damped = float(np.sqrt(damping.prod()))
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
    if quality.support_damping_ratio is not None:
        ratio = np.full(2, quality.support_damping_ratio)
        if gearbox.damping_ratio is not None:
            ratio = gearbox.damping_ratio[axes]
        scattered = scattered.damped(body, float(ratio[0]), float(ratio[1]))
    return replace(body, support=scattered)


def supports_in_gearbox(
    bodies: Mapping[str, Body], gearbox: Gearbox, quality: Quality
) -> dict[str, Support]:
    """Supports of all gears of a machine in one gearbox, by name.

    ``bodies`` are in the order of ``Machine.gears``. Gears for which the gearbox has no factors
    are nominal.
    """
    n_missing = 2 * len(bodies) - len(gearbox.stiffness_factor)
    if n_missing > 0:
        gearbox = _with_nominal_supports(gearbox, quality, n_missing)
    return {
        name: in_gearbox(body, gearbox, slice(2 * k, 2 * k + 2), quality).support
        for k, (name, body) in enumerate(bodies.items())
    }


def _with_nominal_supports(gearbox: Gearbox, quality: Quality, n: int) -> Gearbox:
    """The gearbox with ``n`` further supports without scatter."""
    ratio = gearbox.damping_ratio
    if ratio is not None:
        ratio = np.append(ratio, np.full(n, quality.support_damping_ratio))
    return replace(
        gearbox,
        stiffness_factor=np.append(gearbox.stiffness_factor, np.ones(n)),
        damping_factor=np.append(gearbox.damping_factor, np.ones(n)),
        damping_ratio=ratio,
    )
