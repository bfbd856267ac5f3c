"""Root stress of a gear pair.

At ISO's load point, and through the mesh under the loads that its flanks share.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError
from gensig.geometry.contact import GearPair
from gensig.life.root.root_stress import (
    RootFactors,
    pair_root_stress,
    root_factors,
    root_width,
    spread_along_face,
    stress_factor_on_path,
)
from gensig.life.root.strength import Safety, Strength, safety
from gensig.mesh.load_distribution import loaded_pair_table, pair_states, static_mesh
from gensig.mesh.sliced.slices import loaded_contact
from gensig.options.configuration import Configuration
from gensig.sensing.manufacturing import Quality
from gensig.systems.registry import SLICED, read_sliced_pair, read_system
from gensig.systems.sliced_pair import SlicedPair
from gensig.units import read

Array = NDArray[np.float64]

N_PHASES = 200  # of one mesh period
EDGE = 1e-9  # base pitches from where a pair enters or leaves to the phases beside it
WIDEST = 64.0  # times the force at ISO's load point: the search for the force over the mesh goes no further


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RootHistory:
    """Root stress of one tooth pair from its first touch to its last.

    ``roll`` (point,) m of the pinion along the line of action, 0 where the pair enters at A (the
    first slice of a helical one); ``share`` (point,) of the load on this pair; ``stress`` by
    gear, (point,) Pa, the largest over the face.
    """

    roll: Array
    share: Array
    stress: dict[str, Array]


@dataclass(frozen=True, slots=True, kw_only=True)
class GearStress:
    """Nominal stress sigma_F0 and sigma_F with the load factors in Pa, every factor, and the
    safety of one gear.
    """

    factors: RootFactors
    nominal: float
    stress: float
    safety: Safety


@dataclass(frozen=True, kw_only=True, eq=False)
class RootStrength:
    """A pair with sound teeth, its strength and the torque on its pinion in N m.

    ``sliced`` says that the face is cut into slices: helical pairs, and spur ones with modified
    flanks.
    """

    flanks: SlicedPair
    sliced: bool
    strength: Strength
    grade: float | None

    @property
    def pair(self) -> GearPair:
        """The gears in mesh."""
        return self.flanks.pair

    @property
    def tangential_force(self) -> float:
        """F_t at the reference circle, N, without load factors."""
        return self.flanks.torque / self.pair.pinion.pitch_radius

    @cached_property
    def factors(self) -> dict[str, RootFactors]:
        """Every factor of both gears, by name."""
        return root_factors(
            self.pair,
            load_point=self.strength.load_point,
            edition=self.strength.edition,
            grade=self.grade,
            allow_extrapolation=self.flanks.mesh.allow_extrapolation,
        )

    @property
    def decisive(self) -> str:
        """The gear with the higher root stress."""
        return max(self.factors, key=lambda name: self.factors[name].stress_per_force)

    def force_for(self, stress: float) -> float:
        """Tangential force F_t in N that gives the decisive gear this sigma_F in Pa, load factors
        included.
        """
        if not (math.isfinite(stress) and stress > 0.0):
            raise ConfigError(
                f"a root stress of {stress * 1e-6:g} MPa cannot be asked for; give a positive one"
            )
        return stress / (
            self.factors[self.decisive].stress_per_force * self.strength.load_factor
        )

    def under(self, stress: float) -> RootStrength:
        """The same pair under the torque that gives the decisive gear this sigma_F in Pa."""
        torque = self.force_for(stress) * self.pair.pinion.pitch_radius
        return replace(self, flanks=replace(self.flanks, torque=torque))

    def force_over_mesh_for(self, stress: float) -> float:
        """Tangential force F_t in N under which the largest stress over the mesh, of either gear,
        is ``stress`` Pa.
        """
        from scipy.optimize import brentq

        radius = self.pair.pinion.pitch_radius

        def excess(force: float) -> float:
            loaded = replace(self, flanks=replace(self.flanks, torque=force * radius))
            return (
                max(float(values.max()) for values in loaded.history().stress.values())
                / stress
                - 1.0
            )

        low = high = self.force_for(stress)
        while excess(low) > 0.0:
            low /= 2.0
        while excess(high) < 0.0:
            high *= 2.0
            if high > WIDEST * low:
                raise ConfigError(
                    f"no force gives {stress * 1e-6:g} MPa through this mesh: at {high:.4g} N it is less; ask for less"
                )
        return float(brentq(excess, low, high, rtol=1e-6)) if high > low else low

    def gears(self) -> dict[str, GearStress]:
        """Stress and safety of both gears at the load point of ``strength``, by name."""
        force = self.tangential_force
        if not force > 0.0:
            raise ConfigError(
                f"operating.torque_nm = {self.flanks.torque:g} must be positive: the pinion drives; or give --stress"
            )
        found = {}
        for name, factors in self.factors.items():
            nominal = force * factors.stress_per_force
            stress = nominal * self.strength.load_factor
            found[name] = GearStress(
                factors=factors,
                nominal=nominal,
                stress=stress,
                safety=safety(
                    self.strength,
                    stress,
                    notch_parameter=factors.notch_parameter,
                    normal_module=self.pair.pinion.normal_module,
                ),
            )
        return found

    def history(self, *, n_phases: int = N_PHASES) -> RootHistory:
        """Root stress through the mesh under the static loads of the flanks, K_A, K_gamma and K_v
        in the force.

        Of the face and transverse load factors it knows nothing: the loads that the mesh finds
        are in their place.
        """
        force = self.flanks.mesh_force * self.strength.force_factor
        pitch = self.pair.base_pitch
        ends = np.array(
            [0.0, self.pair.path_of_contact % pitch]
        )  # where a pair enters or leaves, and a jump may be
        near = (ends[:, None] + pitch * EDGE * np.array([-1.0, 1.0])).ravel() % pitch
        phases = np.sort(np.concatenate([self.flanks.phases(n_phases), near]))
        roll, share, stress = (
            self._sliced(phases, force) if self.sliced else self._whole(phases, force)
        )
        order = np.argsort(roll)
        roll, share = roll[order], share[order]
        bears = np.flatnonzero(share > 0.0)
        kept = slice(max(bears[0] - 1, 0), bears[-1] + 2)
        return RootHistory(
            roll=roll[kept],
            share=share[kept],
            stress={name: values[order][kept] for name, values in stress.items()},
        )

    def _whole(
        self, phases: Array, force: float
    ) -> tuple[Array, Array, dict[str, Array]]:
        """Pairs of a spur pair as wholes.

        Roll, share of the load and stress by gear, (point,) each.
        """
        mesh = self.flanks.mesh
        flanks = self.flanks
        table = loaded_pair_table(
            self.pair,
            flanks.material,
            mesh,
            force=force,
            modification=flanks.modification,
        )
        states = pair_states(table, phases)
        load = static_mesh(table, states, force).load
        stress = {
            name: pair_root_stress(
                self.pair,
                gear,
                states.position,
                load,
                allow_extrapolation=mesh.allow_extrapolation,
            ).ravel()
            for name, gear in self.pair.gears.items()
        }
        return states.position.ravel(), load.ravel() / force, stress

    def _sliced(
        self, phases: Array, force: float
    ) -> tuple[Array, Array, dict[str, Array]]:
        """The same slice by slice, the largest of the face.

        Slices bend each other as in the mesh.
        """
        mesh, pair, slices = self.flanks.sliced_mesh(), self.pair, self.flanks.slices
        contact = loaded_contact(mesh, phases, force)
        roll = contact.position[:, :, 0] + mesh.lag[0]
        structure = np.interp(contact.position, mesh.position, mesh.structure)
        coupled = slices.slice_coupling == "coupled"
        length = slices.coupling_modules * pair.pinion.normal_module
        coupling = (length / float(mesh.slice_width[0])) ** 2 if coupled else 0.0
        stress = {}
        for name, gear in pair.gears.items():
            factor = stress_factor_on_path(
                pair,
                gear,
                contact.position,
                allow_extrapolation=self.flanks.mesh.allow_extrapolation,
            )
            tangential = contact.line_load * math.cos(gear.transverse_pressure_angle)
            common = pair.face_width / root_width(pair, gear)
            own = tangential * common * factor / gear.normal_module
            stress[name] = (
                spread_along_face(own, structure, coupling).max(axis=2).ravel()
            )
        share = (contact.line_load * mesh.slice_width).sum(axis=2)
        return roll.ravel(), (share / share.sum(axis=1, keepdims=True)).ravel(), stress


def read_root_strength(config: Configuration) -> RootStrength:
    """Pair and strength from the boundary keys of a configuration.

    Raises
    ------
    ConfigError, GeometryError    for keys or values that make no machine or no strength
    """
    sliced = config.section("system").get("kind") == SLICED
    if not sliced:
        read_system(config)  # refuses what a spur pair cannot have
    flanks = read_sliced_pair(config)
    return RootStrength(
        flanks=flanks,
        sliced=sliced or flanks.pair.pinion.helix_angle != 0.0,
        strength=read(Strength, config.section("strength"), "strength"),
        grade=read(Quality, config.section("quality"), "quality").iso1328_grade,
    )
