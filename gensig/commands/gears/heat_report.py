"""What ``gensig stiffness`` tells of hot gears: temperatures, and stiffness effect by effect."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gensig.options.configuration import Configuration
from gensig.systems.hot_pair import (
    APPARENT,
    COLD,
    CONTACT_RATIO,
    SOFTENED,
    TRUE,
    Duty,
    HotState,
    Variant,
    flash_skin_growth,
    hot_state,
    stiffness_variants,
)
from gensig.systems.registry import read_duty

NAMES = {
    COLD: "cold",
    TRUE: "true stiffness",
    CONTACT_RATIO: "with contact-ratio change",
    APPARENT: "apparent",
    SOFTENED: "with E(T)",
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeatReport:
    """A pair at work, how hot it is and how stiff."""

    duty: Duty
    state: HotState
    variants: dict[str, Variant]


def heat_report(config: Configuration) -> HeatReport | None:
    """Temperatures and stiffness of a configuration's pair; None where nothing is hot."""
    duty = read_duty(config)
    if not duty.heat.is_any:
        return None
    state = hot_state(duty)
    return HeatReport(duty=duty, state=state, variants=stiffness_variants(duty, state))


def heat_content(report: HeatReport) -> dict[str, Any]:
    """The key ``heat`` of ``gensig stiffness --json``."""
    duty, state, pair = report.duty, report.state, report.duty.system.pair
    pinion_strain, wheel_strain = state.growth.pitch_strains(pair)
    housing = duty.heat.expansion * (
        duty.heat.housing_temperature - duty.heat.reference_temperature
    )
    return {
        "friction_heat_w": state.friction_heat,
        "bulk": {
            name: {
                "radius_mm": (body.radius * 1e3).tolist(),
                "temperature_degc": body.temperature.tolist(),
                "tooth_temperature_degc": body.tooth,
                "heat_w": body.input,
                "heat_to_oil_w": body.to_oil,
                "heat_to_bore_w": body.to_bore,
            }
            for name, body in (("pinion", state.pinion), ("wheel", state.wheel))
        },
        "flash_contact_position": (state.flash_position / pair.base_pitch).tolist(),
        "flash_temperature_k": state.flash.tolist(),
        "flash_skin_growth_um": flash_skin_growth(duty, state) * 1e6,
        "base_pitch_difference_um": (pinion_strain - wheel_strain)
        * pair.base_pitch
        * 1e6,
        "backlash_taken_um": state.growth.closing(pair, housing) * 1e6,
        "tooth_growth_um": state.growth.teeth_alone(pair) * 1e6,
        "variants": {
            name: _variant_content(variant) for name, variant in report.variants.items()
        },
    }


def _variant_content(variant: Variant) -> dict[str, Any]:
    return {
        "transverse_contact_ratio": variant.transverse_contact_ratio,
        "mesh_stiffness_mean_n_per_m": float(variant.mesh.mean()),
        "mesh_stiffness_n_per_m": variant.mesh.tolist(),
        "approach_mean_um": float(variant.approach.mean()) * 1e6,
        "contact_position": variant.position.tolist(),
        "single_pair_stiffness_n_per_m": variant.single.tolist(),
        "single_pair_highest_n_per_m": float(variant.single.max()),
    }


def print_heat(report: HeatReport) -> None:
    """The summary on the terminal."""
    state = report.state
    print(f"friction heat              {state.friction_heat / 1e3:.3f} kW")
    for name, body in (("pinion", state.pinion), ("wheel", state.wheel)):
        print(
            f"{name + ', bore to teeth':<27}{body.temperature[0]:.1f} .. {body.tooth:.1f} degrees Celsius"
        )
    print(
        f"flash temperature          up to {state.flash.max():.1f} K above the teeth's"
    )
    cold = report.variants[COLD]
    print(f"{'':<27}{'contact ratio':>13}{'mesh, mean':>18}{'single, highest':>28}")
    for key, name in NAMES.items():
        if key in report.variants:
            print(f"{name:<27}{_variant_line(report.variants[key], cold)}")
    thermal = state.growth.teeth_alone(report.duty.system.pair)
    if APPARENT in report.variants:
        print(
            f"{'':<27}apparent: force over the approach less {thermal * 1e6:.1f} um of tooth growth; no stiffness"
        )
    elif report.duty.heat.growth:
        print(f"{NAMES[APPARENT]:<27}none: teeth grow {thermal * 1e6:.1f} um, more than the approach of "
              f"{cold.approach.mean() * 1e6:.1f} um")  # fmt: skip


def _variant_line(variant: Variant, cold: Variant) -> str:
    mesh, single = float(variant.mesh.mean()), float(np.max(variant.single))
    changes = [
        100.0 * (value / float(of) - 1.0)
        for value, of in ((mesh, cold.mesh.mean()), (single, cold.single.max()))
    ]
    return (
        f"{variant.transverse_contact_ratio:>13.4f}{mesh:>14.4e} N/m {changes[0]:>+8.2f} %"
        f"{single:>14.4e} N/m {changes[1]:>+8.2f} %"
    )
