"""The tooth's root of ISO 6336-3: critical section, form and stress correction factors.

Everything is of the normal section, on the virtual spur gear of a helical one. Theory:
``docs/theory/root_stress.md``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.errors import ExtrapolationError, GeometryError
from gensig.geometry.gear import Gear
from gensig.geometry.involute import involute

# rad, of the root's tangent to the tooth centreline at the critical section
TANGENT = math.pi / 6.0
ROUNDS = 500  # at most, of the iteration for theta
SETTLED = 1e-14
NOTCH = (1.0, 8.0)  # range of q_s on which the stress correction factor was fitted


@dataclass(frozen=True, slots=True, kw_only=True)
class VirtualGear:
    """Spur gear with the tooth form of the normal section; for a spur gear it is the gear itself.

    ``n_teeth`` z_n need not be whole; ``tip_radius`` and ``base_radius`` m.

    Source: ISO 6336-3, 6.2: z_n = z / (cos^2(beta_b) cos(beta)), d_n = m_n z_n, d_bn = d_n
    cos(alpha_n), d_an = d_n + d_a - d.
    """

    n_teeth: float
    base_radius: float
    tip_radius: float

    @property
    def tip_curvature_radius(self) -> float:
        """Curvature radius of the involute at the tip, m."""
        return math.sqrt(self.tip_radius**2 - self.base_radius**2)


@dataclass(frozen=True, slots=True, kw_only=True)
class RootSection:
    """Critical section of a tooth.

    There the tangents at 30 degrees to its centreline touch the root fillets.
    ``thickness`` s_Fn and ``fillet_radius`` rho_F in m, ``height`` of the section above the
    virtual gear's centre in m, ``theta`` rad.
    """

    thickness: float
    fillet_radius: float
    height: float
    theta: float

    @property
    def notch_parameter(self) -> float:
        """Notch parameter q_s = s_Fn / (2 rho_F)."""
        return self.thickness / (2.0 * self.fillet_radius)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RootLoading:
    """Load of the critical section by a force at some points of the flank, (point,) each.

    ``load_angle`` alpha_Fen in rad and ``lever_arm`` h_Fe in m; ``form_factor`` Y_F,
    ``stress_correction_factor`` Y_S and their product ``stress_factor``, which stays finite where
    the lever arm does not count.
    """

    load_angle: Array
    lever_arm: Array
    form_factor: Array
    stress_correction_factor: Array
    stress_factor: Array


def virtual_gear(gear: Gear) -> VirtualGear:
    """Virtual spur gear of a gear."""
    n_teeth = gear.n_teeth / (
        math.cos(gear.base_helix_angle) ** 2 * math.cos(gear.helix_angle)
    )
    pitch_radius = 0.5 * gear.normal_module * n_teeth
    return VirtualGear(
        n_teeth=n_teeth,
        base_radius=pitch_radius * math.cos(gear.pressure_angle),
        tip_radius=pitch_radius + gear.tip_radius - gear.pitch_radius,
    )


def root_section(gear: Gear) -> RootSection:
    """Critical section of a gear's tooth.

    Raises
    ------
    GeometryError    where the tangent does not touch the fillet

    Source: ISO 6336-3, 6.2.2, without protuberance (s_pr = 0): E, G, H, theta = 2 G tan(theta) /
    z_n - H, s_Fn, rho_F.
    """
    z, alpha = virtual_gear(gear).n_teeth, gear.pressure_angle
    rounding = gear.cutter_tip_radius_coefficient
    dedendum = gear.addendum_coefficient + gear.clearance_coefficient
    tip_corner = (1.0 - math.sin(alpha)) * rounding / math.cos(alpha)
    e = math.pi / 4.0 - dedendum * math.tan(alpha) - tip_corner
    g = rounding - dedendum + gear.profile_shift
    h = 2.0 / z * (math.pi / 2.0 - e) - math.pi / 3.0
    theta = _settled_theta(gear, z, g, h)
    angle, cosine = math.pi / 3.0 - theta, math.cos(theta)
    beyond = g / cosine - rounding
    thickness = z * math.sin(angle) + math.sqrt(3.0) * beyond
    fillet = rounding + 2.0 * g**2 / (cosine * (z * cosine**2 - 2.0 * g))
    height = 0.5 * (z * math.cos(angle) + g / cosine - rounding)
    module = gear.normal_module
    return RootSection(
        thickness=module * thickness,
        fillet_radius=module * fillet,
        height=module * height,
        theta=theta,
    )


def _settled_theta(gear: Gear, z: float, g: float, h: float) -> float:
    theta = TANGENT
    for _ in range(ROUNDS):
        before, theta = theta, 2.0 * g / z * math.tan(theta) - h
        if not 0.0 < theta < 0.5 * math.pi:
            break
        if abs(theta - before) <= SETTLED:
            return theta
    raise GeometryError(
        f"{gear.name}: the 30 degree tangent of ISO 6336-3 finds no root fillet with "
        f"{gear.n_teeth} teeth and profile "
        f"shift {gear.profile_shift:g}; change them or cutter_tip_radius_coefficient"
    )


def root_loading(
    gear: Gear, tip_distance: Array | float, *, allow_extrapolation: bool = False
) -> RootLoading:
    """Form and stress correction factors of a force at points of the flank.

    Parameters
    ----------
    tip_distance : (point,) m    of the contact from the gear's tip along the line of action in the
        normal section
    allow_extrapolation : use the stress correction factor beyond its range without an error

    Raises
    ------
    ExtrapolationError    for a notch parameter outside 1 <= q_s < 8, unless allowed

    Source: ISO 6336-3, 6.2 and 7.2: alpha_en, gamma_e, alpha_Fen = alpha_en - gamma_e, h_Fe, Y_F
    = (6 h_Fe / m_n) cos(alpha_Fen) / ((s_Fn / m_n)^2 cos(alpha_n)), and with L = s_Fn / h_Fe Y_S
    = (1.2 + 0.13 L) q_s^(1 / (1.21 + 2.3 / L)). The product is taken as (1.2 h_Fe + 0.13 s_Fn)
    ..., at least 0.
    """
    section, virtual = root_section(gear), virtual_gear(gear)
    notch = section.notch_parameter
    if not NOTCH[0] <= notch < NOTCH[1] and not allow_extrapolation:
        raise ExtrapolationError(
            f"{gear.name}: the notch parameter s_Fn / (2 rho_F) = {notch:.3g} lies outside "
            f"{NOTCH[0]:g}..{NOTCH[1]:g}, "
            "where the stress correction factor of ISO 6336-3 holds; change "
            "cutter_tip_radius_coefficient, or set "
            f"mesh.allow_extrapolation=true"
        )
    distance = np.atleast_1d(np.asarray(tip_distance, dtype=np.float64))
    curvature = virtual.tip_curvature_radius - distance
    roll = curvature / virtual.base_radius  # tan(alpha_en)
    alpha = gear.pressure_angle
    tooth_width = 0.5 * math.pi + 2.0 * gear.profile_shift * math.tan(alpha)
    half_thickness = tooth_width / virtual.n_teeth + involute(alpha)
    gamma = half_thickness - (roll - np.arctan(roll))
    load_angle = np.arctan(roll) - gamma
    radius = np.hypot(virtual.base_radius, curvature)
    arm = (np.cos(gamma) - np.sin(gamma) * np.tan(load_angle)) * radius - section.height
    # Y_F = per_arm * h_Fe
    per_arm = 6.0 * gear.normal_module * np.cos(load_angle)
    per_arm = per_arm / (section.thickness**2 * math.cos(alpha))
    power = 1.0 / (1.21 + 2.3 * np.maximum(arm, 0.0) / section.thickness)
    lifted = np.maximum(1.2 * arm + 0.13 * section.thickness, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        slenderness = 1.2 + 0.13 * section.thickness / arm
        correction = np.where(arm > 0.0, slenderness * notch**power, np.nan)
    return RootLoading(
        load_angle=load_angle,
        lever_arm=arm,
        form_factor=per_arm * arm,
        stress_correction_factor=correction,
        stress_factor=per_arm * lifted * notch**power,
    )
