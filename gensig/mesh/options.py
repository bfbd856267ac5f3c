"""Options of the gear mesh: law, conventions, constants, slices."""

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
    "phase": ("rotation", "prescribed"),
    "heat_law": (
        "grown",
        "paper",
        "paper_misprints",
        "paper_contact",
        "paper_twice",
        "paper_once",
    ),
}

SLICE_COUPLINGS = ("coupled", "independent")
MOST_SLICES = 1000

# conventions of the equations of mesh.heat_law=paper: those that null stands for with them
OF_PAPERS_HEAT = {
    "elasticity": "plane_stress",
    "body": "sainsot",
    "tooth": "to_contact",
}
# conventions that null stands for, by law
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

    law : ``one_sided`` solves contact with gaps (no pull, corner contact), ``paper`` is a spring
        k(t) without gaps
    pair_coupling : ``coupled`` lets tooth pairs share the gear bodies, ``sum`` adds their
        stiffnesses as the paper does
    contact : ``linear`` is the paper's constant Hertz term, ``weber`` the load-dependent local
        compliance, a secant at the quasi-static load
    elasticity : ``plane_stress`` (the paper's) or ``plane_strain``, of bending, axial, body terms
    body : ``ring`` solves the elastic ring clamped at the bore, ``sainsot`` is the paper's fit
    tooth : ``to_centreline`` integrates up to the load's crossing of the tooth centreline, where
        the local contact term begins; ``to_contact`` up to the contact abscissa, as the paper does
    crack : ``calibrated`` to finite elements, body included, or ``paper``, eqs. (11) and (12)
    bending : of a partly loaded face; ``by_slice`` bends every slice by itself on the shared
        body, ``whole`` bends the tooth as one piece
    roll_torque : ``consistent`` keeps the energy balance where compliance and gap change with roll
        angle,
        ``classical`` leaves that torque out
    phase : of the mesh follows the pinion's own ``rotation``, or is ``prescribed``, that of the set
        speed, as in equations with a given k(t); that goes with ``law=paper``
    heat_law : teeth grow with heat by gensig's own law, ``grown``, or by a reading of the
        equations of the thermal paper, ``gensig.mesh.thermal.paper_growth``
    damping_ratio : of the mesh mode at the mean mesh stiffness
    friction_coefficient : of the flanks; its sign passes through zero over ``friction_transition``
        base pitches
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
    phase: str
    damping_ratio: float
    friction_coefficient: float
    friction_transition: float
    points_per_pitch: int
    allow_extrapolation: bool
    heat_law: str = "grown"

    def __post_init__(self) -> None:
        for key, allowed in CHOICES.items():
            if getattr(self, key) not in allowed:
                raise ConfigError(
                    f"mesh.{key} = {getattr(self, key)!r}; allowed: {', '.join(allowed)}"
                )
        if self.phase == "prescribed" and self.law != "paper":
            raise ConfigError(
                f"mesh.phase = prescribed goes with mesh.law = paper, not {self.law}: the law of "
                "one-sided contact follows the rotation of the gears; take mesh.phase=rotation"
            )
        if self.has_papers_heat:
            for key in ("body", "tooth"):
                if getattr(self, key) != OF_PAPERS_HEAT[key]:
                    raise ConfigError(
                        f"mesh.heat_law = {self.heat_law} has the paper's tooth and body, not "
                        f"mesh.{key} = {getattr(self, key)}; take mesh.{key}=null or "
                        f"{OF_PAPERS_HEAT[key]}, or mesh.heat_law=grown"
                    )
        _require_range(self, "damping_ratio", 0.0, 1.0)
        _require_range(self, "friction_coefficient", 0.0, 0.5)
        _require_range(self, "friction_transition", 1e-3, 0.5)
        _require_range(self, "points_per_pitch", 32, 8192)

    @property
    def has_papers_heat(self) -> bool:
        """True if teeth grow with heat by the equations of the thermal paper."""
        return self.heat_law != "grown"


@dataclass(frozen=True, slots=True, kw_only=True)
class SliceOptions:
    """Slices of a pair's face and their coupling.

    n_slices : slices of equal width over the common face
    slice_coupling : ``coupled`` lets a slice's load bend its neighbours, ``independent`` does not
    coupling_modules : length over which slices couple, in normal modules
    slices_in_phase : True omits the helix of the contact lines, for comparison; the geometry
        keeps it
    independent_faulty_slices : True allows independent slices with a fault over part of the face
    """

    n_slices: int
    slice_coupling: str
    coupling_modules: float
    slices_in_phase: bool
    independent_faulty_slices: bool

    def __post_init__(self) -> None:
        if self.slice_coupling not in SLICE_COUPLINGS:
            raise ConfigError(
                f"mesh.slice_coupling = {self.slice_coupling!r}; allowed: "
                f"{', '.join(SLICE_COUPLINGS)}"
            )
        _require_range(self, "n_slices", 1, MOST_SLICES)
        _require_range(self, "coupling_modules", 0.0, 10.0)


def _require_range(
    options: MeshOptions | SliceOptions, key: str, low: float, high: float
) -> None:
    value = getattr(options, key)
    if not low <= value <= high:
        raise ConfigError(f"mesh.{key} = {value:g} must lie in {low:g}..{high:g}")


SLICE_KEYS = frozenset(field.name for field in fields(SliceOptions))


def read_slice_options(values: Section) -> SliceOptions:
    """Slices from the boundary keys of ``mesh``."""
    keys = {key: value for key, value in values.items() if key in SLICE_KEYS}
    return read(SliceOptions, keys, "mesh")


def refuse_papers_heat(options: MeshOptions, shown: str) -> MeshOptions:
    """The options; ConfigError for ``mesh.heat_law=paper``, where teeth are not cut into slices.

    Parameters
    ----------
    shown : the machine, as the error names it
    """
    if options.has_papers_heat:
        raise ConfigError(
            f"mesh.heat_law = {options.heat_law} is for system=helical_pair, which takes spur "
            f"gears as well, not for {shown}; take it, or mesh.heat_law=grown"
        )
    return options


def read_mesh_options(values: Section) -> MeshOptions:
    """Options from boundary keys; a convention that is null follows ``law`` and ``heat_law``."""
    convention = CONVENTIONS.get(str(values.get("law")))
    if convention is None:
        raise ConfigError(
            f"mesh.law = {values.get('law')!r}; allowed: {', '.join(CONVENTIONS)}"
        )
    keys = {key: value for key, value in values.items() if key not in SLICE_KEYS}
    if keys.get("heat_law", "grown") != "grown":
        convention = convention | OF_PAPERS_HEAT
    for key, value in convention.items():
        if keys.get(key) is None:
            keys[key] = value
    return read(MeshOptions, keys, "mesh")
