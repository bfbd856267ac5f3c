"""Bending stress at the tooth's root: ISO 6336-3 at its load point, and through the mesh.

Theory, limits and choices: ``docs/theory/root_stress.md``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.errors import GeometryError
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.life.root.tooth_root import root_loading, root_section
from gensig.mesh.sliced.slice_energy import structure_deflection
from gensig.units import check_choice

LOAD_POINTS = ("outer_single_pair", "tip")
EDITIONS = (2019, 2006)
DEEP_TOOTH_RATIOS = (2.05, 2.5)  # of eps_alpha_n, between which Y_DT falls
DEEP_TOOTH_GRADE = 4  # the coarsest ISO 1328 grade whose teeth share the load that well
# of the tooth height: no thinner rims; from the second on the rim does not matter
RIM_SHARES = (0.5, 1.2)
OVERHANG_MODULES = 1.0  # of a wider gear at either end that helps its root


@dataclass(frozen=True, slots=True, kw_only=True)
class RootFactors:
    """Factors of the nominal root stress of one gear, sigma_F0 = F_t / (b m_n) times their product.

    ``width`` b in m, at most one normal module wider than the mate at either end; ``form_factor``
    Y_F (without f_eps), ``stress_correction_factor`` Y_S, ``load_distribution_factor`` f_eps,
    ``contact_ratio_factor`` Y_eps (load at the tip only), ``helix_factor`` Y_beta,
    ``rim_thickness_factor`` Y_B, ``deep_tooth_factor`` Y_DT.
    """

    width: float
    normal_module: float
    form_factor: float
    stress_correction_factor: float
    load_distribution_factor: float
    contact_ratio_factor: float
    helix_factor: float
    rim_thickness_factor: float
    deep_tooth_factor: float
    notch_parameter: float

    @property
    def stress_per_force(self) -> float:
        """Nominal stress over tangential force, Pa/N."""
        factors = (
            self.form_factor,
            self.stress_correction_factor,
            self.load_distribution_factor,
            self.contact_ratio_factor,
            self.helix_factor,
            self.rim_thickness_factor,
            self.deep_tooth_factor,
        )
        return math.prod(factors) / (self.width * self.normal_module)


def normal_contact_ratio(pair: GearPair) -> float:
    """Contact ratio of the virtual spur gears, eps_alpha_n = eps_alpha / cos^2(beta_b)."""
    return pair.transverse_contact_ratio / math.cos(pair.base_helix_angle) ** 2


def root_width(pair: GearPair, gear: Gear) -> float:
    """Width that bears at the root, m: the gear's, at most a module beyond its mate's ends."""
    mate = pair.wheel
    if gear is not pair.pinion:
        mate = pair.pinion
    overhang = 2.0 * OVERHANG_MODULES * gear.normal_module
    return min(gear.face_width, mate.face_width + overhang)


def root_factors(
    pair: GearPair,
    *,
    load_point: str = "outer_single_pair",
    edition: int = 2019,
    grade: float | None = None,
    allow_extrapolation: bool = False,
) -> dict[str, RootFactors]:
    """Factors of both gears, by name.

    Parameters
    ----------
    load_point : ``outer_single_pair`` (Method B of ISO 6336-3) or ``tip``, the whole load there
        times Y_eps
    edition : of ISO 6336-3; 2006 has neither f_eps nor 1 / cos^3(beta) in Y_beta
    grade : of ISO 1328, None for perfect gears; only fine teeth with a high contact ratio have a
        Y_DT below 1

    Raises
    ------
    ConfigError, GeometryError, ExtrapolationError    for unknown choices, too thin a rim, a notch
        out of range

    Source: ISO 6336-3, 6 to 10, external gears; the tip with Y_eps = 0.25 + 0.75 / eps_alpha_n is
    its former Method C (also DIN 3990-3). Y_DT is taken with the edition 2006 only: f_eps of 2019
    already shares the load.
    """
    check_choice("strength.load_point", load_point, LOAD_POINTS)
    check_choice("strength.edition", edition, EDITIONS)
    ratio = normal_contact_ratio(pair)
    distribution = contact_ratio = deep_tooth = 1.0
    tip_distance = 0.0  # in base pitches
    if load_point == "tip":
        contact_ratio = 0.25 + 0.75 / max(ratio, 1.0)
    else:
        tip_distance = ratio - 1.0
        if edition == 2006:
            deep_tooth = deep_tooth_factor(ratio, grade)
        else:
            distribution = load_distribution_factor(pair)
    factors = {}
    for name, gear in pair.gears.items():
        normal_pitch = math.pi * gear.normal_module * math.cos(gear.pressure_angle)
        loading = root_loading(
            gear, normal_pitch * tip_distance, allow_extrapolation=allow_extrapolation
        )
        if not loading.lever_arm[0] > 0.0:
            raise GeometryError(
                f"{name}: the outer point of single pair contact lies below the critical section "
                f"(contact ratio {ratio:.4g}); take strength.load_point=tip"
            )
        factors[name] = RootFactors(
            width=root_width(pair, gear),
            normal_module=gear.normal_module,
            form_factor=float(loading.form_factor[0]),
            stress_correction_factor=float(loading.stress_correction_factor[0]),
            load_distribution_factor=distribution,
            contact_ratio_factor=contact_ratio,
            helix_factor=helix_factor(pair, edition=edition),
            rim_thickness_factor=rim_thickness_factor(gear),
            deep_tooth_factor=deep_tooth,
            notch_parameter=root_section(gear).notch_parameter,
        )
    return factors


def load_distribution_factor(pair: GearPair) -> float:
    """f_eps, the load sharing of the pairs in contact as the overlap grows from 0 to 1.

    Source: ISO 6336-3:2019, 6.2: 1 (0.7 from eps_alpha_n = 2 on) without overlap,
    eps_alpha_n^-0.5 from 1 on.
    """
    ratio, overlap = normal_contact_ratio(pair), min(pair.overlap_ratio, 1.0)
    if overlap == 0.0 and ratio >= 2.0:
        return 0.7
    alone = 1.0
    if ratio >= 2.0:
        alone = 0.5
    return math.sqrt((1.0 - overlap) * alone + overlap / ratio)


def helix_factor(pair: GearPair, *, edition: int) -> float:
    """Y_beta = 1 - eps_beta beta / 120 degrees, over cos^3(beta) from 2019 on.

    The overlap counts up to 1, the helix up to 30 degrees.

    Source: ISO 6336-3, 8.
    """
    helix = min(abs(pair.pinion.helix_angle), math.radians(30.0))
    factor = 1.0 - min(pair.overlap_ratio, 1.0) * math.degrees(helix) / 120.0
    if edition == 2006:
        return factor
    return factor / math.cos(helix) ** 3


def rim_thickness_factor(gear: Gear) -> float:
    """Y_B of the ring between bore and root.

    It is 1 from 1.2 tooth heights on, 1.6 ln(2.242 h_t / s_R) below.

    Source: ISO 6336-3, 9, external gears; no thinner rims than half a tooth height.
    """
    height = gear.tip_radius - gear.root_radius
    rim = gear.root_radius - gear.bore_radius
    least, enough = RIM_SHARES
    if rim <= least * height:
        raise GeometryError(
            f"{gear.name}: the rim between bore and root is {rim * 1e3:.3g} mm, "
            f"{rim / height:.2g} tooth heights; ISO 6336-3 covers more than {least:g}; "
            "reduce bore_radius_mm"
        )
    if rim >= enough * height:
        return 1.0
    return 1.6 * math.log(2.242 * height / rim)


def deep_tooth_factor(ratio: float, grade: float | None) -> float:
    """Y_DT of teeth of ISO 1328 grade 4 or finer (None: perfect).

    It is below 1 for a contact ratio eps_alpha_n above 2.05.

    Source: ISO 6336-3:2006, 10: -0.666 eps_alpha_n + 2.366 up to 2.5, 0.7 beyond.
    """
    low, high = DEEP_TOOTH_RATIOS
    if ratio <= low or (grade is not None and grade > DEEP_TOOTH_GRADE):
        return 1.0
    if ratio > high:
        return 0.7
    return 2.366 - 0.666 * ratio


def stress_factor_on_path(
    pair: GearPair, gear: Gear, position: Array, *, allow_extrapolation: bool = False
) -> Array:
    """Y_F Y_S of one gear for a contact at any position along the path.

    Parameters
    ----------
    position : m    from A in the transverse section; beyond the path the tip's corner touches, so
        its ends count

    Returns
    -------
    of the shape of ``position``; in the normal section the way from the tip is 1 / cos(beta_b)
    longer
    """
    on_path = np.clip(position, 0.0, pair.path_of_contact)
    from_tip = on_path
    if gear is pair.pinion:
        from_tip = pair.path_of_contact - on_path
    distance = np.ravel(from_tip) / math.cos(pair.base_helix_angle)
    loading = root_loading(gear, distance, allow_extrapolation=allow_extrapolation)
    return loading.stress_factor.reshape(np.shape(position))


def pair_root_stress(
    pair: GearPair,
    gear: Gear,
    position: Array,
    load: Array,
    *,
    allow_extrapolation: bool = False,
) -> Array:
    """Root stress of a spur tooth under the load of its pair, of the shape of ``position``, Pa.

    Parameters
    ----------
    position : m    of the contact from A
    load : N        of this pair along the line of action, static or dynamic
    """
    factor = stress_factor_on_path(
        pair, gear, position, allow_extrapolation=allow_extrapolation
    )
    tangential = load * math.cos(gear.transverse_pressure_angle)
    return tangential * factor / (root_width(pair, gear) * gear.normal_module)


def spread_along_face(load: Array, structure: Array, coupling: float) -> Array:
    """Load of the root where slices bend their neighbours, (..., slice).

    Parameters
    ----------
    load : (..., slice)             of each slice without its neighbours
    structure : (..., slice) m2/N   compliance of teeth and bodies per width
    coupling : squared length over which slices couple, over the squared width of a slice; 0
        leaves ``load`` as it is

    The reaction k w of the foundation with shear that the mesh has for its slices, see
    ``structure_deflection``: the sum over the face stays.
    """
    n_slices = load.shape[-1]
    if coupling == 0.0 or n_slices == 1:
        return load
    return (
        structure_deflection(structure, load, np.ones(n_slices), coupling) / structure
    )
