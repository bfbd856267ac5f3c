"""Pits that appear and grow with the load cycles of a flank.

Miner's sum on a pitting S-N line gives the damage; number and size follow from it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.faults.flank_loss import flank_area
from gensig.faults.pitting import DistributedPitting
from gensig.geometry.contact import GearPair
from gensig.life.growth import GrowthLaw, GrowthOptions
from gensig.material import Material
from gensig.mesh.sliced.slice_pressure import contact_pressure
from gensig.mesh.sliced.slices import SlicedMesh, loaded_contact
from gensig.units import check_limits, check_positive, unit

N_SIZES = 121


@dataclass(frozen=True, slots=True, kw_only=True)
class PitGrowthOptions(GrowthOptions):
    """Pitting S-N line, and growth of pits after its end.

    ``cycles`` at the contact stress ``strength`` end a flank's life without pits; at another
    stress s they are cycles (strength / s)^exponent. From there on ``pits_per_life`` pits a tooth
    appear in as many cycles again. Their median diameter grows as the damage to the power
    ``size_exponent``; ``start_scatter`` is that of the first pits' size. ``end_share`` is the
    pitted share of the flank at which the life ends.
    """

    cycles: float
    strength: float = unit("mpa")
    exponent: float
    pits_per_life: float
    size_exponent: float
    end_share: float
    rate_scatter: float
    start_scatter: float

    def __post_init__(self) -> None:
        GrowthOptions.__post_init__(self)
        most = {
            "cycles": 1e12,
            "strength": 1e10,
            "exponent": 40.0,
            "pits_per_life": 1e4,
            "end_share": 1.0,
            "size_exponent": 2.0,
        }
        limits = {key: (0.0, value) for key, value in most.items()}
        check_limits(self, "life.pitting.", **limits)
        limits.pop("size_exponent")
        check_positive(self, "life.pitting.", *limits)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PitGrowth(GrowthLaw):
    """Growth law of one gear's pits; made by ``pit_growth``.

    Its size is the damage, 1 where the first pits appear.

    Parameters
    ----------
    torques : (torque,) N m         of the pinion, ascending, at which ``unit_stress`` is known;
        one where it does not matter
    unit_stress : (torque,) Pa    contact stress at 1 N m; it goes with the root of the torque
    first_diameter : float   median diameter of the first pits, m
    spread_area : float      mean area of a pit over that of one of median diameter
    area : float             of a flank, m2
    """

    options: PitGrowthOptions
    sizes: Array
    meshes: float
    torques: Array
    unit_stress: Array
    first_diameter: float
    spread_area: float
    area: float

    def rate(self, size: Array, torque: float) -> Array:
        """Damage a turn of the pinion, (size,): Miner's sum (ISO 6336-6)."""
        unit_stress = float(
            np.interp(math.log(torque), np.log(self.torques), self.unit_stress)
        )
        stress = unit_stress * math.sqrt(torque)
        options = self.options
        lasting = options.cycles * (options.strength / stress) ** options.exponent
        return np.full(np.shape(size), self.meshes / lasting)

    def n_pits(self, size: float) -> float:
        """Mean number of pits on a flank; it grows evenly with the damage beyond 1."""
        return self.options.pits_per_life * max(size - 1.0, 0.0)

    def diameter(self, size: float) -> float:
        """Median diameter of the pits, m."""
        return self.first_diameter * max(size, 1.0) ** self.options.size_exponent

    def share(self, size: float) -> float:
        """Pitted share of the flank, pits side by side."""
        discs = self.n_pits(size) * 0.25 * math.pi * self.diameter(size) ** 2
        return discs * self.spread_area / self.area

    def fault(self, size: float) -> dict[str, Any]:
        """Pitted share and size of the pits."""
        return {
            "pitted_share": round(self.share(size), 12),
            "pit_diameter_mm": round(self.diameter(size) * 1e3, 9),
        }

    def measures(self, size: float, torque: float) -> dict[str, float]:
        """Damage and mean number of pits."""
        return {"pitting_damage": size, "n_pits": self.n_pits(size)}


def contact_stress(pair: GearPair, material: Material, torque: float) -> float:
    """Nominal contact stress of a spur pair under a torque of the pinion in N m, Pa.

    Hertz's largest pressure of the two flanks at the pitch point, the whole load on one pair (ISO
    6336-2, sigma_H0).
    """
    pitch = pair.pitch_point
    radii = (pair.pinion_curvature(pitch), pair.wheel_curvature(pitch))
    curvature = sum(1.0 / float(radius) for radius in radii)
    reduced = material.youngs_modulus / (1.0 - material.poisson_ratio**2)
    load = torque / pair.pinion.base_radius / pair.face_width
    return math.sqrt(load * reduced * curvature / (2.0 * math.pi))


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


def pit_growth(
    pair: GearPair,
    material: Material,
    pits: DistributedPitting,
    options: PitGrowthOptions,
    first: float = 1.0,
    stresses: tuple[Array, Array] | None = None,
) -> PitGrowth:
    """Growth law of pits like ``pits``, with their diameter times ``first`` for the first ones.

    ``stresses`` are torques of the pinion in N m, ascending, and contact stresses there in Pa,
    (torque,) both; None takes the nominal ones of a spur pair.

    Raises
    ------
    ConfigError    for helical gears without stresses, and an end that such pits do not reach
    """
    if stresses is None:
        if pair.pinion.helix_angle != 0.0:
            raise ConfigError(
                "life: the nominal contact stress of pit growth is that of a spur pair; "
                "take its slices"
            )
        stresses = np.ones(1), np.array([contact_stress(pair, material, 1.0)])
    torques, stress = stresses
    law = PitGrowth(
        options=options,
        sizes=np.array([0.0, 1.0]),
        meshes=pair.speed_ratio(pits.gear),
        torques=torques,
        unit_stress=stress / np.sqrt(torques),
        first_diameter=pits.pit_diameter * first,
        spread_area=math.exp(2.0 * pits.diameter_scatter**2),
        area=flank_area(pair.gears[pits.gear]),
    )
    if law.first_diameter <= 0.0 or not law.share(2.0) > 0.0:
        raise ConfigError(
            "life: pits without a diameter never reach life.pitting.end_share"
        )
    most = 0.7 * (pits.region_high - pits.region_low)
    if options.end_share > most:
        raise ConfigError(
            f"life.pitting.end_share = {options.end_share:g} must be {most:.3g} or less, "
            "0.7 of the region of the pits"
        )
    sound = np.linspace(0.0, 1.0, 20, endpoint=False)
    pitted = np.linspace(1.0, _end(law), N_SIZES - 20)
    return replace(law, sizes=np.concatenate([sound, pitted]))


def _end(law: PitGrowth) -> float:
    """Damage at which the pitted share reaches its end, by bisection."""
    low, end = 1.0, 2.0
    while law.share(end) < law.options.end_share:
        end *= 2.0
    for _ in range(60):
        middle = 0.5 * (low + end)
        if law.share(middle) < law.options.end_share:
            low = middle
        else:
            end = middle
    return end
