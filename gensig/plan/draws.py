"""Draws of a plan: values of varied keys, and whole faults with their sizes."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gensig.arrays import Array, Integers
from gensig.dataset.distributions import (
    GRID,
    Distribution,
    design_points,
    read_distribution,
)
from gensig.errors import ConfigError
from gensig.faults.base import require_gears
from gensig.faults.registry import COMPOUND, fault_parts, read_faults
from gensig.geometry.contact import SIDES
from gensig.geometry.tooth_profile import root_curve_point
from gensig.plan.tooth_reach import tooth_reach
from gensig.plan.unit_designs import unit_load_torque
from gensig.record.inputs import InputReader
from gensig.record.options import AS_GIVEN, DRAWN, TORQUE_KEY
from gensig.record.streams import Stream, stream
from gensig.units import from_si, split_unit, to_si

# Keys of a distribution that are multiplied by a size where they are shares of it.
SCALED = ("low", "high", "mean", "std", "values")


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnPoints:
    """Points of varied keys before they are values of their distributions, (condition,) each.

    Attributes
    ----------
    shares : points of the unit interval of the keys that are drawn
    levels : numbers of the levels of the keys that a grid crosses
    """

    shares: Mapping[str, Array]
    levels: Mapping[str, Integers]

    def values(
        self, vary: Mapping[str, Distribution], conditions: slice = slice(None)
    ) -> dict[str, list[Any]]:
        """Values of every key at the points of some conditions."""
        values: dict[str, list[Any]] = {}
        for key, distribution in vary.items():
            if key in self.shares:
                values[key] = distribution.values_at(self.shares[key][conditions])
                continue
            levels = distribution.level_values()
            values[key] = [levels[k] for k in self.levels[key][conditions].tolist()]
        return values


def draw_points(
    design: str,
    vary: Mapping[str, Distribution],
    points: Integers,
    rng: np.random.Generator,
) -> DrawnPoints:
    """Points of every varied key.

    In a grid a key with levels has that of the condition's point, the first key slowest. All others
    are drawn together from one space-filling design.
    """
    crossed = [key for key in vary if design == GRID and vary[key].levels]
    drawn = [key for key in vary if key not in crossed]
    shares = design_points(design, len(points), len(drawn), rng)
    levels, step = {}, 1
    for key in reversed(crossed):
        levels[key] = points // step % vary[key].levels
        step *= vary[key].levels
    return DrawnPoints(
        shares={key: shares[:, k] for k, key in enumerate(drawn)}, levels=levels
    )


def fault_sizes(fault: Mapping[str, Any]) -> dict[str, float]:
    """Numbers of a fault by key; the keys of a compound fault begin with the part's number."""
    sizes = {
        key: float(value)
        for key, value in fault.items()
        if isinstance(value, int | float) and key != "tooth"
    }
    for number, part in enumerate(fault.get("parts", ())):
        of_part = fault_sizes(part)
        sizes |= {f"parts.{number}.{key}": of_part[key] for key in of_part}
    return sizes


def fault_specs(
    reader: InputReader, fault: Mapping[str, Any]
) -> tuple[dict[str, Distribution], dict[str, tuple[int, str]]]:
    """Distributions of a fault by name, and the part and key that each is of.

    Raises
    ------
    FaultError     for a gear that the machine does not have
    ConfigError    for a key or a distribution that cannot be drawn
    """
    require_gears(read_faults(fault), machine_gears(reader))
    specs: dict[str, Distribution] = {}
    parts: dict[str, tuple[int, str]] = {}
    for number, part in enumerate(fault_parts(fault)):
        for key, spec in (part.get("vary") or {}).items():
            if key == "gear":
                raise ConfigError(
                    "fault.vary.gear: plans draw gears by plan.fault_gear: drawn, or a list such "
                    "as [pinion,wheel]"
                )
            if key not in part or key == "vary":
                raise ConfigError(
                    f"fault.vary: '{key}' is no key of fault={part['kind']}"
                )
            name = f"parts.{number}.{key}" if fault["kind"] == COMPOUND else key
            scaled = _for_gear(reader, part, key, spec)
            specs[name] = read_distribution(f"fault.vary.{name}", scaled)
            parts[name] = (number, key)
    return specs, parts


