"""Hot gears in ``gensig stiffness``: temperatures, and stiffness effect by effect."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from gensig.mesh.thermal.body_heat import BodyHeat
from gensig.systems.hot_pair import (
    APPARENT,
    COLD,
    CONTACT_RATIO,
    PAPER,
    PAPER_COLD,
    PAPER_COLD_SUMS,
    PAPER_HOUSED,
    PAPER_SUMS,
    SOFTENED,
    TRUE,
    Duty,
    HotState,
    Variant,
    compared,
    flash_skin_growth,
    hot_state,
    stiffness_variants,
)

NAMES = {
    COLD: "cold",
    TRUE: "true stiffness",
    CONTACT_RATIO: "with contact-ratio change",
    APPARENT: "apparent",
    SOFTENED: "with E(T)",
    PAPER_COLD: "the paper's, cold",
    PAPER: "the paper's, hot",
    PAPER_HOUSED: "and contact-ratio change",
    PAPER_COLD_SUMS: "eq. (14), cold",
    PAPER_SUMS: "eq. (14), hot",
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeatReport:
    """Temperatures of a pair at work, and its stiffness with each effect of heat."""

    duty: Duty
    state: HotState
    variants: dict[str, Variant]


def heat_report(duty: Duty) -> HeatReport | None:
    """Temperatures and stiffness of a pair at work; None where nothing is hot."""
    if not duty.heat.is_any:
        return None
    state = hot_state(duty)
    return HeatReport(duty=duty, state=state, variants=stiffness_variants(duty, state))


def bodies(state: HotState) -> dict[str, BodyHeat]:
    """Heat of both gears."""
    return {"pinion": state.pinion, "wheel": state.wheel}


def heat_content(report: HeatReport) -> dict[str, Any]:
    """The key ``heat`` of ``gensig stiffness --json``."""
    duty, state, pair = report.duty, report.state, report.duty.system.pair
    heat, growth = duty.heat, state.growth
    pinion_strain, wheel_strain = growth.pitch_strains(pair)
    difference = (pinion_strain - wheel_strain) * pair.base_pitch
    housing = heat.expansion * (heat.housing_temperature - heat.reference_temperature)
    return {
        "friction_heat_w": state.friction_heat,
        "bulk": {
            name: {
                "radius_mm": body.radius * 1e3,
                "temperature_degc": body.temperature,
                "tooth_temperature_degc": body.tooth,
                "heat_w": body.input,
                "heat_to_oil_w": body.to_oil,
                "heat_to_bore_w": body.to_bore,
            }
            for name, body in bodies(state).items()
        },
        "flash_contact_position": state.flash_position / pair.base_pitch,
        "flash_temperature_k": state.flash,
        "flash_skin_growth_um": flash_skin_growth(duty, state) * 1e6,
        "base_pitch_difference_um": difference * 1e6,
        "backlash_taken_um": growth.closing(pair, housing) * 1e6,
        "tooth_growth_um": growth.teeth_alone(pair) * 1e6,
        "variants": {
            name: {
                "transverse_contact_ratio": variant.transverse_contact_ratio,
                "mesh_stiffness_mean_n_per_m": variant.mesh.mean(),
                "mesh_stiffness_n_per_m": variant.mesh,
                "approach_mean_um": variant.approach.mean() * 1e6,
                "contact_position": variant.position,
                "single_pair_stiffness_n_per_m": variant.single,
                "single_pair_highest_n_per_m": variant.single.max(),
            }
            for name, variant in report.variants.items()
        },
    }


def heat_lines(report: HeatReport) -> Iterator[str]:
    """Friction heat, temperatures, and stiffness effect by effect, in lines."""
    state, variants = report.state, report.variants
    yield f"friction heat              {state.friction_heat / 1e3:.3f} kW"
    for name, body in bodies(state).items():
        temperatures = f"{body.temperature[0]:.1f} .. {body.tooth:.1f}"
        yield f"{name + ', bore to teeth':<27}{temperatures} degrees Celsius"
    flash = state.flash.max()
    yield f"flash temperature          up to {flash:.1f} K above the teeth's"
    yield f"{'':<27}{'contact ratio':>13}{'mesh, mean':>18}{'single, highest':>28}"
    for key, name in NAMES.items():
        if key in variants:
            line = _variant_line(variants[key], compared(variants, key))
            yield f"{name:<27}{line}"
    growth = f"{state.growth.teeth_alone(report.duty.system.pair) * 1e6:.1f} um"
    if APPARENT in variants:
        text = f"force over the approach less {growth} of tooth growth; no stiffness"
        yield f"{'':<27}apparent: {text}"
    elif report.duty.heat.growth:
        approach = variants[COLD].approach.mean() * 1e6
        text = f"teeth grow {growth}, more than the approach of {approach:.1f} um"
        yield f"{NAMES[APPARENT]:<27}none: {text}"


def _variant_line(variant: Variant, cold: Variant) -> str:
    mesh, single = variant.mesh.mean(), variant.single.max()
    mesh_change = 100.0 * (mesh / cold.mesh.mean() - 1.0)
    single_change = 100.0 * (single / cold.single.max() - 1.0)
    return (
        f"{variant.transverse_contact_ratio:>13.4f}"
        f"{mesh:>14.4e} N/m {mesh_change:>+8.2f} %"
        f"{single:>14.4e} N/m {single_change:>+8.2f} %"
    )
