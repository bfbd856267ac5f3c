"""Deflection of a gear body under neighbouring teeth: the clamped elastic ring by Fourier series.

Derivation, checks against finite elements and limits: ``docs/theory/spur_mesh.md``.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from gensig.arrays import Array
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.geometry.tooth_profile import load_angle
from gensig.material import Material

STRESS_EXPONENT = 6  # calibrated: bending stress on the root arc goes as xi (1 - xi^6)
SERIES_LENGTH = 12.0  # harmonics up to n theta_f = 12: cross terms to 1e-4


@lru_cache(maxsize=64)
def shared_body_compliance(pair: GearPair, material: Material) -> float:
    """Cross compliance of two tooth pairs in contact at once, through both gear bodies, m/N.

    The mean over the double zone of (deflection of one pair) / (load on the other), which varies
    by 1 to 5 % there. Plane stress. Source: elastic ring clamped at the bore, loaded over the root
    arc of a tooth.
    """
    overlap = (pair.transverse_contact_ratio - 1.0) * pair.base_pitch
    position = np.linspace(0.0, max(overlap, 0.0), 9)
    total = np.zeros_like(position)
    for (side, gear), pitches in zip(pair.gears.items(), (1, -1), strict=True):
        loaded = load_angle(gear, pair.curvature(side, position))
        probed = load_angle(gear, pair.curvature(side, position + pair.base_pitch))
        total += cross_compliance(gear, material, loaded, probed, pitches=pitches)
    return float(np.mean(total))


def cross_compliance(
    gear: Gear, material: Material, loaded: Array, probed: Array, *, pitches: int
) -> Array:
    """Deflection of the tooth ``pitches`` ahead per load on tooth 0, (phase,) m/N.

    Both are along the lines of action of their own teeth.

    Parameters
    ----------
    loaded, probed : (phase,) rad    load angles on the loaded tooth and on the probed one
    pitches : 0 gives the body compliance under the loaded tooth itself
    """
    angle = 2.0 * math.pi * pitches / gear.n_teeth
    flexibility = arc_flexibility(gear, material, angle)
    loads = _load(gear, probed), flexibility, _load(gear, loaded)
    return np.einsum("pi,ij,pj->p", *loads)


@lru_cache(maxsize=64)
def arc_flexibility(gear: Gear, material: Material, angle: float) -> Array:
    """Displacements (u_x, u_y, rotation about the centre) of a root arc per (F_x, F_y, moment).

    The loaded arc is at angle 0, the displaced arc at ``angle``.

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
    ring = ring_harmonics(gear, material, len(n))
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


@lru_cache(maxsize=64)  # the arcs of a gear share it
def ring_harmonics(gear: Gear, material: Material, n_harmonics: int) -> Array:
    """The first harmonics of ``ring_harmonic``, (harmonic, 2, 2) m/Pa, read-only."""
    ring = np.stack([ring_harmonic(gear, material, n) for n in range(n_harmonics)])
    ring.flags.writeable = False
    return ring


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
        radial = r_f * (q - 1.0) / (2.0 * (lame + mu) * q + 2.0 * mu)
        return np.diag([radial, r_f * (q - 1.0) / (2.0 * mu)])

    # power p, amplitudes (U, V), reference radius; the logarithm replaces the third for n = 1
    powers = [
        (n + 1, kappa - n - 1.0, kappa + n + 1.0, r_f),
        (n - 1, -1.0, 1.0, r_f),
        (-n - 1, -1.0, -1.0, r_i),
    ]
    if n > 1:
        powers.insert(2, (1 - n, kappa - 1.0 + n, n - kappa - 1.0, r_i))

    Pair = tuple[float, float]

    def column(at_bore: Pair, at_root: Pair, slope: Pair) -> list[float]:
        (u, v), (u_slope, v_slope) = at_root, slope
        normal = (lame * (u_slope + u + n * v) + 2.0 * mu * u_slope) / r_f
        shear = mu * (-n * u + v_slope - v) / r_f
        return [*at_bore, normal, shear, u, v]

    columns = []
    for power, u, v, reference in powers:
        inner, outer = (r_i / reference) ** power, (r_f / reference) ** power
        slope = power * u * outer, power * v * outer
        columns.append(column((u * inner, v * inner), (u * outer, v * outer), slope))
    if n == 1:
        log = 2.0 * kappa * math.log(r_i / r_f)
        slope = 2.0 * kappa, -2.0 * kappa
        columns.append(column((log - 1.0, -log - 1.0), (-1.0, -1.0), slope))
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
    """(F_x, F_y, moment about the centre) per unit width, by rows; columns are stress shapes."""
    theta, measure = theta_f * nodes, r_f * theta_f * weights
    cos, sin = np.cos(theta), np.sin(theta)
    force_x = (normal * cos - shear * sin) @ measure
    force_y = (normal * sin + shear * cos) @ measure
    return np.stack([force_x, force_y, shear @ measure * r_f])


def _load(gear: Gear, angle: Array) -> Array:
    """Resultants of a unit force pressing on the loaded flank, (phase, 3)."""
    moment = np.full_like(angle, -gear.base_radius)
    return np.stack([-np.sin(angle), -np.cos(angle), moment], axis=-1)
