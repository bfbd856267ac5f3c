"""Options of the group ``wear``: the wear law, the end of life, every convention by name."""

from __future__ import annotations

from dataclasses import dataclass

from gensig.errors import ConfigError
from gensig.geometry.contact import SIDES
from gensig.options.configuration import Section
from gensig.units import check_choice, check_limits, check_positive, read, unit

CHOICES = {
    "rule": ("band", "fixed_intervals"),
    "criterion": ("first", "sum"),
    "sharing": ("mesh", "one_pair"),
    "geometry": ("worn", "unworn"),
    "load_radius": ("base", "reference"),
}


ENDS = (
    "threshold",
    "transmission_error_limit",
    "vibration_limit_m_per_s2",
    "vibration_rise",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FlankMaterial:
    """Archard's coefficient and hardness in Pa of one flank; None stands for that of both gears."""

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
            if key != "sharing" or value is not None:
                check_choice(f"wear.{key}", value, allowed)
        check_limits(self, "wear.", n_intervals=(1, 1_000_000))
        check_positive(self, "wear.", *ENDS, "step")
        for name, flank in (
            ("", self),
            *((f"{side}.", getattr(self, side)) for side in SIDES),
        ):
            check_positive(flank, f"wear.{name}", "coefficient", "hardness")
            coefficient = flank.coefficient
            if coefficient is not None and coefficient > 1.0:
                raise ConfigError(
                    f"wear.{name}coefficient = {coefficient:g} must be at most 1: it is the share "
                    "of the meetings of asperities that wear something off "
                    "(Archard, J. Appl. Phys. 24, 1953)"
                )
        follows_mesh = self.geometry == "worn" and self.sharing != "one_pair"
        if self.transmission_error_limit is not None and not follows_mesh:
            raise ConfigError(
                "wear.transmission_error_limit_um is reached by worn flanks in mesh: "
                "it needs wear.geometry=worn and wear.sharing=mesh"
            )

    def wear_factor(self, name: str) -> float:
        """Archard's k / H of one gear, 1/Pa."""
        coefficient: float | None = getattr(self, name).coefficient
        if coefficient is None:
            coefficient = self.coefficient
        return coefficient / self.hardness_of(name)

    def hardness_of(self, name: str) -> float:
        """H of one gear, Pa."""
        hardness: float | None = getattr(self, name).hardness
        if hardness is None:
            return self.hardness
        return hardness


def read_wear_options(values: Section) -> WearOptions:
    """Options from the boundary keys of ``wear``."""
    sides = {
        name: read(FlankMaterial, values.get(name, {}), f"wear.{name}")
        for name in SIDES
    }
    both = {key: value for key, value in values.items() if key not in SIDES}
    return read(WearOptions, both, "wear", **sides)
