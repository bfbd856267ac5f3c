"""The plan: every input of every record, drawn and frozen before anything runs."""

from __future__ import annotations

import copy
import itertools
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.dataset.distributions import GRID, LEVELS, n_levels
from gensig.dataset.plan import Plan, record_ids, shard_places
from gensig.dataset.schema import SCALES, SIGNALS
from gensig.errors import ConfigError
from gensig.faults.base import faulty_teeth
from gensig.faults.registry import fault_parts, read_faults
from gensig.life.life_options import runs_to_failure
from gensig.life.options import read_wear_options
from gensig.mesh.pair_table import check_teeth
from gensig.plan.draws import draw_faults, draw_values, fault_sizes, fault_specs
from gensig.plan.lives import snapshots
from gensig.record.inputs import (
    MISSING,
    Stream,
    read_seed,
    record_system,
    replace_key,
    stream,
    whole_number,
)
from gensig.record.machines import read_machine
from gensig.record.simulate import signal_shapes
from gensig.systems.pair_machine import PairMachine, severity
from gensig.systems.shaft_sensors import SWITCHES
from gensig.units import from_si

SHARD_BYTES = 65_536_000  # 80 records of 4 x 51,200 float32 samples
MOST_IN_GRID = 1_000_000  # records; a product of levels is soon larger than meant
KEYS = (
    "n_records", "n_units", "n_gearboxes", "conditions_per_unit", "n_repeats", "classes", "design", "vary", "sham",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Counts:
    """How many of everything a plan has.

    Attributes
    ----------
    n_conditions : over all units; unit ``condition % n_units`` runs a condition
    condition_points : (condition,) int    point of the grid over ``plan.vary``
    fault_points : (condition,) int        point of the grid over a fault's ``vary``, modulo the size that one has

    Only a grid reads the points: there every unit runs every set-point with every fault.
    """

    n_records: int
    n_units: int
    n_gearboxes: int
    n_repeats: int
    n_conditions: int
    condition_points: NDArray[np.int64]
    fault_points: NDArray[np.int64]


def make_plan(config: Mapping[str, Any]) -> Plan:
    """Draw every input of every record.

    Nested by unit, condition, fault and repeat. What shares a ``condition_id`` is one unit at one set-point: one record
    a class and repeat, in random order within each repeat, so that neither position nor any drawn value tells the
    class. Repeats share the fault too; each has a start and noise of its own.

    Raises
    ------
    ConfigError    for counts, keys or distributions that cannot be used
    """
    _check_plan(config)
    if "wear" in config:  # configurations of earlier data sets have none
        read_wear_options(config["wear"])
    if runs_to_failure(config):
        return _plan_of_lives(config)
    seed, names = read_seed(config), list(config["plan"]["classes"])
    counts = read_counts(config)
    machine = read_machine(config)
    machine.check()
    signal_shapes(config, machine)  # refuses what the machine does not tell
    vary, points = config["plan"]["vary"], counts.condition_points
    conditions = draw_values(config, vary, points, stream(seed, Stream.CONDITION), "plan")
    faults = {
        name: draw_faults(config, fault, counts.fault_points, stream(seed, Stream.FAULT, index))
        for index, (name, fault) in enumerate(config["classes"].items())
    }
    sound = next((name for name in names if not fault_parts(config["classes"][name])), None)
    rows: list[dict[str, Any]] = []
    for condition, repeat in itertools.product(range(counts.n_conditions), range(counts.n_repeats)):
        unit = condition % counts.n_units
        values = {key: drawn[condition] for key, drawn in conditions.items()}
        if repeat == 0:
            system = record_system(config, values)
            system.pair.require_continuous_drive()
        for place in stream(seed, Stream.ORDER, condition * counts.n_repeats + repeat).permutation(len(names)):
            if len(rows) == counts.n_records:
                break
            name = names[place]
            fault = faults[name][condition]
            # The first sound record of a condition starts as the twin that sets the noise does: it is that twin.
            is_twin = name == sound and repeat == 0
            start = stream(seed, Stream.TWIN, condition) if is_twin else stream(seed, Stream.START, len(rows))
            rows.append(
                {
                    "label": int(place),
                    "label_name": name,
                    "unit_id": f"unit-{unit:04d}",
                    "gearbox_id": f"gearbox-{unit % counts.n_gearboxes:04d}",
                    "specimen_id": f"specimen-{unit // counts.n_gearboxes:04d}",
                    "condition_id": f"condition-{condition:06d}",
                    "repeat": repeat,
                    **_row(config, system, fault, values, start),
                }
            )
    return _as_plan(config, rows)


def _plan_of_lives(config: Mapping[str, Any]) -> Plan:
    """One row a snapshot, life by life; every unit has gears of its own, as they fail only once."""
    seed, names = read_seed(config), list(config["plan"]["classes"])
    machine = read_machine(config)
    machine.check()
    machine.pair.require_continuous_drive()
    n_gearboxes = read_gearboxes(config, whole_number("plan.n_units", config["plan"]["n_units"], at_least=1))
    machines: dict[tuple[tuple[str, float], ...], PairMachine] = {}
    rows: list[dict[str, Any]] = []
    for look in snapshots(config):
        drawn = tuple(look.values.items())
        if drawn not in machines:
            machines[drawn] = record_system(config, look.values)
        start = stream(seed, Stream.START, len(rows))
        rows.append(
            {
                "label": look.label,
                "label_name": names[look.label],
                "unit_id": f"unit-{look.unit:04d}",
                "gearbox_id": f"gearbox-{look.unit % n_gearboxes:04d}",
                "specimen_id": f"specimen-{look.unit:04d}",
                "condition_id": f"condition-{look.condition:06d}",
                "repeat": 0,
                **_row(config, machines[drawn], look.fault, look.values, start, is_checked=look.is_last),
                **look.columns,
            }
        )
    return _as_plan(config, rows)


def read_gearboxes(config: Mapping[str, Any], n_units: int) -> int:
    """Number of gearboxes, at most one a unit; about the square root of the units where it is not given."""
    given = config["plan"]["n_gearboxes"]
    asked = round(math.sqrt(n_units)) if given is None else given
    return min(n_units, whole_number("plan.n_gearboxes", asked, at_least=1))


def read_counts(config: Mapping[str, Any]) -> Counts:
    """Check and work out every count of the plan; a grid's from its levels.

    Raises
    ------
    ConfigError    for counts that cannot be used or do not agree
    """
    plan = config["plan"]
    n_classes = len(plan["classes"])
    n_units = whole_number("plan.n_units", plan["n_units"], at_least=1)
    n_gearboxes = read_gearboxes(config, n_units)
    n_repeats = whole_number("plan.n_repeats", plan["n_repeats"], at_least=1)
    per_unit, n_faults = plan["conditions_per_unit"], 1
    if plan["design"] == GRID:
        if per_unit is not None:
            raise ConfigError(f"plan.conditions_per_unit = {per_unit!r}: a grid's levels say how many; leave it null")
        per_unit, n_faults = _grid_size(config)
    n_records = plan["n_records"]
    if n_records is not None:
        whole_number("plan.n_records", n_records, at_least=n_classes)
    if per_unit is None:
        if n_records is None:
            raise ConfigError("plan.n_records = null: give a number, plan.conditions_per_unit, or plan.design=grid")
        n_conditions = math.ceil(n_records / (n_classes * n_repeats))
    else:
        n_conditions = n_units * whole_number("plan.conditions_per_unit", per_unit, at_least=1) * n_faults
        n_records = _fitting(plan, n_conditions * n_classes * n_repeats, (n_units, per_unit, n_faults, n_classes))
    points = np.arange(n_conditions) // n_units
    return Counts(
        n_records=n_records,
        n_units=n_units,
        n_gearboxes=n_gearboxes,
        n_repeats=n_repeats,
        n_conditions=n_conditions,
        condition_points=points // n_faults,
        fault_points=points % n_faults,
    )


def _check_plan(config: Mapping[str, Any]) -> None:
    """Refuse keys that plans of any kind do not have."""
    plan = config["plan"]
    if odd := sorted(set(plan).symmetric_difference(KEYS)):
        raise ConfigError(
            f"plan: {'unknown' if odd[0] in plan else 'missing'} key '{odd[0]}'; it has {', '.join(KEYS)}"
        )
    if not isinstance(plan["sham"], bool):
        raise ConfigError(f"plan.sham = {plan['sham']!r} must be true or false")
    for key in plan["vary"]:
        replace_key(copy.deepcopy(dict(config)), key, 0.0)


def _grid_size(config: Mapping[str, Any]) -> tuple[int, int]:
    """Points of the grid over the conditions, and the least number that the grids of all faults divide."""
    vary = config["plan"]["vary"]
    for key, spec in vary.items():
        if n_levels(f"plan.vary.{key}", spec) is None and LEVELS not in spec:
            raise ConfigError(
                f"plan.vary.{key}: a grid needs its levels: give levels: 4 or so, distribution: choice, or "
                "levels: null to draw it all the same"
            )
    n_faults = [_n_points("fault", specs) for specs in _fault_varies(config).values()]
    return _n_points("plan", vary), math.lcm(*n_faults)


def _n_points(where: str, vary: Mapping[str, Any]) -> int:
    return math.prod(n_levels(f"{where}.vary.{key}", spec) or 1 for key, spec in vary.items())


def _fault_varies(config: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Distributions of the keys of each class."""
    return {name: fault_specs(config, fault)[0] for name, fault in config["classes"].items()}


def describe_design(config: Mapping[str, Any]) -> str:
    """The design in words: of a grid the number of levels of each key, and the keys that are drawn all the same."""
    plan = config["plan"]
    if plan["design"] != GRID:
        return str(plan["design"])
    of_faults = {f"{name}.{key}": spec for name, vary in _fault_varies(config).items() for key, spec in vary.items()}
    keys = {key: n_levels(key, spec) for key, spec in {**plan["vary"], **of_faults}.items()}
    crossed = " x ".join(f"{key} {n}" for key, n in keys.items() if n is not None)
    drawn = ", ".join(key for key, n in keys.items() if n is None)
    return f"grid of {crossed or 'no key'}" + (f"; drawn: {drawn}" if drawn else "")


def _fitting(plan: Mapping[str, Any], n_records: int, counts: tuple[int, ...]) -> int:
    """The number of records that follows from the others, if ``plan.n_records`` has nothing against it."""
    names = ("units", "conditions", "faults", "classes", "repeats")
    product = " x ".join(f"{n:,} {name}" for n, name in zip((*counts, plan["n_repeats"]), names, strict=True) if n > 1)
    told = f"{n_records:,} records ({product})" if product else "1 record"
    if plan["design"] == GRID and n_records > MOST_IN_GRID:
        raise ConfigError(f"the grid has {told}, more than {MOST_IN_GRID:,}; take fewer levels, units or repeats")
    if plan["n_records"] not in (None, n_records):
        raise ConfigError(
            f"plan.n_records = {plan['n_records']}, but the plan has {told}; plan.n_records=null takes them"
        )
    return n_records


def _row(
    config: Mapping[str, Any],
    system: PairMachine,
    fault: dict[str, Any],
    values: dict[str, float],
    start: np.random.Generator,
    *,
    is_checked: bool = True,
) -> dict[str, Any]:
    """Columns of one record that follow from its drawn values; the teeth of one with larger faults need no check."""
    applied = read_faults(fault)
    if is_checked:
        check_teeth(system.pair, system.material, system.mesh, faulty_teeth(system.pair, applied))
    parts = fault_parts(fault)
    return {
        "faults_json": json.dumps(parts, separators=(",", ":")),
        "severity": 0.0 if config["plan"]["sham"] else severity(applied, system.pair),
        "fault_gear": applied[0].gear if applied else "",
        "fault_tooth": applied[0].first_tooth if applied else -1,
        "start_tooth_pinion": (tooth := int(start.integers(system.pair.pinion.n_teeth))),
        "start_tooth_wheel": system.driven_tooth(tooth, int(start.integers(system.pair.wheel.n_teeth))),
        "start_phase": float(start.random()),
        "speed_set_rpm": from_si("speed_rpm", system.operating.speed),
        "torque_nm": system.operating.torque,
        "snr_db": MISSING if system.sensing.snr is None else system.sensing.snr,
        **{f"params/{key}": float(value) for key, value in values.items()},
        **{f"params/fault.{key}": value for key, value in fault_sizes(fault).items()},
    }


def _as_plan(config: Mapping[str, Any], rows: list[dict[str, Any]]) -> Plan:
    """Rows to columns; a parameter that a record has not is NaN. The rows are emptied: nothing is held twice."""
    names: dict[str, None] = {}
    for row in rows:
        names.update(dict.fromkeys(row))
    shard, place = shard_places(len(rows), records_per_shard(config))
    columns: dict[str, Any] = {"record_id": record_ids(len(rows)), "shard": shard, "row": place}
    for name in names:
        columns[name] = np.array([row.pop(name, MISSING) for row in rows])
    return Plan(columns=columns)


def records_per_shard(config: Mapping[str, Any]) -> int:
    """As configured, else about 64 MB of samples."""
    given = config["dataset"]["records_per_shard"]
    if given is not None:
        return whole_number("dataset.records_per_shard", given, at_least=1)
    return max(1, SHARD_BYTES // record_bytes(config))


def record_bytes(config: Mapping[str, Any], *, as_stored: bool = False) -> int:
    """Bytes of one record's samples, ``as_stored`` in the chosen type before compression, else in single precision.

    Shards are cut by the latter, so that how samples are stored does not change a plan.
    """
    bulk = {name: shape for name, shape in signal_shapes(config, read_machine(config)).items() if SIGNALS[name].is_bulk}
    counts = as_stored and config["dataset"]["sample_type"] == "int16"
    return sum(
        math.prod(shape) * (2 if counts and name in SCALES else SIGNALS[name].n_bytes) for name, shape in bulk.items()
    )


def check_switches(config: Mapping[str, Any]) -> None:
    """Raise ConfigError for a switch of ``dataset`` that is neither true nor false."""
    switches = ("clean", "source", "operating", "mesh_state", "detectability", "healthy_twin")
    for key in (*(f"store_{switch}" for switch in switches), *SWITCHES):
        if not isinstance(config["dataset"][key], bool):
            raise ConfigError(f"dataset.{key} = {config['dataset'][key]!r} must be true or false")
