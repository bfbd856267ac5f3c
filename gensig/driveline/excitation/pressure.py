"""Pressure in a cylinder over the cycle: a Wiebe cycle that burns as much as the load needs, or a
measured one.

I. I. Wiebe (1956); J. B. Heywood, Internal Combustion Engine Fundamentals (1988), sections 9.2
and 10.4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gensig.arrays import Array
from gensig.driveline.excitation.cycle import CYCLE, Cylinder, cycle_angles
from gensig.errors import ConfigError
from gensig.text.user_file import check_columns, read_table
from gensig.units import UNITS, split_unit, to_si, unit

BURNED = -math.log(
    1e-3
)  # Wiebe's exponent: 99.9 % at the end of combustion, by definition
WIDEST_GAP = math.radians(10.0)  # between points of a measured pressure
LEAST_POINTS = 100
FILE_KEY = "excitation.pressure.file"


@dataclass(frozen=True, slots=True, kw_only=True)
class WiebeCycle:
    """Polytropic compression and expansion with one exponent, heat released by Wiebe's law
    between two angles.

    Boost above ambient is that at the reference point times the share of brake power; the
    exhaust's is a share of it. Angles are degrees of the crank after firing top dead center.
    ``blowdown_angle`` is that over which the pressure above the exhaust's falls to 1/e after the
    exhaust opens.
    """

    boost_pressure: float = unit("mpa")
    exhaust_share: float
    ambient_pressure: float = unit("mpa")
    exponent: float
    combustion_begin: float = unit("deg")
    combustion_duration: float = unit("deg")
    shape: float
    exhaust_opening: float = unit("deg")
    blowdown_angle: float = unit("deg")
    intake_closing: float = unit("deg")

    def __post_init__(self) -> None:
        group = "excitation.pressure"
        if not 0.0 < self.ambient_pressure <= self.boost_pressure:
            given = ", ".join(
                f"{value * 1e-6:g}"
                for value in (self.ambient_pressure, self.boost_pressure)
            )
            raise ConfigError(
                f"{group}: 0 < ambient_pressure_mpa <= boost_pressure_mpa is needed, not {given}"
            )
        for key, value, low, high in (
            ("exhaust_share", self.exhaust_share, 0.0, 2.0),
            ("exponent", self.exponent, 1.1, 1.67),
            ("shape", self.shape, 0.1, 10.0),
            ("combustion_begin_deg", math.degrees(self.combustion_begin), -60.0, 60.0),
            (
                "combustion_duration_deg",
                math.degrees(self.combustion_duration),
                5.0,
                150.0,
            ),
            ("exhaust_opening_deg", math.degrees(self.exhaust_opening), 90.0, 180.0),
            ("blowdown_angle_deg", math.degrees(self.blowdown_angle), 1.0, 60.0),
            ("intake_closing_deg", math.degrees(self.intake_closing), -180.0, -90.0),
        ):
            if not low - 1e-9 <= value <= high + 1e-9:
                raise ConfigError(
                    f"{group}.{key} = {value:g} must lie in {low:g}..{high:g}"
                )
        if (
            self.combustion_begin + self.combustion_duration
            > self.exhaust_opening + 1e-9
        ):
            end = math.degrees(self.combustion_begin + self.combustion_duration)
            raise ConfigError(
                f"{group}: combustion ends {end:g} degrees after top dead center, "
                "past exhaust_opening_deg = "
                f"{math.degrees(self.exhaust_opening):g}; shorten combustion_duration_deg"
            )

    def gas_exchange(self, power_share: float) -> tuple[float, float]:
        """Boost and exhaust pressure, Pa, at a share of the reference point's brake power."""
        above = (self.boost_pressure - self.ambient_pressure) * min(
            max(power_share, 0.0), 1.2
        )
        return (
            self.ambient_pressure + above,
            self.ambient_pressure + self.exhaust_share * above,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class PressureFile:
    """A CSV file with columns ``crank_angle_deg`` (0 at firing top dead center) and
    ``pressure_mpa`` (absolute).
    """

    file: str


def wiebe_parts(
    cycle: WiebeCycle, cylinder: Cylinder, n_points: int, power_share: float
) -> tuple[Array, Array]:
    """Pressure without combustion, Pa, and the pressure that each joule of heat adds, Pa/J, both
    (point,).

    Notes
    -----
    First law with one exponent, dp = -n p dV/V + (n - 1) dQ/V, is linear in the heat:
    d(p V^n) = (n - 1) V^(n-1) dQ. So p = p_motored + Q p_unit, and the heat follows from the
    work that is wanted without iteration. After the exhaust opens the pressure falls
    exponentially to the exhaust's; from gas-exchange top dead center on it is the boost. Heat
    is net: what the walls take is left out of it.
    """
    boost, exhaust = cycle.gas_exchange(power_share)
    angle = cycle_angles(n_points)
    after = np.where(angle >= 0.5 * CYCLE, angle - CYCLE, angle)  # -2 pi .. 2 pi
    order = np.argsort(after)
    rising = after[order]
    volume = cylinder.volume(rising)
    closing = float(cylinder.volume(np.array([cycle.intake_closing]))[0])
    motored = boost * (closing / volume) ** cycle.exponent
    share = np.clip(
        (rising - cycle.combustion_begin) / cycle.combustion_duration, 0.0, 1.0
    )
    burned = -np.expm1(-BURNED * share ** (cycle.shape + 1.0)) / -math.expm1(-BURNED)
    weight = volume ** (cycle.exponent - 1.0)
    steps = 0.5 * (weight[1:] + weight[:-1]) * np.diff(burned)
    fired = (
        (cycle.exponent - 1.0)
        * np.concatenate([[0.0], np.cumsum(steps)])
        / volume**cycle.exponent
    )
    opened = rising > cycle.exhaust_opening
    fall = np.exp(-(rising - cycle.exhaust_opening) / cycle.blowdown_angle)
    last = np.flatnonzero(~opened)[-1]
    motored = np.where(opened, exhaust + (motored[last] - exhaust) * fall, motored)
    motored = np.where(rising < cycle.intake_closing, boost, motored)
    fired = np.where(opened, fired[last] * fall, fired)
    back = np.argsort(order)
    return motored[back], fired[back]


@lru_cache(maxsize=4)
def read_pressure(given: PressureFile, n_points: int) -> Array:
    """A measured pressure over the cycle, (point,) Pa, straight between its points.

    Raises
    ------
    ConfigError    for columns without a unit or unknown ones, angles that do not rise, leave a
                   gap or pass the cycle, and pressures that are not positive
    """
    names, values = read_table(FILE_KEY, given.file, least_rows=LEAST_POINTS)
    where = f"{FILE_KEY} = {given.file}"
    bare = [split_unit(name)[0] for name in names]
    check_columns(FILE_KEY, given.file, bare, ["crank_angle", "pressure"])
    columns = {}
    for quantity, kind, example in (
        ("crank_angle", "angle", "deg"),
        ("pressure", "stress", "mpa"),
    ):
        name = names[bare.index(quantity)]
        suffix = split_unit(name)[1]
        if suffix is None or UNITS[suffix][1] != kind:
            raise ConfigError(
                f"{where}: column {name} has no unit that fits; write {quantity}_{example}"
            )
        columns[quantity] = np.array(
            [to_si(name, float(value)) for value in values[names.index(name)]]
        )
    angle, pressure = columns["crank_angle"], columns["pressure"]
    gaps = np.diff(np.append(angle, angle[0] + CYCLE))
    if not np.all(gaps[:-1] > 0.0):
        row = int(np.argmin(gaps[:-1] > 0.0)) + 3
        raise ConfigError(f"{where}: row {row}, crank_angle must rise from row to row")
    if gaps[-1] < -1e-9 * CYCLE:
        raise ConfigError(
            f"{where}: crank_angle runs over {math.degrees(CYCLE - gaps[-1]):g} "
            "degrees, at most 720"
        )
    if gaps.max() > WIDEST_GAP:
        row = int(np.argmax(gaps)) + 2
        raise ConfigError(
            f"{where}: {math.degrees(gaps.max()):.4g} degrees without a point after "
            f"row {row}; the whole cycle of 720 "
            f"degrees is needed, at most {math.degrees(WIDEST_GAP):g} between points"
        )
    if not np.all(pressure > 0.0):
        raise ConfigError(
            f"{where}: row {int(np.argmax(pressure <= 0.0)) + 2}, pressure is absolute and positive"
        )
    if gaps[-1] < 1e-9 * CYCLE:  # both ends of the cycle are given: they are one
        angle, pressure = angle[:-1], pressure[:-1]
    return np.interp(cycle_angles(n_points), angle, pressure, period=CYCLE)
