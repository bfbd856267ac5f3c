"""Contact stress of a pair in slices for the pitting line: one number for the whole flank."""

from __future__ import annotations

import numpy as np

from gensig.arrays import Array
from gensig.material import Material
from gensig.mesh.sliced.slice_pressure import contact_pressure
from gensig.mesh.sliced.slices import SlicedMesh, loaded_contact


def sliced_contact_stress(
    mesh: SlicedMesh, material: Material, torques: Array, exponent: float
) -> Array:
    """Contact stress whose damage is that of the flank's slices on average, (torque,) Pa.

    Parameters
    ----------
    torques : (torque,) N m    of the pinion
    exponent : of the stress in the pitting line

    Hertz's pressure of every slice as it passes the pitch point, where ISO 6336-2 takes it, with
    its load from the equilibrium of the mesh; s = (mean of p_j^q over the face)^(1 / q), which is
    Miner's damage averaged over the face: pits come anywhere on it.
    """
    pair = mesh.pair
    roll = pair.pitch_point + mesh.lag
    slices = np.arange(len(roll))
    stresses = []
    for torque in torques:
        contact = loaded_contact(mesh, roll, float(torque) / pair.pinion.base_radius)
        pressure = contact_pressure(mesh, contact, material)
        passing = np.argmax(contact.pair_index == 0, axis=1)
        damage = pressure[slices, passing, slices] ** exponent
        mean = np.average(damage, weights=mesh.slice_width)
        stresses.append(mean ** (1.0 / exponent))
    return np.array(stresses)
