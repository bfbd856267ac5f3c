"""Wear of a configuration's gears: mesh, wear law, and the worn flanks as a fault."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.faults.registry import read_faults
from gensig.life.options import WearOptions, read_wear_options
from gensig.life.wear.wear_case import WearCase, wear_case
from gensig.options.configuration import Configuration
from gensig.systems.registry import SIDES, read_sliced_pair
from gensig.systems.sliced_pair import SlicedPair

OF_PAIR = {side: side for side in SIDES}
N_PROFILE = 65  # depths along the flank in a fault of kind wear


def read_wear_case(config: Configuration) -> WearCase:
    """Build the wear of a spur or helical pair from the boundary keys of a configuration.

    Raises
    ------
    ConfigError    for faulty gears, and as ``wear_case`` raises
    """
    if read_faults(config["fault"]):
        raise ConfigError(
            f"fault={config['fault']['kind']}: a life begins with healthy flanks; "
            "take fault=healthy"
        )
    return flank_wear(
        read_sliced_pair(config), read_wear_options(config.section("wear"))
    )


def flank_wear(flanks: SlicedPair, options: WearOptions) -> WearCase:
    """Wear of healthy flanks under their torque; errors as ``wear_case`` raises."""
    # all slices of plain spur teeth are alike
    if flanks.pair.pinion.helix_angle == 0.0 and not flanks.modification.is_any:
        flanks = replace(flanks, slices=replace(flanks.slices, n_slices=1))
    return wear_case(flanks.sliced_mesh(), flanks.material, options, flanks.torque)


def wear_fault(
    case: WearCase, depth: Array, gears: Mapping[str, str] = OF_PAIR
) -> dict[str, Any]:
    """A compound fault option with the wear of both gears' teeth after a life.

    Parameters
    ----------
    depth : (2, slice, node) m    off both flanks; the mean over the slices counts, as a fault of
        kind wear is the same across the face
    gears : names of the gears that are worn, by their sides of the mesh

    Depths normal to the flank become those along the transverse line of action, over cos(beta_b).
    """
    slant = np.cos(case.pair.base_helix_angle)
    parts = []
    for side, name in enumerate(SIDES):
        if name not in gears:
            continue
        profile = flank_profile(case, side, depth[side].mean(axis=0) / slant)
        greatest = float(profile.max())
        shape = np.zeros_like(profile)
        if greatest > 0.0:
            shape = profile / greatest
        parts.append(
            {
                "kind": "wear",
                "gear": gears[name],
                "tooth": "all",
                "wear_depth_um": round(greatest * 1e6, 6),
                "wear_profile": [round(float(share), 6) for share in shape],
                "limit_um": max(case.options.threshold * 1e6, greatest * 1e6),
            }
        )
    return {"kind": "compound", "parts": parts, "vary": {}}


def flank_profile(
    case: WearCase, side: int, depth: Array, n_profile: int = N_PROFILE
) -> Array:
    """Depth at evenly spaced curvature radii from the end of the involute to the tip, (profile,) m.

    Parameters
    ----------
    side : 0 pinion, 1 wheel
    depth : (node,) m    at the nodes of the path; the flank below is out of the mate's reach and
        not worn
    """
    gear = (case.pair.pinion, case.pair.wheel)[side]
    tip = np.sqrt(gear.tip_radius**2 - gear.base_radius**2)
    radii = np.linspace(gear.junction_curvature_radius, tip, n_profile)
    curvature = case.path.curvature[side]
    order = np.argsort(curvature)
    return np.interp(radii, curvature[order], depth[order], left=0.0)
