"""Root stress of a gear pair: at ISO's load point, and through the mesh.

Through the mesh the loads are those that the flanks share.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gensig.arrays import Array
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

N_PHASES = 200  # of one mesh period
EDGE = 1e-9  # base pitches between entry or exit of a pair and the added phases
WIDEST = (
    64.0  # largest force of the search over the mesh, over that at ISO's load point
)


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
    """Nominal stress sigma_F0, sigma_F with load factors in Pa, factors and safety of one gear."""

    factors: RootFactors
    nominal: float
    stress: float
    safety: Safety


@dataclass(frozen=True, kw_only=True, eq=False)
class RootStrength:
    """A pair with healthy teeth, its strength and the torque on its pinion in N m.

    ``sliced`` is True where the face is cut into slices: helical pairs, and spur pairs with
    modified flanks.
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
        """Tangential force F_t in N for a sigma_F in Pa of the decisive gear, with load factors."""
        if not (math.isfinite(stress) and stress > 0.0):
            raise ConfigError(
                f"a root stress of {stress * 1e-6:g} MPa cannot be asked for; give a positive one"
            )
        per_force = self.factors[self.decisive].stress_per_force
        return stress / (per_force * self.strength.load_factor)

    def with_root_stress(self, stress: float) -> RootStrength:
        """The same pair with the torque for a sigma_F in Pa of the decisive gear."""
        return self._with_force(self.force_for(stress))

    def _with_force(self, force: float) -> RootStrength:
        torque = force * self.pair.pinion.pitch_radius
        return replace(self, flanks=replace(self.flanks, torque=torque))

    def force_over_mesh_for(self, stress: float) -> float:
        """Tangential force F_t in N for a largest stress of ``stress`` Pa over the mesh."""
        from scipy.optimize import brentq

        def excess(force: float) -> float:
            stresses = self._with_force(force).history().stress.values()
            return max(float(values.max()) for values in stresses) / stress - 1.0

        low = high = self.force_for(stress)
        while excess(low) > 0.0:
            low /= 2.0
        while excess(high) < 0.0:
            high *= 2.0
            if high > WIDEST * low:
                raise ConfigError(
                    f"no force gives {stress * 1e-6:g} MPa through this mesh: at {high:.4g} N it "
                    "is less; ask for less"
                )
        if high == low:
            return low
        return float(brentq(excess, low, high, rtol=1e-6))

    def gears(self) -> dict[str, GearStress]:
        """Stress and safety of both gears at the load point of ``strength``, by name."""
        force = self.tangential_force
        if not force > 0.0:
            raise ConfigError(
                f"operating.torque_nm = {self.flanks.torque:g} must be positive: the pinion "
                "drives; or give --stress"
            )
        stresses = {}
        for name, factors in self.factors.items():
            nominal = force * factors.stress_per_force
            stress = nominal * self.strength.load_factor
            stresses[name] = GearStress(
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
        return stresses

    def history(self, *, n_phases: int = N_PHASES) -> RootHistory:
        """Root stress through the mesh under the static loads of the flanks.

        The force includes K_A, K_gamma and K_v. The computed loads replace the face and transverse
        load factors.
        """
        force = self.flanks.mesh_force * self.strength.force_factor
        pitch = self.pair.base_pitch
        # the load may jump where a pair enters or leaves
        ends = np.array([0.0, self.pair.path_of_contact % pitch])
        near = (ends[:, None] + pitch * EDGE * np.array([-1.0, 1.0])).ravel() % pitch
        phases = np.sort(np.concatenate([self.flanks.phases(n_phases), near]))
        loads = self._sliced if self.sliced else self._whole
        roll, share, stress = loads(phases, force)
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
        """Roll, share of the load and stress by gear, (point,) each, of whole spur teeth."""
        pair, flanks, mesh = self.pair, self.flanks, self.flanks.mesh
        table = loaded_pair_table(
            pair, flanks.material, mesh, force=force, modification=flanks.modification
        )
        states = pair_states(table, phases)
        position, load = states.position, static_mesh(table, states, force).load
        allowed, stress = mesh.allow_extrapolation, {}
        for name, gear in pair.gears.items():
            stress[name] = pair_root_stress(
                pair, gear, position, load, allow_extrapolation=allowed
            ).ravel()
        return position.ravel(), load.ravel() / force, stress

    def _sliced(
        self, phases: Array, force: float
    ) -> tuple[Array, Array, dict[str, Array]]:
        """The same slice by slice, with the largest stress of the face.

        Slices bend each other as in the mesh.
        """
        mesh, pair, slices = self.flanks.sliced_mesh(), self.pair, self.flanks.slices
        contact = loaded_contact(mesh, phases, force)
        position = contact.position
        roll = position[:, :, 0] + mesh.lag[0]
        structure = np.interp(position, mesh.position, mesh.structure)
        coupling = 0.0
        if slices.slice_coupling == "coupled":
            length = slices.coupling_modules * pair.pinion.normal_module
            coupling = (length / float(mesh.slice_width[0])) ** 2
        allowed, stress = self.flanks.mesh.allow_extrapolation, {}
        for name, gear in pair.gears.items():
            factor = stress_factor_on_path(
                pair, gear, position, allow_extrapolation=allowed
            )
            tangential = contact.line_load * math.cos(gear.transverse_pressure_angle)
            common = pair.face_width / root_width(pair, gear)
            of_slice = tangential * common * factor / gear.normal_module
            spread = spread_along_face(of_slice, structure, coupling)
            stress[name] = spread.max(axis=2).ravel()
        share = (contact.line_load * mesh.slice_width).sum(axis=2)
        return roll.ravel(), (share / share.sum(axis=1, keepdims=True)).ravel(), stress


def read_root_strength(config: Configuration) -> RootStrength:
    """Pair and strength from the boundary keys of a configuration.

    Raises
    ------
    ConfigError, GeometryError    for invalid keys or values
    """
    sliced = config.section("system").get("kind") == SLICED
    if not sliced:
        read_system(config)  # raises for values that a spur pair cannot have
    flanks = read_sliced_pair(config)
    return RootStrength(
        flanks=flanks,
        sliced=sliced or flanks.pair.pinion.helix_angle != 0.0,
        strength=config.section("strength").read(Strength),
        grade=config.section("quality").read(Quality).iso1328_grade,
    )
