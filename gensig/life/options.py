"""How flanks wear and when their life ends: every convention by name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gensig.errors import ConfigError
from gensig.geometry.contact import SIDES
from gensig.options.configuration import Section
from gensig.units import from_si, read, split_unit, unit

CHOICES = {
    "rule": ("band", "fixed_intervals"),
    "criterion": ("first", "sum"),
    "sharing": ("mesh", "one_pair"),
    "geometry": ("worn", "unworn"),
    "load_radius": ("base", "reference"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class FlankMaterial:
    """What Archard's law asks of one flank.

    ``hardness`` in Pa, None stands for the value of both gears.
    """

    coefficient: float | None
    hardness: float | None = unit("hbs")


@dataclass(frozen=True, slots=True, kw_only=True)
class WearOptions:
    """Wear law, end of life and numerics, lengths in m.

    Parameters
    ----------
    rule : ``band``, the contact passes a flank point with its width 2a, or ``fixed_intervals``,
        the wear-life paper's: a point wears for 1 / ``n_intervals`` of the time a pair needs for
        the path of contact
    threshold : depth normal to the flank at which the life ends
    transmission_error_limit : from peak to peak, or None
    vibration_limit_m_per_s2, vibration_rise : RMS of a clean record, and its rise over new flanks
        in dB, or None; whatever of these and the threshold comes first ends the life
    criterion : ``first``, the first flank to the threshold, or ``sum``, both flanks of a contact
        point together
    coefficient, hardness : k, and H in Pa, of both gears; ``pinion`` and ``wheel`` override them
    sharing : ``mesh`` or ``one_pair``; None is the mesh, and one pair where the contact ratio is
        below 1
    geometry : ``worn``, sharing and pressure follow the flanks as they wear, or ``unworn``
    load_radius : the arm of the force, ``base`` circle or ``reference`` circle (the wear-life
        paper's eq. 12)
    step : greatest depth worn between two looks at the flanks
    """

    rule: str
    n_intervals: int
    threshold: float = unit("um")
    transmission_error_limit: float | None = unit("um")
    vibration_limit_m_per_s2: float | None = None
    vibration_rise: float | None = unit("db", default=None)
    criterion: str
    coefficient: float
    hardness: float = unit("hbs")
    pinion: FlankMaterial
    wheel: FlankMaterial
    sharing: str | None
    geometry: str
    load_radius: str
    step: float = unit("um")

    def __post_init__(self) -> None:
        for key, allowed in CHOICES.items():
            value = getattr(self, key)
            if value not in allowed and not (key == "sharing" and value is None):
                raise ConfigError(
                    f"wear.{key} = {value!r}; allowed: {', '.join(allowed)}"
                )
        if not 1 <= self.n_intervals <= 1_000_000:
            raise ConfigError(
                f"wear.n_intervals = {self.n_intervals} must lie in 1..1000000"
            )
        ends = (
            "threshold_um",
            "transmission_error_limit_um",
            "vibration_limit_m_per_s2",
            "vibration_rise_db",
        )
        _require_positive(
            "wear", self, (*ends, "step_um", "coefficient", "hardness_hbs")
        )
        for name in SIDES:
            _require_positive(
                f"wear.{name}", getattr(self, name), ("coefficient", "hardness_hbs")
            )
        for place, values in (
            ("wear", self),
            *((f"wear.{name}", getattr(self, name)) for name in SIDES),
        ):
            if values.coefficient is not None and values.coefficient > 1.0:
                raise ConfigError(
                    f"{place}.coefficient = {values.coefficient:g} must be at most 1: it is the "
                    "share of the meetings "
                    "of asperities that wear something off (Archard, J. Appl. Phys. 24, 1953)"
                )
        follows_mesh = self.geometry == "worn" and self.sharing != "one_pair"
        if self.transmission_error_limit is not None and not follows_mesh:
            raise ConfigError(
                "wear.transmission_error_limit_um is reached by worn flanks in mesh: it needs "
                "wear.geometry=worn and "
                "wear.sharing=mesh"
            )

    def wear_factor(self, name: str) -> float:
        """Archard's k / H of one gear, 1/Pa."""
        own: FlankMaterial = getattr(self, name)
        coefficient = self.coefficient if own.coefficient is None else own.coefficient
        return coefficient / self.hardness_of(name)

    def hardness_of(self, name: str) -> float:
        """H of one gear, Pa."""
        own: FlankMaterial = getattr(self, name)
        return self.hardness if own.hardness is None else own.hardness


def _require_positive(place: str, values: Any, keys: tuple[str, ...]) -> None:
    for key in keys:
        value = getattr(values, split_unit(key)[0])
        if value is not None and not value > 0.0:
            raise ConfigError(
                f"{place}.{key} = {from_si(key, value):g} must be positive"
            )


def read_wear_options(values: Section) -> WearOptions:
    """Options from the boundary keys of ``wear``."""
    sides = {
        name: read(FlankMaterial, values.get(name, {}), f"wear.{name}")
        for name in SIDES
    }
    own = {key: value for key, value in values.items() if key not in SIDES}
    return read(WearOptions, own, "wear", **sides)
