"""How the load on one tooth deflects the gear body under its neighbours: the clamped elastic ring
by Fourier series.

Derivation, checks against finite elements and limits: ``docs/theory/spur_mesh.md``.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.geometry.tooth_profile import load_angle
from gensig.material import Material

Array = NDArray[np.float64]

STRESS_EXPONENT = 6  # shape xi (1 - xi^6) of the bending stress on the root arc: the one calibrated number
SERIES_LENGTH = 12.0  # harmonics up to n theta_f = 12: cross terms to 1e-4


@lru_cache(maxsize=64)
def shared_body_compliance(pair: GearPair, material: Material) -> float:
    """Cross compliance of two pairs in contact at once, through both gear bodies, m/N.

    The mean over the double zone of (deflection of one pair) / (load on the other); it varies by
    1 to 5 % there. Plane stress. Source: elastic ring clamped at the bore, loaded over the root
    arc of a tooth.
    """
    overlap = (pair.transverse_contact_ratio - 1.0) * pair.base_pitch
    position = np.linspace(0.0, max(overlap, 0.0), 9)
    pinion = cross_compliance(
        pair.pinion,
        material,
        load_angle(pair.pinion, np.asarray(pair.pinion_curvature(position))),
        load_angle(
            pair.pinion, np.asarray(pair.pinion_curvature(position + pair.base_pitch))
        ),
        pitches=1,
    )
    wheel = cross_compliance(
        pair.wheel,
        material,
        load_angle(pair.wheel, np.asarray(pair.wheel_curvature(position))),
        load_angle(
            pair.wheel, np.asarray(pair.wheel_curvature(position + pair.base_pitch))
        ),
        pitches=-1,
    )
    return float(np.mean(pinion + wheel))


def cross_compliance(
    gear: Gear, material: Material, loaded: Array, probed: Array, *, pitches: int
) -> Array:
    """Deflection along its own line of action of the tooth ``pitches`` ahead, per load on tooth
    0, (phase,) m/N.

    Parameters
    ----------
    loaded, probed : (phase,) rad    load angles on the loaded tooth and on the probed one
    pitches : 0 gives the body compliance under the loaded tooth itself
    """
    flexibility = arc_flexibility(
        gear, material, 2.0 * math.pi * pitches / gear.n_teeth
    )
    return np.einsum(
        "pi,ij,pj->p", _load(gear, probed), flexibility, _load(gear, loaded)
    )


@lru_cache(maxsize=64)
def arc_flexibility(gear: Gear, material: Material, angle: float) -> Array:
    """Displacements (u_x, u_y, rotation about the centre) of a root arc per (F_x, F_y, moment) on
    the arc at angle 0.

    Returns
    -------
    (3, 3), SI, in each tooth's own axes (x outward along the tooth, y towards the loaded flank)
    """
    theta_f, r_f = gear.root_half_angle, gear.root_radius
    n_max = math.ceil(SERIES_LENGTH / theta_f)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    ones, zeros = np.ones_like(nodes), np.zeros_like(nodes)
    normal = np.stack([ones, nodes * (1.0 - np.abs(nodes) ** STRESS_EXPONENT), zeros])
    shear = np.stack([zeros, zeros, ones])
    resultants = _resultants(theta_f, r_f, nodes, weights, normal, shear)

    n = np.arange(n_max + 1)
    kernel = theta_f / math.pi * weights * np.exp(-1j * theta_f * np.outer(n, nodes))
    kernel[0] *= 0.5
    s, t = kernel @ normal.T, kernel @ shear.T  # (harmonic, shape)
    ring = np.stack([ring_harmonic(gear, material, int(k)) for k in n])
    u = ring[:, 0, 0, None] * s + 1j * ring[:, 0, 1, None] * t
    v = -1j * ring[:, 1, 0, None] * s + ring[:, 1, 1, None] * t
    weight = math.pi * r_f * np.exp(1j * n * angle)
    weight[0] *= 2.0
    work = np.real(
        np.einsum("n,ni,nj->ij", weight, s.conj(), u)
        + np.einsum("n,ni,nj->ij", weight, t.conj(), v)
    )
    inverse = np.linalg.inv(resultants)
    return inverse.T @ work @ inverse / gear.face_width


def ring_harmonic(gear: Gear, material: Material, n: int) -> Array:
    """Compliance (U, V) per (S, T) of the n-th harmonic of radial and shear stress on the root
    circle, (2, 2) m/Pa.

    Source: Michell's solutions for the annulus, U = V = 0 at the bore. Plane stress.
    """
    mu = material.shear_modulus
    kappa = (3.0 - material.poisson_ratio) / (1.0 + material.poisson_ratio)
    lame = mu * (3.0 - kappa) / (kappa - 1.0)
    r_f, r_i = gear.root_radius, gear.bore_radius
    if n == 0:
        q = (r_f / r_i) ** 2
        return np.diag(
            [
                r_f * (q - 1.0) / (2.0 * (lame + mu) * q + 2.0 * mu),
                r_f * (q - 1.0) / (2.0 * mu),
            ]
        )

    # power p, amplitudes (U, V), reference radius; the logarithm replaces the third for n = 1
    powers = [
        (n + 1, kappa - n - 1.0, kappa + n + 1.0, r_f),
        (n - 1, -1.0, 1.0, r_f),
        (-n - 1, -1.0, -1.0, r_i),
    ]
    if n > 1:
        powers.insert(2, (1 - n, kappa - 1.0 + n, n - kappa - 1.0, r_i))

    def column(
        u: float, v: float, u_slope: float, v_slope: float
    ) -> tuple[float, float]:
        stress = (lame * (u_slope + u + n * v) + 2.0 * mu * u_slope) / r_f
        return stress, mu * (-n * u + v_slope - v) / r_f

    columns = []
    for power, u, v, reference in powers:
        inner, outer = (r_i / reference) ** power, (r_f / reference) ** power
        columns.append(
            [
                u * inner,
                v * inner,
                *column(u * outer, v * outer, power * u * outer, power * v * outer),
                u * outer,
                v * outer,
            ]
        )
    if n == 1:
        log = 2.0 * kappa * math.log(r_i / r_f)
        columns.append(
            [
                log - 1.0,
                -log - 1.0,
                *column(-1.0, -1.0, 2.0 * kappa, -2.0 * kappa),
                -1.0,
                -1.0,
            ]
        )
    system = np.array(columns).T
    system[2:4] /= mu  # one scale for displacements and stresses
    system /= np.abs(system).max(axis=0)
    loads = np.zeros((4, 2))
    loads[2, 0] = loads[3, 1] = 1.0 / mu
    return system[4:6] @ np.linalg.solve(system[:4], loads)


def _resultants(
    theta_f: float,
    r_f: float,
    nodes: Array,
    weights: Array,
    normal: Array,
    shear: Array,
) -> Array:
    """(F_x, F_y, moment about the centre) of each stress shape per unit width.

    Columns are shapes.
    """
    theta, measure = theta_f * nodes, r_f * theta_f * weights
    return np.stack(
        [
            (normal * np.cos(theta) - shear * np.sin(theta)) @ measure,
            (normal * np.sin(theta) + shear * np.cos(theta)) @ measure,
            shear @ measure * r_f,
        ]
    )


def _load(gear: Gear, angle: Array) -> Array:
    """Resultants of a unit force pressing on the loaded flank, (phase, 3)."""
    return np.stack(
        [-np.sin(angle), -np.cos(angle), np.full_like(angle, -gear.base_radius)],
        axis=-1,
    )
