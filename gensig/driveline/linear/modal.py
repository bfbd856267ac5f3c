"""Natural modes of a shaft line.

Frequencies, damping ratios from loss factors, shapes, energy shares.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array
from gensig.driveline.linear.matrices import LineMatrices
from gensig.errors import SimulationError

# Of the highest frequency. Below it is rounding: springs are resolved to 1e-16 of the stiffest.
RIGID_SHARE = 1e-7


@dataclass(frozen=True, slots=True, kw_only=True)
class Modes:
    """Undamped modes, lowest first, those that deform nothing as exactly 0.

    Parameters
    ----------
    frequency : (mode,) Hz
    damping_ratio : (mode,) 0 for rigid modes
    shapes : (mode, dof) normalised to unit modal mass, largest part positive
    kinetic_share : (mode, coordinate) of the kinetic energy, every row sums to 1
    mesh_strain_share : (mode, mesh) of the strain energy, 0 for rigid modes
    """

    frequency: Array
    damping_ratio: Array
    shapes: Array
    kinetic_share: Array
    mesh_strain_share: Array

    @property
    def n_rigid(self) -> int:
        """Number of modes that deform nothing."""
        return int(np.count_nonzero(self.frequency == 0.0))


def natural_modes(matrices: LineMatrices) -> Modes:
    """Modes with every mesh held at its stiffness.

    Damping ratio of mode i: sum of loss factor times strain energy of each spring over twice the
    whole strain energy, plus that of the viscous dampers, phi' C phi / (2 omega), which neither
    couple modes nor shift frequencies here.

    Raises
    ------
    SimulationError    for motion without restoring force beyond the rigid rotation of each part

    Source: Ungar & Kerwin (1962), loss factors in terms of energy; Johnson & Kienholz (1982),
    modal strain energy.
    """
    from scipy.linalg import eigh

    whole = matrices.whole_stiffness
    square, shapes = eigh(whole, matrices.mass)
    shapes = np.ascontiguousarray(shapes.T)
    n_rigid = len(matrices.rigid)
    frequency = np.sqrt(np.maximum(square, 0.0)) / (2.0 * math.pi)
    if np.count_nonzero(frequency <= RIGID_SHARE * frequency[-1]) > n_rigid:
        softest, fastest = (
            matrices.names[int(np.abs(shapes[mode]).argmax())] for mode in (n_rigid, -1)
        )
        raise SimulationError(
            f"{softest} has next to no restoring force beside {fastest}, which vibrates at "
            f"{frequency[-1]:.3g} Hz: over {1.0 / RIGID_SHARE:g} times the lowest natural "
            "frequency; check inertias and stiffnesses of both and their units"
        )
    frequency[:n_rigid] = 0.0
    # rotations of the parts do not couple through the mass, so each is a mode of its own
    shapes[:n_rigid] = (
        matrices.rigid
        / np.sqrt(
            np.einsum("rd,de,re->r", matrices.rigid, matrices.mass, matrices.rigid)
        )[:, None]
    )
    largest = np.take_along_axis(shapes, np.abs(shapes).argmax(axis=1)[:, None], axis=1)
    shapes *= np.where(largest < 0.0, -1.0, 1.0)

    approach = shapes @ matrices.directions.T  # (mode, mesh)
    omega = 2.0 * math.pi * frequency[n_rigid:]
    elastic = shapes[n_rigid:]
    lost = _quadratic(elastic, matrices.loss_stiffness)
    lost += approach[n_rigid:] ** 2 @ (
        matrices.mesh_loss_factor * matrices.mesh_stiffness
    )
    viscous = (
        _quadratic(elastic, matrices.damping)
        + approach[n_rigid:] ** 2 @ matrices.mesh_damping
    )
    ratio, strain = np.zeros(len(frequency)), np.zeros(approach.shape)
    ratio[n_rigid:] = 0.5 * lost / omega**2 + 0.5 * viscous / omega
    strain[n_rigid:] = (
        approach[n_rigid:] ** 2 * matrices.mesh_stiffness / omega[:, None] ** 2
    )
    kinetic = matrices.coordinate_mass * (shapes @ matrices.expand.T) ** 2
    return Modes(
        frequency=frequency,
        damping_ratio=ratio,
        shapes=shapes,
        kinetic_share=kinetic / kinetic.sum(axis=1, keepdims=True),
        mesh_strain_share=strain,
    )


def with_viscous_losses(matrices: LineMatrices) -> LineMatrices:
    """The same with loss factors as viscous dampers, for integration in time: loss factors 0.

    Shafts: C gets M Phi diag(2 zeta omega) Phi' M, so that every mode has its own ratio whatever
    its frequency, and rigid motion none. Meshes: c = eta sqrt(k m) with the mass that the mesh
    accelerates, the ratio eta / 2 of the pair on its own, since a mesh loses contact and its
    damper with it.
    """
    modes = natural_modes(
        replace(matrices, mesh_loss_factor=np.zeros_like(matrices.mesh_stiffness))
    )
    omega = 2.0 * math.pi * modes.frequency
    rate = np.zeros(len(omega))
    elastic = omega > 0.0
    rate[elastic] = (
        _quadratic(modes.shapes[elastic], matrices.loss_stiffness) / omega[elastic]
    )
    momentum = modes.shapes @ matrices.mass
    return _viscous(matrices, (momentum.T * rate) @ momentum)


def with_local_losses(matrices: LineMatrices) -> LineMatrices:
    """The same with a viscous damper beside every shaft and mesh that has a loss factor.

    Shafts: c = eta sqrt(k J) with the inertia J1 J2 / (J1 + J2) of the two discs that it joins,
    as for meshes: the ratio eta / 2 of both on their own. The damping matrix is as sparse as the
    shafts are.
    """
    damping, mass = np.zeros_like(matrices.damping), np.diag(matrices.mass)
    rows, columns = np.nonzero(np.triu(matrices.loss_stiffness, k=1))
    for ends in zip(rows.tolist(), columns.tolist(), strict=True):
        stiffness = -matrices.stiffness[ends]
        joined = mass[ends[0]] * mass[ends[1]] / (mass[ends[0]] + mass[ends[1]])
        damper = -matrices.loss_stiffness[ends] * math.sqrt(joined / stiffness)
        damping[np.ix_(ends, ends)] += damper * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return _viscous(matrices, damping)


def _viscous(matrices: LineMatrices, damping: Array) -> LineMatrices:
    """The same with a damping matrix in place of the loss factors of its shafts."""
    loss_damping = matrices.mesh_loss_factor * np.sqrt(
        matrices.mesh_stiffness * matrices.mesh_mass
    )
    return replace(
        matrices,
        damping=matrices.damping + damping,
        loss_stiffness=np.zeros_like(matrices.loss_stiffness),
        mesh_damping=matrices.mesh_damping + loss_damping,
        mesh_loss_factor=np.zeros_like(matrices.mesh_loss_factor),
    )


def _quadratic(shapes: Array, matrix: Array) -> Array:
    """phi' A phi of every shape, (mode,)."""
    return np.einsum("md,de,me->m", shapes, matrix, shapes)
