"""Pressure on the flanks of a loaded contact in slices."""

from __future__ import annotations

import math

import numpy as np

from gensig.arrays import Array
from gensig.material import Material
from gensig.mesh.local_contact import relative_radius
from gensig.mesh.sliced.slices import LoadedContact, SlicedMesh


def contact_pressure(
    mesh: SlicedMesh, contact: LoadedContact, material: Material
) -> Array:
    """Largest Hertzian pressure of every slice, (phase, pair, slice) Pa.

    Source: Hertz, p = sqrt(w E' / (2 pi rho)) with E' = E / (1 - nu^2) for two like flanks. Load
    along the normal and per length of the contact line are w / cos(beta_b) and times cos(beta_b),
    and the relative radius in the normal section is the transverse one over cos(beta_b): p takes
    the root of cos(beta_b).
    """
    on_path = np.clip(contact.position, 0.0, mesh.pair.path_of_contact)
    radius = relative_radius(mesh.pair, on_path)
    reduced = material.youngs_modulus / (1.0 - material.poisson_ratio**2)
    slant = math.cos(mesh.pair.base_helix_angle)
    return np.sqrt(contact.line_load * slant * reduced / (2.0 * math.pi * radius))
