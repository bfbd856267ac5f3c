"""Laws of growth of cracks and pits on a machine's gears.

Of a spur mesh by its single pair in contact, of slices by the load of each.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from gensig.arrays import Array
from gensig.faults.crack import Crack
from gensig.faults.pitting import DistributedPitting
from gensig.geometry.contact import GearPair
from gensig.life.crack_growth import CrackGrowth, CrackGrowthOptions, crack_growth
from gensig.life.pit_growth import (
    PitGrowth,
    PitGrowthOptions,
    pit_growth,
    sliced_contact_stress,
)
from gensig.life.sliced_crack import sliced_crack_growth
from gensig.material import Material
from gensig.systems.base import Machine
from gensig.systems.sliced_pair import SlicedPair

N_TORQUES = 3  # the shares of slices depend little on the torque


def crack_law(
    machine: Machine,
    crack: Crack,
    options: CrackGrowthOptions,
    torques: tuple[float, float],
) -> CrackGrowth:
    """The law of a crack like ``crack``.

    ``torques`` in N m are the least and the greatest of the life, on the pinion of the mesh.
    """
    if machine.has_whole_teeth:
        return _spur_crack_law(machine.pair, machine.material, crack, options)
    return _sliced_crack_law(_for_lives(machine.flanks), crack, options, torques)


def pit_law(
    machine: Machine,
    pits: DistributedPitting,
    options: PitGrowthOptions,
    first: float,
    torques: tuple[float, float],
) -> PitGrowth:
    """The law of pits like ``pits``, the first ones ``first`` times as large.

    ``torques`` as in ``crack_law``.
    """
    if machine.has_whole_teeth:
        return pit_growth(machine.pair, machine.material, pits, options, first)
    between = _between(torques)
    flanks = _for_lives(machine.flanks)
    stress = _stresses(flanks, tuple(between.tolist()), options.exponent)
    table = between, stress
    return pit_growth(machine.pair, machine.material, pits, options, first, table)


def _for_lives(flanks: SlicedPair) -> SlicedPair:
    """The pair for laws of growth: contact on its path only, and calibrated cracks."""
    mesh = replace(
        flanks.mesh, law="paper", crack="calibrated", allow_extrapolation=True
    )
    return replace(flanks, mesh=mesh)


def _between(torques: tuple[float, float]) -> Array:
    least, greatest = torques
    if least == greatest:
        return np.array([least])
    return np.geomspace(least, greatest, N_TORQUES)


@lru_cache(maxsize=32)
def _spur_crack_law(
    pair: GearPair,
    material: Material,
    crack: Crack,
    options: CrackGrowthOptions,
) -> CrackGrowth:
    return crack_growth(pair, material, crack, options)


@lru_cache(maxsize=32)
def _sliced_crack_law(
    flanks: SlicedPair,
    crack: Crack,
    options: CrackGrowthOptions,
    torques: tuple[float, float],
) -> CrackGrowth:
    mesh_of, between = flanks.sliced_mesh, _between(torques)
    return sliced_crack_growth(
        flanks.pair, flanks.material, mesh_of, crack, options, between
    )


@lru_cache(maxsize=8)
def _stresses(flanks: SlicedPair, torques: tuple[float, ...], exponent: float) -> Array:
    return sliced_contact_stress(
        flanks.sliced_mesh(), flanks.material, np.array(torques), exponent
    )
