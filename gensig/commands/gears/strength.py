"""``gensig root-stress``: bending stress at the tooth root, and safety factors."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.commands.figures.strength_figure import root_stress_figure
from gensig.commands.output import Answer, answered
from gensig.errors import ConfigError
from gensig.faults.registry import read_faults
from gensig.life.root.strength import reliability
from gensig.options.configuration import Configuration
from gensig.systems.root_strength import (
    GearStress,
    RootHistory,
    RootStrength,
    read_root_strength,
)

FACTORS = (
    "form_factor",
    "stress_correction_factor",
    "load_distribution_factor",
    "contact_ratio_factor",
    "helix_factor",
    "rim_thickness_factor",
    "deep_tooth_factor",
)
SAFETY_FACTORS = ("life_factor", "relative_notch_sensitivity", "size_factor")
# label, JSON key of a gear, format
ROWS = (
    ("form factor Y_F", "form_factor", ".4f"),
    ("stress correction Y_S", "stress_correction_factor", ".4f"),
    ("load distribution f_eps", "load_distribution_factor", ".4f"),
    ("contact ratio Y_eps", "contact_ratio_factor", ".4f"),
    ("helix Y_beta", "helix_factor", ".4f"),
    ("rim thickness Y_B", "rim_thickness_factor", ".4f"),
    ("deep tooth Y_DT", "deep_tooth_factor", ".4f"),
    ("width at the root, mm", "root_width_mm", ".2f"),
    ("nominal stress, MPa", "nominal_root_stress_mpa", ".2f"),
    ("with load factors, MPa", "iso_root_stress_mpa", ".2f"),
    ("largest over the mesh, MPa", "largest_root_stress_mpa", ".2f"),
    ("safety, paper", "safety_factor_paper", ".3f"),
    ("reliability, paper", "reliability_paper", ""),
    ("safety, ISO 6336-3", "safety_factor_iso", ".3f"),
    ("reliability, ISO 6336-3", "reliability_iso", ""),
)


@answered()
def root_stress(config: Configuration, arguments: Namespace) -> Answer:
    """Root stress and safety factors."""
    if read_faults(config["fault"]):
        raise ConfigError(
            f"fault={config['fault']['kind']}: root stress is that of healthy teeth here; "
            "take fault=healthy, and gensig stiffness for what faults do to the mesh"
        )
    system = read_root_strength(config)
    if arguments.stress is not None:
        system = system.with_root_stress(arguments.stress * 1e6)
    gears, history = system.gears(), system.history()
    content = root_stress_content(system, gears, history)
    if arguments.stress is not None:
        force = system.force_over_mesh_for(arguments.stress * 1e6)
        content["tangential_force_over_mesh_n"] = force
    return Answer(
        content,
        _lines(system, content),
        lambda: root_stress_figure(system, gears, history),
    )


def root_stress_content(
    system: RootStrength, gears: dict[str, GearStress], history: RootHistory
) -> dict[str, Any]:
    """The keys of ``gensig root-stress --json``; those of the decisive gear at the top."""
    pair, strength = system.pair, asdict(system.strength)
    by_gear = {
        name: _gear_content(gear, history.stress[name]) for name, gear in gears.items()
    }
    limit = strength.pop("bending_limit") * 1e-6
    return {
        "decisive_gear": system.decisive,
        "tangential_force_n": system.tangential_force,
        "normal_force_n": system.flanks.mesh_force,
        "torque_nm": system.flanks.torque,
        "load_point": strength["load_point"],
        "edition": strength["edition"],
        **by_gear[system.decisive],
        "roll_angle_deg": np.degrees(history.roll / pair.pinion.base_radius),
        "load_share": history.share,
        "transverse_contact_ratio": pair.transverse_contact_ratio,
        "overlap_ratio": pair.overlap_ratio,
        "strength": {"bending_limit_mpa": limit, **strength},
        "gears": by_gear,
    }


def _gear_content(gear: GearStress, stress: Array) -> dict[str, Any]:
    factors, safety = gear.factors, gear.safety
    return {
        "root_stress_mpa": stress * 1e-6,
        "largest_root_stress_mpa": stress.max() * 1e-6,
        "nominal_root_stress_mpa": gear.nominal * 1e-6,
        "iso_root_stress_mpa": gear.stress * 1e-6,
        **{name: getattr(factors, name) for name in FACTORS},
        "root_width_mm": factors.width * 1e3,
        "notch_parameter": factors.notch_parameter,
        "safety_factor_paper": safety.paper,
        "reliability_paper": reliability(safety.paper),
        "safety_factor_iso": safety.iso,
        "reliability_iso": reliability(safety.iso),
        **{name: getattr(safety, name) for name in SAFETY_FACTORS},
    }


def _lines(system: RootStrength, content: dict[str, Any]) -> Iterator[str]:
    strength, gears = system.strength, content["gears"]
    force, torque = content["tangential_force_n"], content["torque_nm"]
    yield f"tangential force           {force:.1f} N, {torque:.2f} N m"
    if "tangential_force_over_mesh_n" in content:
        force = content["tangential_force_over_mesh_n"]
        yield f"over the mesh it takes     {force:.1f} N"
    load_point = strength.load_point.replace("_", " ")
    yield f"load point                 {load_point}, ISO 6336-3:{strength.edition}"
    yield f"{'':<27}" + "".join(f"{name:>16}" for name in gears)
    for label, key, form in ROWS:
        cells = [f"{gear[key]:>16{form}}" for gear in gears.values()]
        yield f"{label:<27}{''.join(cells)}"
    yield (
        f"strength {strength.name}: sigma_Flim {strength.bending_limit * 1e-6:g} MPa, "
        f"K_FN {strength.paper_life_factor:g}, "
        f"Y_ST {strength.test_gear_stress_correction:g}, "
        f"Y_NT {content['life_factor']:.3f}, "
        f"Y_delta {content['relative_notch_sensitivity']:.3f}, "
        f"Y_R {strength.relative_surface_factor:g}, "
        f"Y_X {content['size_factor']:g}, Y_M {strength.mean_stress_factor:g}"
    )
    yield (
        f"load factors: K_A {strength.application_factor:g}, "
        f"K_gamma {strength.mesh_load_factor:g}, K_v {strength.dynamic_factor:g}, "
        f"K_F_beta {strength.face_load_factor:g}, "
        f"K_F_alpha {strength.transverse_load_factor:g}"
    )
