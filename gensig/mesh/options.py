"""Which mesh law, with which constants: every convention by name."""

from __future__ import annotations

from dataclasses import dataclass

from gensig.errors import ConfigError

CHOICES = {
    "law": ("one_sided", "paper"),
    "pair_coupling": ("coupled", "sum"),
    "contact": ("linear", "weber"),
    "elasticity": ("plane_stress", "plane_strain"),
    "crack": ("paper",),
    "roll_torque": ("consistent", "classical"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class MeshOptions:
    """Conventions and assumed constants of the gear mesh.

    law : ``one_sided`` solves contact with gaps (no pull, corner contact), ``paper`` is a spring k(t) without gaps
    pair_coupling : ``coupled`` lets pairs share the gear bodies, ``sum`` adds pair stiffnesses as the paper does
    contact : ``linear`` is the paper's constant Hertz term, ``weber`` the load-dependent local compliance, a secant at
        the quasi-static pair load
    elasticity : ``plane_stress`` (the paper's) or ``plane_strain``, of bending, axial and body terms
    crack : the paper's equations, the one choice so far
    roll_torque : ``consistent`` keeps the energy balance where compliance and gap change with roll angle,
        ``classical`` leaves that torque out
    damping_ratio : of the mesh mode at the mean mesh stiffness
    friction_coefficient : of the flanks; its sign passes through zero over ``friction_transition`` base pitches
    points_per_pitch : table nodes per base pitch
    """

    law: str
    pair_coupling: str
    contact: str
    elasticity: str
    crack: str
    roll_torque: str
    damping_ratio: float
    friction_coefficient: float
    friction_transition: float
    points_per_pitch: int
    allow_extrapolation: bool

    def __post_init__(self) -> None:
        for key, allowed in CHOICES.items():
            if getattr(self, key) not in allowed:
                raise ConfigError(f"mesh.{key} = {getattr(self, key)!r}; allowed: {', '.join(allowed)}")
        for key, low, high in (
            ("damping_ratio", 0.0, 1.0),
            ("friction_coefficient", 0.0, 0.5),
            ("friction_transition", 1e-3, 0.5),
            ("points_per_pitch", 32, 8192),
        ):
            value = getattr(self, key)
            if not low <= value <= high:
                raise ConfigError(f"mesh.{key} = {value:g} must lie in {low:g}..{high:g}")
