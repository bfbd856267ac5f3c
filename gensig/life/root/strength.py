"""Fatigue strength of the tooth's root: material values, factors, safety and reliability."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gensig.errors import ConfigError
from gensig.life.root.root_stress import EDITIONS, LOAD_POINTS
from gensig.units import check_choice, check_positive, unit

# ISO 6336-3, case-hardened steel: life factor over load cycles, straight lines between these on
# logarithmic axes
LIFE_CYCLES, LIFE_FACTORS = (1e3, 3e6, 1e10), (2.5, 1.0, 0.85)
SLIP_LAYER = 3e-6  # m, rho' of case-hardened steel
NOTCH_OF_TEST_GEAR = 2.5  # q_sT
# m; Y_X of case-hardened steel falls between these, to the smallest factor
SIZE_MODULES, SMALLEST_SIZE_FACTOR = (5e-3, 25e-3), 0.8

FACTORS = (
    "paper_life_factor",
    "test_gear_stress_correction",
    "life_factor",
    "relative_notch_sensitivity",
    "relative_surface_factor",
    "size_factor",
    "mean_stress_factor",
    "application_factor",
    "mesh_load_factor",
    "dynamic_factor",
    "face_load_factor",
    "transverse_load_factor",
)


class Reliability(NamedTuple):
    """A class of the engine paper's table 3: its name and least safety factor."""

    name: str
    least_safety: float


RELIABILITY = (
    Reliability("high", 2.00),
    Reliability("higher", 1.60),
    Reliability("general", 1.25),
    Reliability("low", 1.00),
)
BELOW_ALL = "below low"


def reliability(safety: float) -> str:
    """Class of a safety factor.

    Source: engine paper, table 3 (high, higher, general and low reliability from 2.00, 1.60, 1.25
    and 1.00 on).
    """
    for grade in RELIABILITY:
        if safety >= grade.least_safety:
            return grade.name
    return BELOW_ALL


@dataclass(frozen=True, slots=True, kw_only=True)
class Strength:
    """Bending strength of a material and every factor between it and a safety factor.

    Parameters
    ----------
    bending_limit : sigma_Flim, Pa, nominal stress number of the standard test gear
    paper_life_factor : K_FN of the engine paper
    test_gear_stress_correction : Y_ST
    n_load_cycles : of each tooth
    life_factor : Y_NT; None takes that of case-hardened steel at ``n_load_cycles``
    relative_notch_sensitivity : Y_delta_rel_T; None takes that of case-hardened steel at the
        gear's notch
    relative_surface_factor : Y_R_rel_T
    size_factor : Y_X; None takes that of case-hardened steel at the module
    mean_stress_factor : Y_M, 0.7 for teeth that are bent both ways alike
    application_factor, mesh_load_factor, dynamic_factor : K_A, K_gamma, K_v, which raise the force
    face_load_factor, transverse_load_factor : K_F_beta, K_F_alpha, which raise the stress
    load_point, edition : see ``gensig.life.root.root_stress.root_factors``
    """

    name: str
    bending_limit: float = unit("mpa")
    paper_life_factor: float
    test_gear_stress_correction: float
    n_load_cycles: float
    life_factor: float | None
    relative_notch_sensitivity: float | None
    relative_surface_factor: float
    size_factor: float | None
    mean_stress_factor: float
    application_factor: float
    mesh_load_factor: float
    dynamic_factor: float
    face_load_factor: float
    transverse_load_factor: float
    load_point: str
    edition: int

    def __post_init__(self) -> None:
        check_positive(self, "strength.", "bending_limit", "n_load_cycles", *FACTORS)
        check_choice("strength.load_point", self.load_point, LOAD_POINTS)
        check_choice("strength.edition", self.edition, EDITIONS)

    @property
    def force_factor(self) -> float:
        """K_A K_gamma K_v."""
        return self.application_factor * self.mesh_load_factor * self.dynamic_factor

    @property
    def load_factor(self) -> float:
        """Product of all load factors: sigma_F = sigma_F0 times this."""
        return self.force_factor * self.face_load_factor * self.transverse_load_factor


@dataclass(frozen=True, slots=True, kw_only=True)
class Safety:
    """Safety of one gear's root by both conventions, with their factors.

    ``paper`` = sigma_Flim K_FN / sigma_F, ``iso`` = sigma_Flim Y_ST Y_NT Y_delta_rel_T Y_R_rel_T
    Y_X Y_M / sigma_F.
    """

    paper: float
    iso: float
    life_factor: float
    relative_notch_sensitivity: float
    size_factor: float


def safety(
    strength: Strength, stress: float, *, notch_parameter: float, normal_module: float
) -> Safety:
    """Safety factors under a root stress sigma_F in Pa, load factors included.

    Source: engine paper eq. (32); ISO 6336-3, 5. The paper's lacks Y_ST although its stress has
    Y_S, so it is about half of the other.
    """
    if not stress > 0.0:
        raise ConfigError(
            f"the root stress is {stress * 1e-6:g} MPa and must be positive"
        )
    life = strength.life_factor
    if life is None:
        life = life_factor(strength.n_load_cycles)
    notch = strength.relative_notch_sensitivity
    if notch is None:
        notch = relative_notch_sensitivity(notch_parameter)
    size = strength.size_factor
    if size is None:
        size = size_factor(normal_module)
    iso = strength.test_gear_stress_correction * life * notch
    iso = iso * strength.relative_surface_factor * size * strength.mean_stress_factor
    return Safety(
        paper=strength.bending_limit * strength.paper_life_factor / stress,
        iso=strength.bending_limit * iso / stress,
        life_factor=life,
        relative_notch_sensitivity=notch,
        size_factor=size,
    )


def life_factor(n_load_cycles: float) -> float:
    """Y_NT of case-hardened steel: 2.5 up to 1e3 cycles, 1 at 3e6, 0.85 from 1e10 on.

    Source: ISO 6336-3, 12, the lower of its two lines beyond 3e6.
    """
    logarithm = np.interp(
        math.log(n_load_cycles), np.log(LIFE_CYCLES), np.log(LIFE_FACTORS)
    )
    return float(np.exp(logarithm))


def relative_notch_sensitivity(notch_parameter: float) -> float:
    """Y_delta_rel_T of case-hardened steel, 1 at the notch of the test gear.

    Source: ISO 6336-3, 13: (1 + sqrt(rho' X)) / (1 + sqrt(rho' X_T)), X = (1 + 2 q_s) / 5 per mm,
    rho' = 0.003 mm.
    """

    def sensitivity(notch: float) -> float:
        return 1.0 + math.sqrt(SLIP_LAYER * 1e3 * (1.0 + 2.0 * notch) / 5.0)

    return sensitivity(notch_parameter) / sensitivity(NOTCH_OF_TEST_GEAR)


def size_factor(normal_module: float) -> float:
    """Y_X of case-hardened steel for a module in m: 1 up to 5 mm, 1.05 - 0.01 m_n (in mm), 0.8
    from 25 mm on.

    Source: ISO 6336-3, 15.
    """
    low, high = SIZE_MODULES
    return float(np.interp(normal_module, (low, high), (1.0, SMALLEST_SIZE_FACTOR)))
