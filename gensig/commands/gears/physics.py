"""``gensig stiffness``: mesh stiffness of a gear pair."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator
from typing import Any

import numpy as np

from gensig.commands.console import remark
from gensig.commands.figures.machine_figures import stiffness_figure
from gensig.commands.figures.panels import Figure
from gensig.commands.output import Answer, answered, highest, span
from gensig.faults.registry import read_faults
from gensig.options.configuration import Configuration
from gensig.record.machines import read_machine
from gensig.systems.base import Machine
from gensig.systems.pair_machine import GearPairMachine
from gensig.systems.registry import SLICED, PairParts
from gensig.systems.stiffness_curves import StiffnessCurves

PAPER_KIND = "sum of pair stiffnesses (secant)"
TANGENT_KIND = "tangent dF/d(approach) at static equilibrium"


@answered()
def stiffness(config: Configuration, _: Namespace) -> Answer:
    """Mesh stiffness over the mesh of healthy and faulty teeth."""
    if config["system"].get("kind") == SLICED:
        from gensig.commands.gears.flanks import sliced_stiffness

        return sliced_stiffness(PairParts(config), config["fault"])
    system = read_machine(config)
    faults = read_faults(config["fault"])
    curves = system.stiffness_curves(faults)
    ratio = system.pair.transverse_contact_ratio
    if ratio < 1.0:
        remark(
            f"WARNING: the transverse contact ratio {ratio:.4f} is below 1: the "
            "drive is interrupted at every tooth; these curves are quasi-static"
        )
    content = stiffness_content(system, curves)

    def figure() -> Figure:
        sound = curves
        if faults:
            sound = system.stiffness_curves()
        return stiffness_figure(system, curves, faults, sound)

    return Answer(content, _lines(content, curves), figure)


def stiffness_content(system: Machine, curves: StiffnessCurves) -> dict[str, Any]:
    """The keys of ``gensig stiffness --json``."""
    table = system.mesh_table()
    ratio, is_paper = system.pair.transverse_contact_ratio, system.mesh.law == "paper"
    content: dict[str, Any] = {
        "transverse_contact_ratio": ratio,
        "base_pitch_mm": system.pair.base_pitch * 1e3,
        "contact_position": curves.contact_position,
        "single_pair_stiffness_n_per_m": curves.single_pair_stiffness,
        "roll_angle_deg": np.degrees(curves.roll_angle),
        "mesh_stiffness_n_per_m": curves.mesh_stiffness,
        "mesh_stiffness_mean_n_per_m": curves.mesh_stiffness.mean(),
        "mesh_stiffness_kind": (TANGENT_KIND, PAPER_KIND)[is_paper],
        "compliance_m_per_n": curves.compliance,
        "shared_body_compliance_m_per_n": table.shared_compliance,
    }
    has_relief = not is_paper and 1.0 <= ratio < 2.0
    if isinstance(system, GearPairMachine) and has_relief:
        relief = system.long_relief()
        content["long_tip_relief"] = {
            name: {
                "tip_relief_um": side.tip_relief * 1e6,
                "tip_relief_height_mm": side.tip_relief_height * 1e3,
            }
            for name, side in (("pinion", relief.pinion), ("wheel", relief.wheel))
        }
    if curves.faulty_pair_stiffness is not None and curves.faulty_pair_gap is not None:
        content["faulty_pair_stiffness_n_per_m"] = curves.faulty_pair_stiffness
        content["faulty_pair_gap_um"] = curves.faulty_pair_gap * 1e6
    return content


def _lines(content: dict[str, Any], curves: StiffnessCurves) -> Iterator[str]:
    mesh, single = curves.mesh_stiffness, curves.single_pair_stiffness
    faulty = curves.faulty_pair_stiffness
    yield f"transverse contact ratio   {content['transverse_contact_ratio']:.5f}"
    yield f"base pitch                 {content['base_pitch_mm']:.5f} mm"
    yield f"mesh stiffness, mean       {mesh.mean():.4e} N/m"
    yield f"mesh stiffness, range      {mesh.min():.4e} .. {mesh.max():.4e} N/m"
    yield f"single pair, highest       {highest(single, faulty)}"
    if "long_tip_relief" in content:
        sides = ", ".join(
            f"{name} {side['tip_relief_um']:.2f} um "
            f"over {side['tip_relief_height_mm']:.2f} mm"
            for name, side in content["long_tip_relief"].items()
        )
        yield f"tip relief for this torque {sides} of height"
    if faulty is not None:
        loss = 1e2 * (1.0 - faulty / single)
        yield f"faulty pair loses          {span(loss, '.2f')} %"
        gap = span(content["faulty_pair_gap_um"], ".3g")
        yield f"faulty pair touches later  {gap} um"
