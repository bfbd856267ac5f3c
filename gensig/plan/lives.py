"""The lives of the units of a data set: each under its own history, looked at until it fails or the horizon comes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.dataset.distributions import GRID
from gensig.errors import ConfigError
from gensig.faults.crack import Crack
from gensig.faults.pitting import DistributedPitting
from gensig.faults.registry import fault_parts, read_faults
from gensig.life.crack_growth import CrackGrowth, CrackGrowthOptions
from gensig.life.growth import Course, GrowthLaw, grow
from gensig.life.life_options import LifeOptions, WearGrowthOptions, read_life
from gensig.life.load_history import History, draw_history, given_history
from gensig.life.pit_growth import PitGrowthOptions
from gensig.life.snapshots import snapshot_times
from gensig.life.wear.wear_growth import WearGrowth, WearTable, wear_table
from gensig.options.configuration import Configuration, whole_number
from gensig.plan.draws import draw_faults, draw_values
from gensig.record.machines import read_machine
from gensig.record.streams import Stream, stream
from gensig.record.vibration_limit import limited_by_vibration
from gensig.systems.growth_laws import crack_law, pit_law
from gensig.systems.pair_machine import PairMachine
from gensig.systems.registry import LINE
from gensig.systems.wear import read_wear_case, wear_fault
from gensig.units import from_si

Array = NDArray[np.float64]

SPEED, TORQUE = "operating.speed_rpm", "operating.torque_nm"
HEALTHY = {"kind": "healthy"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """One look at one unit.

    Parameters
    ----------
    unit, label, condition : int    ``label`` is the place of the class; ``condition`` is one of the unit's set-points,
        or the snapshot itself where the machine drifts
    values : configuration key -> value of the machine at this time
    fault : boundary keys
    columns : what else its row of the plan has
    is_last : bool                  of its life, where the damage is largest
    """

    unit: int
    label: int
    condition: int
    values: dict[str, float]
    fault: dict[str, Any]
    columns: dict[str, Any]
    is_last: bool


def snapshots(config: Configuration) -> Iterator[Snapshot]:
    """All looks at all lives, life by life in order of time.

    Classes are dealt to units in turn, in an order drawn anew for each round, so that no number of a unit or gearbox
    tells the class.

    Raises
    ------
    ConfigError    for a plan that lives cannot follow, and classes that do not grow
    """
    seed, options, names = config.seed, read_life(config["life"]), list(config["plan"]["classes"])
    n_units = _checked_units(config, options)
    machine = read_machine(config)
    points = _setpoints(config, options, n_units)
    n_setpoints = len(points) // n_units
    torque = np.array([one.get(TORQUE, machine.operating.torque) for one in points]).reshape(n_units, n_setpoints)
    set_speed = from_si("speed_rpm", machine.operating.speed / machine.ratio)
    speed = np.array([one.get(SPEED, set_speed) for one in points])
    speed = speed.reshape(torque.shape) * (2.0 * np.pi / 60.0)
    faults = {
        name: draw_faults(config, config["classes"][name], np.arange(n_units), stream(seed, Stream.FAULT, index))
        for index, name in enumerate(names)
    }
    laws = _Laws(config, options, machine, float(torque.min()), float(torque.max()))
    number = 0
    for unit in range(n_units):
        label = int(stream(seed, Stream.ORDER, unit // len(names)).permutation(len(names))[unit % len(names)])
        fault, rng = faults[names[label]][unit], stream(seed, Stream.LIFE, unit)
        past = stream(seed, Stream.LIFE_HISTORY, unit)
        history = _history(options, speed[unit], torque[unit], past)
        history = replace(history, speed=history.speed * machine.ratio)
        law, loads, course = laws.live(fault, history, rng)
        drifts = {key: float(np.exp(one.scatter * rng.standard_normal())) for key, one in options.drift.items()}
        times = snapshot_times(course, options.snapshot_spacing, options.snapshot_count, options.snapshot_every)
        for k, running in enumerate(times.tolist()):
            place = course.at(running)
            setpoint, size = int(course.setpoint[place[0]]), course.value("size", place)
            values = dict(points[unit * n_setpoints + setpoint])
            for key, drift in options.drift.items():
                values[key] = _number(config, key, values) * drift.factor(running, drifts[key])
            told = {} if law is None else law.told(size, float(loads[setpoint].max()))
            grown = {} if law is None else law.fault(size)
            clock = course.value("clock", place)
            yield Snapshot(
                unit=unit,
                label=label,
                condition=number if options.drift else unit * n_setpoints + setpoint,
                values=values,
                fault=grown if "kind" in grown else {**fault, **grown},
                columns={
                    "life_id": f"life-{unit:04d}",
                    "life_time_h": from_si("time_h", clock),
                    "life_cycles": course.value("turns", place),
                    "remaining_life_h": from_si("time_h", max(float(course.clock[-1]) - clock, 0.0)),
                    "life_failed": int(course.has_failed),
                    "life_growing": int(course.growing[place[0]]),
                    **{f"params/fault.{key}": value for key, value in told.items()},
                },
                is_last=k == len(times) - 1,
            )
            number += 1


class _Laws:
    """The laws of a plan, each worked out once for the gears and shapes that it depends on."""

    def __init__(
        self, config: Configuration, options: LifeOptions, machine: PairMachine, least: float, greatest: float
    ) -> None:
        self.options, self.machine = options, machine
        self._cracks: dict[Crack, CrackGrowth] = {}
        self._table: WearTable | None = None
        self._config, self._torques = config, (least, greatest)
        self._loads: dict[tuple[float, float], Array] = {}

    def live(
        self, fault: Mapping[str, Any], history: History, rng: np.random.Generator
    ) -> tuple[GrowthLaw | None, list[Array], Course]:
        """Law, loads of a tooth at every set-point in N m, and course of one unit; without a law the unit is sound all
        its life."""
        own = self.options.laws.get(fault["kind"])
        if own is None:  # the same draws for every class
            rng.standard_normal(2)
            return None, [], grow(np.array([0.0, 1.0]), np.full((len(history.torque), 1), np.inf), history, 0.0)
        rate, first = own.spread.draw(rng)
        law, start = self._law(fault, history, first)
        loads = [self._met(*point) for point in zip(history.speed.tolist(), history.torque.tolist(), strict=True)]
        return law, loads, grow(law.sizes, law.turns(loads) / rate, history, start)

    def _met(self, speed: float, torque: float) -> Array:
        """Loads that a tooth meets at a set-point, (mesh,) N m."""
        if (speed, torque) not in self._loads:
            self._loads[speed, torque] = self.machine.mesh_torques(speed, torque)
        return self._loads[speed, torque]

    def _law(self, fault: Mapping[str, Any], history: History, first: float) -> tuple[GrowthLaw, float]:
        """The law of a fault and the size at which it begins."""
        own, (made,) = self.options.laws[fault["kind"]], read_faults(fault)
        pair = self.machine.pair
        if isinstance(own, CrackGrowthOptions):
            assert isinstance(made, Crack)
            shape = _like(made)
            if shape not in self._cracks:
                self._cracks[shape] = crack_law(self.machine, shape, own, self._torques)
            law = self._cracks[shape]
            gear = {"pinion": pair.pinion, "wheel": pair.wheel}[made.gear]
            return law, own.start_share * first * made.root_chord(gear)
        if isinstance(own, PitGrowthOptions):
            assert isinstance(made, DistributedPitting)
            return pit_law(self.machine, made, own, first, self._torques), 0.0
        assert isinstance(own, WearGrowthOptions)
        if self._table is None:
            sound = self._config.with_entries(fault=HEALTHY)
            limited, _ = limited_by_vibration(read_wear_case(sound), sound)
            self._table = wear_table(limited, *self._torques)
        case = self._table.lives[0].case
        mean = float(np.exp(np.log(history.torque).mean()))
        return WearGrowth(table=self._table, torque=mean, as_fault=lambda depth: wear_fault(case, depth)), 0.0


def _like(crack: Crack) -> Crack:
    """What its law depends on: neither tooth nor size."""
    return Crack(
        gear=crack.gear,
        tooth=0,
        crack_depth=0.0,
        crack_angle=crack.crack_angle,
        crack_start=crack.crack_start,
        crack_side=crack.crack_side,
    )


def _checked_units(config: Configuration, options: LifeOptions) -> int:
    """Number of lives; refuses what a plan of lives does not ask."""
    plan = config["plan"]
    for key in ("n_records", "conditions_per_unit"):
        if plan[key] is not None:
            raise ConfigError(
                f"plan.{key} = {plan[key]!r}: lives and their snapshots say how many records there are; leave it null"
            )
    if plan["n_repeats"] != 1 or plan["design"] == GRID:
        raise ConfigError("a plan of lives has plan.n_repeats=1 and draws its set-points: plan.design is no grid")
    for name, fault in config["classes"].items():
        kinds = {part["kind"] for part in fault_parts(fault)}
        if kinds - set(options.laws) or len(fault_parts(fault)) > 1:
            grown = ", ".join(("healthy", *options.laws))
            raise ConfigError(
                f"plan.classes: nothing makes {name} grow; this life has {grown}: take life=mixed, or other classes"
            )
        if config["system"]["kind"] == LINE and "wear" in kinds:
            raise ConfigError(
                f"plan.classes: {name}: wear is not followed on a drive line; take life=crack_growth or life=pit_growth"
            )
    for key in options.drift:
        config.with_values({key: 0.0})  # refuses keys that cannot drift
        if key in plan["vary"] or key in (SPEED, TORQUE):
            raise ConfigError(f"life.drift: '{key}' is drawn for each set-point already; let one of the two go")
    return whole_number("plan.n_units", plan["n_units"], at_least=1)


def _setpoints(config: Configuration, options: LifeOptions, n_units: int) -> list[dict[str, float]]:
    """Values of every set-point of every unit, those of a unit beside each other."""
    vary = config["plan"]["vary"]
    blocks = options.blocks
    if blocks is not None and (drawn := sorted({SPEED, TORQUE} & set(vary))):
        raise ConfigError(
            f"life.blocks gives {drawn[0]} itself, but the plan varies it; pin it, or take plan.vary={{}}"
        )
    given = None if blocks is None else given_history(blocks, options.horizon)
    n_setpoints = options.n_setpoints if given is None else len(given.speed)
    points = np.arange(n_units * n_setpoints)
    drawn_values = draw_values(config, vary, points, stream(config.seed, Stream.CONDITION), "plan")
    found = [{key: float(values[k]) for key, values in drawn_values.items()} for k in points.tolist()]
    if given is not None:
        for k, values in enumerate(found):
            values[SPEED] = from_si("speed_rpm", float(given.speed[k % n_setpoints]))
            values[TORQUE] = float(given.torque[k % n_setpoints])
    return found


def _history(options: LifeOptions, speed: Array, torque: Array, rng: np.random.Generator) -> History:
    if options.blocks is not None:
        return given_history(options.blocks, options.horizon)
    return draw_history(options.drawn, speed, torque, options.horizon, rng)


def _number(config: Configuration, key: str, values: Mapping[str, float]) -> float:
    """A number of the configuration as the set-point has it."""
    if key in values:
        return values[key]
    node: Any = config
    for name in key.split("."):
        node = node[name]
    return float(node)
