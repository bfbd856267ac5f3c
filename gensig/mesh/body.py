"""Compliance of the gear body under a loaded tooth."""

from __future__ import annotations

import warnings

from gensig.arrays import Array
from gensig.errors import ExtrapolationError
from gensig.geometry.gear import Gear
from gensig.material import Material
from gensig.mesh.body_coupling import cross_compliance
from gensig.mesh.fillet_foundation import (
    ExtrapolationWarning,
    fillet_foundation_compliance,
)
from gensig.mesh.options import MeshOptions

# rim thickness over module: checked against finite elements down to 2, in one case at 1.75
CHECKED_RIM, THINNEST_RIM = 2.0, 1.5


def body_compliance(
    gear: Gear, load_angle: Array, material: Material, options: MeshOptions
) -> Array:
    """Compliance along the line of action of the body under one loaded tooth, (phase,) m/N.

    Raises
    ------
    ExtrapolationError    for a bore outside the range on which the model was checked, unless
        allowed
    """
    if options.body == "sainsot":
        return fillet_foundation_compliance(
            gear, load_angle, material, allow_extrapolation=options.allow_extrapolation
        )
    check_rim(gear, options)
    return cross_compliance(gear, material, load_angle, load_angle, pitches=0)


def check_rim(gear: Gear, options: MeshOptions) -> None:
    """Raise ExtrapolationError, or warn, for a rim too thin for the elastic ring."""
    rim = (gear.root_radius - gear.bore_radius) / gear.normal_module
    if rim < THINNEST_RIM and not options.allow_extrapolation:
        raise ExtrapolationError(
            f"{gear.name}: the rim between bore and root is {rim:.3g} modules thick, below the "
            f"{THINNEST_RIM:g} for which the elastic ring holds; reduce bore_radius_mm, or set "
            "mesh.allow_extrapolation=true"
        )
    if rim < CHECKED_RIM:
        warnings.warn(
            f"{gear.name}: the rim between bore and root is {rim:.3g} modules thick; the elastic "
            f"ring was checked down to {CHECKED_RIM:g}",
            ExtrapolationWarning,
            stacklevel=5,
        )
