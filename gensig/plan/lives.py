"""Lives of a data set's units: each follows a history of loads until failure or the horizon."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.faults.base import require_gears
from gensig.faults.registry import fault_parts, read_faults
from gensig.life.growth import Course, GrowthLaw, grow
from gensig.life.life_options import LifeOptions
from gensig.life.load_history import History, draw_history, given_history
from gensig.life.snapshots import snapshot_times
from gensig.plan.draws import draw_class_faults, draw_points
from gensig.plan.growth_table import LAWS, LifeGears, corners
from gensig.record.inputs import InputReader
from gensig.record.options import GEAR_KEYS, UNIT_LOAD
from gensig.record.streams import Stream, stream
from gensig.systems.base import Machine
from gensig.units import from_si

SPEED, TORQUE = "operating.speed_rpm", "operating.torque_nm"


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """Snapshot of one unit.

    Parameters
    ----------
    unit, label, condition : int    ``label`` is the number of the class; ``condition`` is one of
        the unit's set-points, or the snapshot itself where the machine drifts
    values : configuration key -> value of the machine at this time
    fault : boundary keys
    columns : further columns of its row of the plan
    is_last : bool                  of its life, where the damage is largest
    """

    unit: int
    label: int
    condition: int
    values: dict[str, float]
    fault: dict[str, Any]
    columns: dict[str, Any]
    is_last: bool


def snapshots(reader: InputReader) -> Iterator[Snapshot]:
    """All snapshots of all lives, life by life in order of time.

    Classes are dealt to units in turn, in an order drawn anew for each round, so that no number
    of a unit or gearbox tells the class.

    Raises
    ------
    ConfigError    for a plan that lives cannot follow, and classes that do not grow
    """
    seed, names, options = reader.seed, reader.plan.classes, reader.life
    _refuse_counts(reader)
    n_units = reader.plan.n_units
    machine = reader.machine()
    points = _setpoints(reader)
    n_setpoints = len(points) // n_units
    speed, torque = _speed_and_torque(machine, points, n_units)
    faults = draw_class_faults(reader, np.arange(n_units))
    gears = LifeGears(reader, machine, corners(speed, torque))
    number = 0
    for unit in range(n_units):
        order = stream(seed, Stream.ORDER, unit // len(names)).permutation(len(names))
        label = int(order[unit % len(names)])
        rng = stream(seed, Stream.LIFE, unit)
        past = stream(seed, Stream.LIFE_HISTORY, unit)
        history = _history(options, speed[unit], torque[unit], past)
        history = replace(history, speed=history.speed * machine.ratio)
        life = _life(gears, options, faults[names[label]][unit], history, rng)
        factors = {
            key: float(np.exp(drift.scatter * rng.standard_normal()))
            for key, drift in options.drift.items()
        }
        times = snapshot_times(
            life.course,
            options.snapshot_spacing,
            options.snapshot_count,
            options.snapshot_every,
        )
        for k, running in enumerate(times.tolist()):
            at = life.course.at(running)
            point = unit * n_setpoints + int(life.course.setpoint[at[0]])
            values = dict(points[point])
            for key, drift in options.drift.items():
                factor = drift.factor(running, factors[key])
                values[key] = reader.number(key) * factor
            yield Snapshot(
                unit=unit,
                label=label,
                condition=number if options.drift else point,
                values=values,
                fault=life.fault_at(at),
                columns={"life_id": f"life-{unit:04d}", **life.columns_at(at)},
                is_last=k == len(times) - 1,
            )
            number += 1


@dataclass(frozen=True, slots=True, kw_only=True)
class _Life:
    """Course of one unit with its fault; without a law the unit is healthy all its life.

    Parameters
    ----------
    fault : boundary keys
    loads : of the damaged teeth at every set-point, (mesh,) N m each
    """

    fault: Mapping[str, Any]
    law: GrowthLaw | None
    loads: tuple[Array, ...]
    course: Course

    def fault_at(self, at: tuple[int, float]) -> dict[str, Any]:
        """Boundary keys of the fault at a point of the course."""
        if self.law is None:
            return dict(self.fault)
        grown = self.law.fault(self.course.value("size", at))
        if "kind" in grown:
            return grown
        return {**self.fault, **grown}

    def columns_at(self, at: tuple[int, float]) -> dict[str, Any]:
        """Columns of the plan at a point of the course."""
        course = self.course
        clock = course.value("clock", at)
        remaining = max(float(course.clock[-1]) - clock, 0.0)
        columns: dict[str, Any] = {
            "life_time_h": from_si("time_h", clock),
            "life_cycles": course.value("turns", at),
            "remaining_life_h": from_si("time_h", remaining),
            "life_failed": int(course.has_failed),
            "life_growing": int(course.growing[at[0]]),
        }
        if self.law is not None:
            torque = float(self.loads[int(course.setpoint[at[0]])].max())
            sizes = self.law.measures(course.value("size", at), torque)
            columns |= {f"params/fault.{key}": sizes[key] for key in sizes}
        return columns


def _life(
    gears: LifeGears,
    options: LifeOptions,
    fault: Mapping[str, Any],
    history: History,
    rng: np.random.Generator,
) -> _Life:
    """Life of one unit with a fault given by its boundary keys."""
    growth = options.laws.get(fault["kind"])
    if growth is None:
        rng.standard_normal(2)  # the same draws for every class
        never = np.full((len(history.torque), 1), np.inf)
        course = grow(np.array([0.0, 1.0]), never, history, 0.0)
        return _Life(fault=fault, law=None, loads=(), course=course)
    rate, first = growth.draw(rng)
    defects = read_faults(fault)
    require_gears(defects, tuple(gears.machine.gears))
    (defect,) = defects
    # the law is that of the mesh of the gear, and counts turns of the pinion there
    there, side = gears.of_gear(defect.gear)
    faster = there.machine.ratio / gears.machine.ratio
    damage = replace(defect, gear=side)
    speeds = (history.speed / gears.machine.ratio).tolist()
    points = tuple(zip(speeds, history.torque.tolist(), strict=True))
    unit = LAWS[defect.growth](there, damage, growth, points, first)
    turns = unit.law.turns(unit.loads) / (rate * faster)
    course = grow(unit.law.sizes, turns, history, unit.start)
    return _Life(fault=fault, law=unit.law, loads=unit.loads, course=course)


def _refuse_counts(reader: InputReader) -> None:
    """Raise ConfigError for what a plan of lives does not ask."""
    plan, options = reader.plan, reader.life
    for key in ("n_records", "conditions_per_unit"):
        value = getattr(plan, key)
        if value is not None:
            raise ConfigError(
                f"plan.{key} = {value!r}: lives and their snapshots say how many records "
                "there are; leave it null"
            )
    if plan.n_repeats != 1 or plan.is_grid:
        raise ConfigError(
            "a plan of lives has plan.n_repeats=1 and draws its set-points: plan.design is no grid"
        )
    if plan.n_reference:
        raise ConfigError(
            f"plan.n_reference = {plan.n_reference!r}: lives have no reference records; a "
            "machine is new at its first snapshot: give 0"
        )
    for name, fault in reader.classes.items():
        kinds = {part["kind"] for part in fault_parts(fault)}
        if kinds - options.laws.keys() or len(fault_parts(fault)) > 1:
            grown = ", ".join(("healthy", *options.laws))
            raise ConfigError(
                f"plan.classes: nothing makes {name} grow; this life has {grown}: take "
                "life=mixed, or other classes"
            )
    _refuse_designs(reader)
    for key in options.drift:
        reader.refuse_fixed(key)
        if key in plan.vary or key in (SPEED, TORQUE):
            raise ConfigError(
                f"life.drift: '{key}' is drawn for each set-point already; let one of the two go"
            )


def _refuse_designs(reader: InputReader) -> None:
    """Raise ConfigError for gears that differ between lives or in the course of one."""
    for key in (*reader.plan.vary, *reader.life.drift):
        if key.startswith(GEAR_KEYS):
            raise ConfigError(
                f"'{key}': every life has the gears of the configuration; make a set for each "
                "design with -m"
            )
    if reader.plan.draws_unit_load:
        raise ConfigError(
            f"plan.vary.{TORQUE}: of = '{UNIT_LOAD}': lives draw the torque itself; leave of out"
        )


def _setpoints(reader: InputReader) -> list[dict[str, float]]:
    """Values of every set-point, unit by unit."""
    plan, options = reader.plan, reader.life
    vary = plan.vary
    n_setpoints, given = options.n_setpoints, None
    if options.blocks is not None:
        for key in (SPEED, TORQUE):
            if key in vary:
                raise ConfigError(
                    f"life.blocks gives {key} itself, but the plan varies it; pin it, or take "
                    "plan.vary={}"
                )
        given = given_history(options.blocks, options.horizon)
        n_setpoints = len(given.speed)
    numbers = np.arange(plan.n_units * n_setpoints)
    rng = stream(reader.seed, Stream.CONDITION)
    drawn = draw_points(plan.design, vary, numbers, rng).values(vary)
    points = [{key: float(drawn[key][k]) for key in drawn} for k in numbers.tolist()]
    if given is not None:
        for k, values in enumerate(points):
            values[SPEED] = from_si("speed_rpm", float(given.speed[k % n_setpoints]))
            values[TORQUE] = float(given.torque[k % n_setpoints])
    return points


def _speed_and_torque(
    machine: Machine,
    points: Sequence[Mapping[str, float]],
    n_units: int,
) -> tuple[Array, Array]:
    """Set speeds in rad/s and torques in N m, (unit, setpoint) each."""
    set_speed = from_si("speed_rpm", machine.operating.speed / machine.ratio)
    set_torque = machine.operating.torque
    speed = np.array([values.get(SPEED, set_speed) for values in points])
    torque = np.array([values.get(TORQUE, set_torque) for values in points])
    shape = (n_units, len(points) // n_units)
    return speed.reshape(shape) * (2.0 * np.pi / 60.0), torque.reshape(shape)


def _history(
    options: LifeOptions, speed: Array, torque: Array, rng: np.random.Generator
) -> History:
    if options.blocks is not None:
        return given_history(options.blocks, options.horizon)
    return draw_history(options.drawn, speed, torque, options.horizon, rng)
