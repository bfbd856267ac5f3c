"""Quantities of root stress and strength, by the names that the rows use."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

from gensig.life.root.strength import safety
from gensig.options.compose import compose
from gensig.systems.root_strength import RootStrength, read_root_strength

StrengthCheck = Callable[[RootStrength, str], float]


@lru_cache(maxsize=32)
def read_strength_case(overrides: tuple[str, ...]) -> RootStrength:
    """Compose the pair and the strength of a row."""
    return read_root_strength(compose("generate", overrides))


def _factor(name: str) -> StrengthCheck:
    """A factor of the decisive gear."""

    def check(case: RootStrength, at: str) -> float:
        factors: Any = case.factors[case.decisive]
        return float(getattr(factors, name))

    return check


def _stress_factor(case: RootStrength, at: str) -> float:
    """Product of all factors: stress times b m_n over the tangential force."""
    factors = case.factors[case.decisive]
    return factors.stress_per_force * factors.width * factors.normal_module


def _under(case: RootStrength, at: str) -> RootStrength:
    """``at`` is a root stress in MPa."""
    return case.with_root_stress(float(at) * 1e6)


def _safety(convention: str) -> StrengthCheck:
    def check(case: RootStrength, at: str) -> float:
        factors = case.factors[case.decisive]
        result: Any = safety(
            case.strength,
            float(at) * 1e6,
            notch_parameter=factors.notch_parameter,
            normal_module=factors.normal_module,
        )
        return float(getattr(result, convention))

    return check


def _drop(case: RootStrength, at: str) -> float:
    """``at`` is two stresses.

    How much the second is below the first, by the forces that give them.
    """
    before, after = (case.force_for(float(word)) for word in at.split())
    return 1.0 - after / before


def _hours(case: RootStrength, at: str) -> float:
    """Time in s in which each tooth has its load cycles at ``at`` turns a minute."""
    return case.strength.n_load_cycles / float(at) * 60.0


def _place_of_largest(case: RootStrength, at: str) -> float:
    """Place of the decisive gear's largest stress in the zone of single contact, 0 at B, 1 at D."""
    loaded = case
    if at:
        loaded = _under(case, at)
    history = loaded.history()
    place = history.roll[history.stress[loaded.decisive].argmax()]
    begin = loaded.pair.path_of_contact - loaded.pair.base_pitch
    return float((place - begin) / (loaded.pair.base_pitch - begin))


def _largest(case: RootStrength, at: str) -> float:
    loaded = _under(case, at)
    return float(loaded.history().stress[loaded.decisive].max())


STRENGTH: dict[str, StrengthCheck] = {
    "root.contact_ratio": lambda case, at: case.pair.transverse_contact_ratio,
    "root.form_factor": _factor("form_factor"),
    "root.stress_correction_factor": _factor("stress_correction_factor"),
    "root.contact_ratio_factor": _factor("contact_ratio_factor"),
    "root.stress_factor": _stress_factor,
    "root.tangential_force": lambda case, at: _under(case, at).tangential_force,
    "root.normal_force": lambda case, at: _under(case, at).flanks.mesh_force,
    "root.normal_force_per_width": lambda case, at: (
        _under(case, at).flanks.mesh_force / case.pair.face_width
    ),
    "root.torque": lambda case, at: _under(case, at).flanks.torque,
    "root.safety_paper": _safety("paper"),
    "root.safety_iso": _safety("iso"),
    "root.stress_drop": _drop,
    "root.life": _hours,
    "root.place_of_largest": _place_of_largest,
    "root.largest_over_mesh": _largest,
    "root.force_over_mesh": lambda case, at: case.force_over_mesh_for(float(at) * 1e6),
}
