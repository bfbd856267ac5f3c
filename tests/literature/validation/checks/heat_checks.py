"""Quantities of hot pairs, by the names that the rows use."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from gensig.mesh.thermal.body_heat import BodyHeat, face_surface, tooth_surface
from gensig.mesh.thermal.heat import flash_temperature
from gensig.mesh.thermal.paper_growth import READINGS, gear_growth, no_growth
from gensig.options.compose import compose
from gensig.systems.hot_pair import (
    COLD,
    TRUE,
    Duty,
    HotState,
    Variant,
    compared,
    hot_state,
    stiffness_variants,
    sweep,
)
from gensig.systems.registry import PairParts
from validation.rows import printed_value

HotCheck = Callable[["HotCase", str], float]

# range of each sweep of the thermal paper, SI
SWEEPS = {
    "friction": (0.03, 0.07),
    "torque": (12e3, 36e3),
    "speed": (125.66370614359172, 628.3185307179587),
}


@dataclass(frozen=True, eq=False)
class HotCase:
    """One pair at work; the same overrides always give the same object."""

    duty: Duty

    @cached_property
    def state(self) -> HotState:
        """Temperatures."""
        return hot_state(self.duty)

    @cached_property
    def variants(self) -> dict[str, Variant]:
        """Stiffness with the effects that the row's overrides leave on."""
        return stiffness_variants(self.duty, self.state)


@lru_cache(maxsize=64)
def read_hot_case(overrides: tuple[str, ...]) -> HotCase:
    """Compose the pair of a row."""
    return HotCase(duty=PairParts(compose("generate", overrides)).duty)


def _mesh(case: HotCase, at: str) -> float:
    return float(case.variants[at].mesh.mean())


def _single(case: HotCase, at: str) -> float:
    return float(case.variants[at].single.max())


def _mesh_change(case: HotCase, at: str) -> float:
    cold = compared(case.variants, at)
    return _mesh(case, at) / float(cold.mesh.mean()) - 1.0


def _single_change(case: HotCase, at: str) -> float:
    cold = compared(case.variants, at)
    return _single(case, at) / float(cold.single.max()) - 1.0


def _uniform_change(case: HotCase, at: str) -> float:
    """Change of the mean stiffness by the paper's equations where both gears are ``at`` K hotter.

    There is no flash.
    """
    system, rise = case.duty.system, float(at)
    name = system.mesh.heat_law
    sides = {
        side: gear_growth(
            gear,
            READINGS[name],
            bore_rise=rise,
            tooth_rise=rise,
            expansion=case.duty.heat.expansion,
            poisson_ratio=system.material.poisson_ratio,
        )
        for side, gear in system.pair.gears.items()
    }
    hot, cold = (
        replace(system, hot_teeth=growth).transmission_error().contact.stiffness.mean()
        for growth in (replace(no_growth(name), **sides), no_growth(name))
    )
    return float(hot / cold) - 1.0


def _contact_ratio_change(case: HotCase, at: str) -> float:
    return (
        case.variants[at].transverse_contact_ratio
        / case.variants[COLD].transverse_contact_ratio
        - 1.0
    )


def _even_flash(case: HotCase, at: str) -> float:
    """Flash temperature at the start, the pitch point or the end of the path under an even load."""
    system = case.duty.system
    place = {
        "start": 0.0,
        "pitch": system.pair.pitch_point,
        "end": system.pair.path_of_contact,
    }[at]
    even = system.mesh_force / (
        system.pair.face_width * system.pair.transverse_contact_ratio
    )
    rise = flash_temperature(
        system.pair,
        np.array([place]),
        even,
        system.material,
        case.duty.heat,
        friction=case.duty.friction,
        speed=case.duty.speed,
    )
    return float(rise[0])


def _surface_rise(case: HotCase, at: str) -> float:
    """Rise above the oil of the surfaces that it cools, mean over them.

    Heat over convection x surface.
    """
    gear = getattr(case.duty.system.pair, at)
    body: BodyHeat = getattr(case.state, at)
    heat = case.duty.heat.at_speed(case.duty.speed)
    return body.to_oil / (
        heat.face_convection * face_surface(gear)
        + heat.tooth_convection * tooth_surface(gear)
    )


def _teeth_per_kelvin(case: HotCase, at: str) -> float:
    """Distance by which the growth of the teeth moves the gears apart, for 1 K of both."""
    rise = case.state.pinion.tooth - case.duty.heat.reference_temperature
    return case.state.growth.teeth_alone(case.duty.system.pair) / rise


def _rise_for_printed(case: HotCase, at: str) -> float:
    """Rise of both gears at which the apparent stiffness is above the cold one by as much as is
    printed.
    """
    printed = [
        printed_value("helical_heat_paper", f"{name}.reference_root")
        for name in ("cold.mesh_mean", "hot.mesh_mean")
    ]
    needed = float(case.variants[COLD].approach.mean()) * (
        1.0 - printed[0] / printed[1]
    )
    return needed / _teeth_per_kelvin(case, at)


def _sweep_change(case: HotCase, at: str) -> float:
    """Change of the mean stiffness ``at`` from the first to the last value of a sweep."""
    variant, name = at.split(":")
    first, last = (
        float(one[variant].mesh.mean()) for one in sweep(case.duty, name, SWEEPS[name])
    )
    return last / first - 1.0


def _torque_over_others(case: HotCase, at: str) -> float:
    """Change over the torque's sweep, over the larger of the other two."""
    change = {name: abs(_sweep_change(case, f"{at}:{name}")) for name in SWEEPS}
    return change["torque"] / max(change["friction"], change["speed"])


def _mean_single_difference(case: HotCase, at: str) -> float:
    """Mean difference of the single-pair curve to that of gensig's own mesh, over the latter,
    along one pair's way.
    """
    ours = read_hot_case(
        ("system=helical_pair", "gear=chongqing_40_162", "heat=chongqing_rated")
    )
    curves = [one.variants[TRUE] for one in (case, ours)]
    place = np.linspace(0.0, 1.0, 201)[1:-1]
    analytic, best = (
        np.interp(place, one.position / one.position[-1], one.single) for one in curves
    )
    return float(np.mean(np.abs(best - analytic)) / np.mean(best))


HOT: dict[str, HotCheck] = {
    "heat.friction_heat": lambda case, at: case.state.friction_heat,
    "heat.even_flash": _even_flash,
    "heat.largest_flash": lambda case, at: float(case.state.flash.max()),
    "heat.tooth_rise": lambda case, at: (
        getattr(case.state, at).tooth - case.duty.heat.oil_temperature
    ),
    "heat.bore_rise": lambda case, at: (
        float(getattr(case.state, at).temperature[0]) - case.duty.heat.oil_temperature
    ),
    "heat.surface_rise": _surface_rise,
    "heat.mesh_stiffness": _mesh,
    "heat.single_pair_stiffness": _single,
    "heat.mesh_change": _mesh_change,
    "heat.single_change": _single_change,
    "heat.uniform_change": _uniform_change,
    "heat.contact_ratio_change": _contact_ratio_change,
    "heat.teeth_per_kelvin": _teeth_per_kelvin,
    "heat.rise_for_printed": _rise_for_printed,
    "heat.sweep_change": _sweep_change,
    "heat.torque_over_others": _torque_over_others,
    "heat.mean_single_difference": _mean_single_difference,
}