def draw_class_faults(
    reader: InputReader,
    points: Integers,
    of_units: Sequence[InputReader] = (),
) -> dict[str, list[dict[str, Any]]]:
    """Faults of every class by its name, one a condition.

    ``of_units`` are the readers of the units, which the conditions take in turn, where
    units differ. Where the plan draws the gear, a condition has the fault of the option as if that
    gear were given: the sizes of all gears are at the same points of their distributions.
    """
    of_units = of_units or (reader,)
    gears = drawn_gears(reader)
    faults = {}
    for index, (name, fault) in enumerate(reader.classes.items()):
        rng = stream(reader.seed, Stream.FAULT, index)
        if not gears:
            faults[name] = draw_faults(of_units, fault, points, rng)
            continue
        of_gear = [
            draw_faults(of_units, _on_gear(fault, gear), points, copy.deepcopy(rng))
            for gear in gears
        ]
        drawn = stream(reader.seed, Stream.FAULT_GEAR, index).integers(
            len(gears), size=len(points)
        )
        faults[name] = [of_gear[k][i] for i, k in enumerate(drawn.tolist())]
    return faults


def drawn_gears(reader: InputReader) -> tuple[str, ...]:
    """Gears out of which a plan draws that of each condition's faults; none where it is given.

    All gears of the machine, or those that ``plan.fault_gear`` lists. In lives of a drive line
    damage grows on its spur gears.

    Raises
    ------
    ConfigError    for a listed gear that the machine does not have
    """
    chosen = reader.plan.fault_gear
    if chosen == AS_GIVEN:
        return ()
    allowed = machine_gears(reader)
    if reader.runs_to_failure and reader.is_line:
        gears = reader.machine().gears
        allowed = tuple(name for name in allowed if gears[name].helix_angle == 0.0)
    if chosen == DRAWN:
        return allowed
    for gear in chosen:
        if gear not in allowed:
            raise ConfigError(
                f"plan.fault_gear lists {gear!r}; allowed: {', '.join(allowed)}"
            )
    return tuple(chosen)


def machine_gears(reader: InputReader) -> tuple[str, ...]:
    """Names of all gears of the machine."""
    if not reader.is_line:
        return SIDES
    return tuple(reader.machine().gears)


def _on_gear(fault: Mapping[str, Any], gear: str) -> dict[str, Any]:
    """The fault, or all parts of a compound one, on a gear."""
    parts = [{**part, "gear": gear} for part in fault_parts(fault)]
    if fault["kind"] == COMPOUND:
        return {**fault, "parts": parts}
    return parts[0] if parts else dict(fault)


def draw_faults(
    of_units: Sequence[InputReader],
    fault: Mapping[str, Any],
    points: Integers,
    rng: np.random.Generator,
) -> list[dict[str, Any]]:
    """One complete fault a condition, its severity distribution drawn.

    One design for all parts of a compound fault and all units: the sizes of each unit's gears
    decide only what the points mean.
    """
    drawn: DrawnPoints | None = None
    faults: list[dict[str, Any]] = [{}] * len(points)
    for unit, reader in enumerate(of_units):
        specs, part_keys = fault_specs(reader, fault)
        if drawn is None:
            drawn = draw_points(reader.plan.design, specs, points, rng)
        conditions = slice(unit, None, len(of_units))
        values = drawn.values(specs, conditions)
        faults[conditions] = _whole_faults(
            fault, values, part_keys, len(points[conditions])
        )
    return faults


