"""The verb on the strength of teeth: root-stress."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from gensig.commands.output import check_outputs, write_outputs
from gensig.commands.request import read_configuration
from gensig.errors import ConfigError
from gensig.faults.registry import read_faults
from gensig.life.root.strength import reliability
from gensig.systems.root_strength import (
    GearStress,
    RootHistory,
    RootStrength,
    read_root_strength,
)


def root_stress(arguments: Namespace) -> int:
    """Root stress over the mesh, at ISO's load point, and safety factors.

    JSON, a figure, or a summary.
    """
    check_outputs(arguments)
    config = read_configuration(arguments)
    if read_faults(config["fault"]):
        raise ConfigError(
            f"fault={config['fault']['kind']}: root stress is that of sound teeth here; take fault=healthy, and gensig "
            f"stiffness for what faults do to the mesh"
        )
    system = read_root_strength(config)
    if arguments.stress is not None:
        system = system.under(arguments.stress * 1e6)
    gears, history = system.gears(), system.history()
    content = root_stress_content(system, gears, history)
    if arguments.stress is not None:
        content["tangential_force_over_mesh_n"] = system.force_over_mesh_for(
            arguments.stress * 1e6
        )

    def draw(path: Path) -> None:
        from gensig.commands.figures.strength_figure import plot_root_stress

        plot_root_stress(system, gears, history, path)

    write_outputs(arguments, content, draw)
    _print(system, gears, content)
    return 0


def root_stress_content(
    system: RootStrength, gears: dict[str, GearStress], history: RootHistory
) -> dict[str, Any]:
    """The keys of ``gensig root-stress --json``.

    At the top those of the gear with the higher stress.
    """
    pair, strength = system.pair, system.strength
    by_gear = {name: _gear_content(gears[name], history.stress[name]) for name in gears}
    return {
        "decisive_gear": system.decisive,
        "tangential_force_n": system.tangential_force,
        "normal_force_n": system.flanks.mesh_force,
        "torque_nm": system.flanks.torque,
        "load_point": strength.load_point,
        "edition": strength.edition,
        **by_gear[system.decisive],
        "roll_angle_deg": np.degrees(history.roll / pair.pinion.base_radius).tolist(),
        "load_share": history.share.tolist(),
        "transverse_contact_ratio": pair.transverse_contact_ratio,
        "overlap_ratio": pair.overlap_ratio,
        "strength": {"bending_limit_mpa": strength.bending_limit * 1e-6}
        | {
            key: value
            for key, value in asdict(strength).items()
            if key != "bending_limit"
        },
        "gears": by_gear,
    }


def _gear_content(gear: GearStress, stress: np.ndarray[Any, Any]) -> dict[str, Any]:
    factors, safety = gear.factors, gear.safety
    return {
        "root_stress_mpa": (stress * 1e-6).tolist(),
        "largest_root_stress_mpa": float(stress.max()) * 1e-6,
        "nominal_root_stress_mpa": gear.nominal * 1e-6,
        "iso_root_stress_mpa": gear.stress * 1e-6,
        "form_factor": factors.form_factor,
        "stress_correction_factor": factors.stress_correction_factor,
        "load_distribution_factor": factors.load_distribution_factor,
        "contact_ratio_factor": factors.contact_ratio_factor,
        "helix_factor": factors.helix_factor,
        "rim_thickness_factor": factors.rim_thickness_factor,
        "deep_tooth_factor": factors.deep_tooth_factor,
        "root_width_mm": factors.width * 1e3,
        "notch_parameter": factors.notch_parameter,
        "safety_factor_paper": safety.paper,
        "reliability_paper": reliability(safety.paper),
        "safety_factor_iso": safety.iso,
        "reliability_iso": reliability(safety.iso),
        "life_factor": safety.life_factor,
        "relative_notch_sensitivity": safety.relative_notch_sensitivity,
        "size_factor": safety.size_factor,
    }


def _print(
    system: RootStrength, gears: dict[str, GearStress], content: dict[str, Any]
) -> None:
    strength = system.strength
    print(
        f"tangential force           {content['tangential_force_n']:.1f} N, {content['torque_nm']:.2f} N m"
    )
    if "tangential_force_over_mesh_n" in content:
        print(
            f"over the mesh it takes     {content['tangential_force_over_mesh_n']:.1f} N"
        )
    print(
        f"load point                 {strength.load_point.replace('_', ' ')}, ISO 6336-3:{strength.edition}"
    )
    heads = "".join(f"{name:>16}" for name in gears)
    print(f"{'':<27}{heads}")
    for label, key, form in (
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
    ):
        cells = "".join(f"{content['gears'][name][key]:>16{form}}" for name in gears)
        print(f"{label:<27}{cells}")
    print(
        f"strength {strength.name}: sigma_Flim {strength.bending_limit * 1e-6:g} MPa, K_FN "
        f"{strength.paper_life_factor:g}, Y_ST {strength.test_gear_stress_correction:g}, Y_NT "
        f"{content['life_factor']:.3f}, Y_delta {content['relative_notch_sensitivity']:.3f}, Y_R "
        f"{strength.relative_surface_factor:g}, Y_X {content['size_factor']:g}, Y_M {strength.mean_stress_factor:g}"
    )
    print(
        f"load factors: K_A {strength.application_factor:g}, K_gamma {strength.mesh_load_factor:g}, K_v "
        f"{strength.dynamic_factor:g}, K_F_beta {strength.face_load_factor:g}, K_F_alpha "
        f"{strength.transverse_load_factor:g}"
    )
