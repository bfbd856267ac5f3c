"""Which mesh law, with which constants: every convention by name."""

from __future__ import annotations

from dataclasses import dataclass, fields

from gensig.errors import ConfigError
from gensig.options.configuration import Section
from gensig.units import read

CHOICES = {
    "law": ("one_sided", "paper"),
    "pair_coupling": ("coupled", "sum"),
    "contact": ("linear", "weber"),
    "elasticity": ("plane_stress", "plane_strain"),
    "body": ("ring", "sainsot"),
    "tooth": ("to_centreline", "to_contact"),
    "crack": ("calibrated", "paper"),
    "bending": ("by_slice", "whole"),
    "roll_torque": ("consistent", "classical"),
}

SLICE_COUPLINGS = ("coupled", "independent")

# what null stands for: the paper's law comes with the paper's conventions
CONVENTIONS = {
    "paper": {
        "elasticity": "plane_stress",
        "body": "sainsot",
        "tooth": "to_contact",
        "crack": "paper",
        "bending": "whole",
    },
    "one_sided": {
        "elasticity": "plane_strain",
        "body": "ring",
        "tooth": "to_centreline",
        "crack": "calibrated",
        "bending": "by_slice",
    },
}


@dataclass(frozen=True, slots=True, kw_only=True)
class MeshOptions:
    """Conventions and assumed constants of the gear mesh.

    law : ``one_sided`` solves contact with gaps (no pull, corner contact), ``paper`` is a spring k(t) without gaps
    pair_coupling : ``coupled`` lets pairs share the gear bodies, ``sum`` adds pair stiffnesses as the paper does
    contact : ``linear`` is the paper's constant Hertz term, ``weber`` the load-dependent local compliance, a secant at
        the quasi-static pair load
    elasticity : ``plane_stress`` (the paper's) or ``plane_strain``, of bending, axial and body terms
    body : ``ring`` solves the elastic ring clamped at the bore, ``sainsot`` is the fit that the paper uses
    tooth : ``to_centreline`` integrates up to where the load crosses the tooth centreline, from where the local contact
        term counts; ``to_contact`` up to the contact abscissa, as the paper does
    crack : ``calibrated`` to finite elements, the body weakened too, or ``paper``, eqs. (11) and (12)
    bending : where only part of the face bears, ``by_slice`` lets every slice bend by itself on the shared body,
        ``whole`` bends the tooth as one piece
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
    body: str
    tooth: str
    crack: str
    bending: str
    roll_torque: str
    damping_ratio: float
    friction_coefficient: float
    friction_transition: float
    points_per_pitch: int
    allow_extrapolation: bool

    def __post_init__(self) -> None:
        for key, allowed in CHOICES.items():
            if getattr(self, key) not in allowed:
                raise ConfigError(
                    f"mesh.{key} = {getattr(self, key)!r}; allowed: {', '.join(allowed)}"
                )
        for key, low, high in (
            ("damping_ratio", 0.0, 1.0),
            ("friction_coefficient", 0.0, 0.5),
            ("friction_transition", 1e-3, 0.5),
            ("points_per_pitch", 32, 8192),
        ):
            value = getattr(self, key)
            if not low <= value <= high:
                raise ConfigError(
                    f"mesh.{key} = {value:g} must lie in {low:g}..{high:g}"
                )


@dataclass(frozen=True, slots=True, kw_only=True)
class SliceOptions:
    """How the face of a pair is cut into slices, and what ties them together.

    n_slices : slices of equal width over the common face
    slice_coupling : ``coupled`` lets a slice's load bend its neighbours, ``independent`` makes each a gear of its own
    coupling_modules : length over which slices couple, in normal modules
    slices_in_phase : True leaves out the helix of the contact lines but not that of the geometry (for comparison only)
    independent_faulty_slices : True takes a fault over part of the face with independent slices all the same
    """

    n_slices: int
    slice_coupling: str
    coupling_modules: float
    slices_in_phase: bool
    independent_faulty_slices: bool

    def __post_init__(self) -> None:
        if self.slice_coupling not in SLICE_COUPLINGS:
            raise ConfigError(
                f"mesh.slice_coupling = {self.slice_coupling!r}; allowed: {', '.join(SLICE_COUPLINGS)}"
            )
        for key, low, high in (("n_slices", 1, 1000), ("coupling_modules", 0.0, 10.0)):
            value = getattr(self, key)
            if not low <= value <= high:
                raise ConfigError(
                    f"mesh.{key} = {value:g} must lie in {low:g}..{high:g}"
                )


SLICE_KEYS = frozenset(field.name for field in fields(SliceOptions))


def read_slice_options(values: Section) -> SliceOptions:
    """Slices from the boundary keys of ``mesh``."""
    return read(
        SliceOptions,
        {key: value for key, value in values.items() if key in SLICE_KEYS},
        "mesh",
    )


def read_mesh_options(values: Section) -> MeshOptions:
    """Options from boundary keys; a convention that is null follows ``law``."""
    convention = CONVENTIONS.get(str(values.get("law")))
    if convention is None:
        raise ConfigError(
            f"mesh.law = {values.get('law')!r}; allowed: {', '.join(CONVENTIONS)}"
        )
    own = {key: value for key, value in values.items() if key not in SLICE_KEYS}
    return read(
        MeshOptions,
        {**own, **{k: v for k, v in convention.items() if values.get(k) is None}},
        "mesh",
    )