def _whole_faults(
    fault: Mapping[str, Any],
    drawn: Mapping[str, list[Any]],
    part_keys: Mapping[str, tuple[int, str]],
    n_faults: int,
) -> list[dict[str, Any]]:
    """Complete faults, each with its drawn values."""
    faults: list[dict[str, Any]] = []
    for condition in range(n_faults):
        parts = [dict(part) for part in fault_parts(fault)]
        for part in parts:
            part.pop("vary", None)
        for name, values in drawn.items():
            number, key = part_keys[name]
            parts[number][key] = values[condition]
        whole = {"kind": fault["kind"], "parts": parts}
        if fault["kind"] != COMPOUND:
            whole = parts[0] if parts else dict(fault)
        faults.append(whole)
    return faults


def _gear_sizes(reader: InputReader, gear: str) -> tuple[int, dict[str, float]]:
    """Teeth of a gear, and the sizes in mm that a fault may be a share of."""
    if not reader.is_line:
        group = reader.parts.gear
        module, values = group["normal_module_mm"], group[gear]
        sizes = {"normal_module": module, "face_width": values["face_width_mm"]}
        return values["n_teeth"], sizes
    in_table = reader.machine().gears[gear]
    return in_table.n_teeth, {
        name: from_si("size_mm", getattr(in_table, name))
        for name in ("normal_module", "face_width")
    }


def _root_chord(reader: InputReader, gear: str) -> float:
    """Thickness of a gear's tooth in the middle of its root curve, where cracks begin, m."""
    if reader.is_line:
        gears = reader.machine().gears
    else:
        gears = reader.parts.pair.gears
    return 2.0 * root_curve_point(gears[gear], "arc_mid")[1]


def _least_reach(reader: InputReader, gear: str) -> float:
    """Distance that a tooth may stand back and still touch under a plan's least torque, m."""
    plan, values = reader.plan, {}
    if TORQUE_KEY in plan.vary:
        torque = plan.vary[TORQUE_KEY].least
        if plan.draws_unit_load:
            torque *= unit_load_torque(reader.parts.pair)
        values[TORQUE_KEY] = torque
    return tooth_reach(reader.machine(values), gear)


def _for_gear(reader: InputReader, part: Mapping[str, Any], key: str, spec: Any) -> Any:
    """A distribution of a fault's key in the sizes of its gear.

    ``distribution: tooth`` becomes one over the gear's teeth, shares ``of`` a size become lengths.
    """
    if not isinstance(spec, Mapping):
        return spec
    limits = [name for name in CEILINGS if name in spec]
    if spec.get("distribution") != "tooth" and "of" not in spec and not limits:
        return spec
    gear = part["gear"]
    n_teeth, sizes = _gear_sizes(reader, gear)
    if spec.get("distribution") == "tooth":
        return {**spec, "distribution": "integers", "low": 0, "high": n_teeth - 1}
    unit = split_unit(key)[1]
    drawn = dict(spec)
    size = 1.0
    if "of" in drawn:
        if spec["of"] not in sizes or unit not in ("mm", "um"):
            raise ConfigError(
                f"fault.vary.{key}: of = {spec['of']!r}; a length may be drawn as a share of "
                f"{', '.join(sizes)}"
            )
        size = from_si(key, to_si("size_mm", sizes[drawn.pop("of")]))
    shares = {name: drawn.pop(name) for name in limits}
    try:
        for name in SCALED:
            if isinstance(drawn.get(name), list):
                drawn[name] = [value * size for value in drawn[name]]
            elif name in drawn:
                drawn[name] *= size
        for name, share in shares.items():
            highest = from_si(key, share * CEILINGS[name](reader, gear))
            drawn["high"] = min(drawn["high"], highest)
        return drawn
    except (KeyError, TypeError):
        raise ConfigError(
            f"fault.vary.{key}: {', '.join([*SCALED, *shares])} must be numbers, or lists of "
            "them" + ", with high" * bool(shares)
        ) from None


# Keys that limit the highest value: to a share of the root chord of the faulted gear, or of the
# distance that its teeth may stand back and still touch.
CEILINGS: dict[str, Callable[[InputReader, str], float]] = {
    "at_most_of_root_chord": _root_chord,
    "at_most_of_reach": _least_reach,
}
