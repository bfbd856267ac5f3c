"""The keys of a ``system`` that is a drive line, typed and checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gensig.driveline.linear.dampers import TorsionalDamper
from gensig.dynamics.bearing import BallBearing, support_stiffness
from gensig.dynamics.bearing import Shaft as BearingShaft
from gensig.dynamics.pair import Body, Support
from gensig.errors import ConfigError
from gensig.material import Material
from gensig.options.configuration import Section
from gensig.units import read, unit

HELICAL_MESHES = ("sliced", "constant")


@dataclass(frozen=True, slots=True, kw_only=True)
class LossFactors:
    """Loss factors of what joins nodes, where the table gives none."""

    shaft: float
    coupling: float
    gear_mesh: float

    def __post_init__(self) -> None:
        for key in ("shaft", "coupling", "gear_mesh"):
            if not 0.0 <= getattr(self, key) < 2.0:
                raise ConfigError(
                    f"system.loss_factor.{key} = {getattr(self, key):g} must lie in 0..2"
                )


@dataclass(frozen=True, slots=True, kw_only=True)
class Campbell:
    """Speeds of the first node and orders of it that the Campbell diagram shows.

    None takes those of the meshes.
    """

    low_speed: float = unit("rpm")
    high_speed: float = unit("rpm")
    orders: tuple[float, ...] | None

    def __post_init__(self) -> None:
        if not 0.0 <= self.low_speed < self.high_speed:
            raise ConfigError(
                "system.campbell: low_speed_rpm must lie between 0 and high_speed_rpm"
            )
        if self.orders is not None and (not self.orders or min(self.orders) <= 0.0):
            raise ConfigError(
                "system.campbell.orders: give orders of the first node, all positive, "
                "such as [1, 2], or null"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class GearHolding:
    """Lateral support of every gear: two bearings, a shaft, a static force, a damping ratio.

    ``force`` None is that on the teeth of each gear under ``torque`` of the first node.
    """

    bearing: BallBearing
    shaft: BearingShaft
    force: float | None = unit("n")
    torque: float | None = unit("nm", default=None)
    damping_ratio: float

    def __post_init__(self) -> None:
        if self.force is not None and not self.force > 0.0:
            raise ConfigError(
                f"system.support.force_n = {self.force:g} must be positive"
            )
        if self.torque is not None and not self.torque > 0.0:
            raise ConfigError(
                f"system.support.torque_nm = {self.torque:g}, "
                "excitation.reference.torque_nm unless given, must be positive"
            )
        if not 0.0 <= self.damping_ratio < 1.0:
            raise ConfigError(
                f"system.support.damping_ratio = {self.damping_ratio:g} must lie in 0..1"
            )

    def force_on(self, base_radius: float, speed_ratio: float) -> float:
        """Static force in N of a gear that turns ``speed_ratio`` times as fast as the first node.

        All of the torque passes through its teeth, which push along the line of action.
        ConfigError where neither force nor torque are given.
        """
        if self.force is not None:
            return self.force
        if self.torque is None:
            raise ConfigError(
                "system.support.force_n = null follows from system.support.torque_nm, which is "
                "null too; give one of them"
            )
        return self.torque / (abs(speed_ratio) * base_radius)

    def for_gear(self, mass: float, force: float, material: Material) -> Support:
        """The support of a gear of ``mass`` in kg under a static ``force`` in N."""
        across, along = support_stiffness(self.bearing, self.shaft, material, force)
        rigid = Support(
            stiffness_x=across, stiffness_y=along, damping_x=0.0, damping_y=0.0
        )
        return rigid.damped(
            Body(mass=mass, inertia=0.0, support=rigid),
            self.damping_ratio,
            self.damping_ratio,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class LineOptions:
    """The keys of a ``system`` that is a drive line."""

    kind: str
    name: str
    shafting_csv: str | None
    gears_csv: str | None
    lateral: bool | None
    viscous_damper_node: int | None
    dampers: tuple[TorsionalDamper, ...]
    record_mesh: tuple[int, ...] | None = None
    motor_node: int | None = None
    load_node: int | None = None
    helical_meshes: str
    backlash: float = unit("um")
    loss_factor: LossFactors
    support: GearHolding
    campbell: Campbell


def read_options(machine: Section) -> LineOptions:
    """The keys of ``system``, typed and checked."""
    held = machine.get("support")
    if not isinstance(held, Mapping):
        raise ConfigError(f"system.support = {held!r} must be a group of keys")
    try:
        bearing = read(BallBearing, held.get("bearing", {}), "bearing")
        shaft = read(BearingShaft, held.get("shaft", {}), "shaft")
    except ConfigError as error:
        raise ConfigError(f"system.support.{error}") from None
    support_values = {
        key: value for key, value in held.items() if key not in ("bearing", "shaft")
    }
    groups: dict[str, Any] = {
        "loss_factor": read(
            LossFactors, machine.get("loss_factor", {}), "system.loss_factor"
        ),
        "campbell": read(Campbell, machine.get("campbell", {}), "system.campbell"),
        "support": read(
            GearHolding, support_values, "system.support", bearing=bearing, shaft=shaft
        ),
        "dampers": _read_dampers(machine.get("dampers", ())),
    }
    line_values = {key: value for key, value in machine.items() if key not in groups}
    options = read(LineOptions, line_values, "system", **groups)
    if options.helical_meshes not in HELICAL_MESHES:
        raise ConfigError(
            f"system.helical_meshes = {options.helical_meshes!r}; allowed: "
            f"{', '.join(HELICAL_MESHES)}"
        )
    if options.backlash < 0.0:
        raise ConfigError(
            f"system.backlash_um = {options.backlash * 1e6:g} must not be negative"
        )
    return options


def _read_dampers(values: Any) -> tuple[TorsionalDamper, ...]:
    """The list ``system.dampers``; their nodes are checked against the line's."""
    if not isinstance(values, list | tuple):
        raise ConfigError(
            f"system.dampers = {values!r} must be a list of dampers, [] for none"
        )
    dampers = []
    for index, keys in enumerate(values):
        where = f"system.dampers[{index}]"
        if not isinstance(keys, Mapping):
            raise ConfigError(f"{where} = {keys!r} must be a group of keys")
        try:
            dampers.append(read(TorsionalDamper, keys, "damper"))
        except ConfigError as error:
            raise ConfigError(f"{where}{str(error).removeprefix('damper')}") from None
    return tuple(dampers)
