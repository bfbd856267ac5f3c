"""The plan: every input of every record, drawn and frozen before anything runs."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gensig.arrays import Integers
from gensig.dataset.columns import IS_REFERENCE
from gensig.dataset.distributions import LATIN_HYPERCUBE, Distribution
from gensig.dataset.plan import Plan, record_ids, shard_rows
from gensig.dataset.schema import SCALES, signal_column
from gensig.errors import ConfigError
from gensig.faults.base import faulty_teeth, require_size
from gensig.faults.registry import fault_parts, read_faults
from gensig.mesh.pair_table import check_teeth
from gensig.options.configuration import Configuration
from gensig.plan.draws import (
    draw_class_faults,
    draw_points,
    drawn_gears,
    fault_sizes,
    fault_specs,
)
from gensig.plan.lives import snapshots
from gensig.plan.unit_designs import UnitDesigns, check_designs, draw_designs
from gensig.record.inputs import MISSING, InputReader, draw_start
from gensig.record.options import TORQUE_KEY, PlanOptions
from gensig.record.simulate import gear_columns, signal_shapes
from gensig.record.streams import Stream, stream
from gensig.systems.base import Machine
from gensig.systems.pair_machine import severity
from gensig.units import from_si

# Records of a shard where the number is not given: small shards keep a few workers busy to the
# end, a large set has few files, and every worker builds its shard in memory.
LEAST_IN_SHARD, MOST_SHARDS, MOST_SHARD_BYTES = 24, 1000, 500_000_000
LANES = 8  # records that are integrated together; whole groups of them cost least
MOST_IN_GRID = 1_000_000  # records; a product of levels is soon larger than meant
COUNT_BYTES = 2  # of a sample stored as an int16 count


@dataclass(frozen=True, slots=True, kw_only=True)
class Counts:
    """Numbers of records, units, repeats and conditions of a plan.

    Attributes
    ----------
    n_conditions : over all units; unit ``condition % n_units`` runs a condition
    condition_points : (condition,) int    point of the grid over ``plan.vary``
    fault_points : (condition,) int        point of the grid over a fault's ``vary``, modulo the
        size that one has

    Only a grid reads the points: there every unit runs every set-point with every fault.
    """

    n_records: int
    n_units: int
    n_repeats: int
    n_conditions: int
    condition_points: Integers
    fault_points: Integers


def make_plan(config: Configuration) -> Plan:
    """Draw every input of every record.

    Nested by unit, condition, fault and repeat. Records that share a ``condition_id`` are of one
    unit at one set-point: one record a class and repeat, in random order within each repeat, so
    that neither position nor any drawn value tells the class. Repeats share the fault too; each
    has a start and noise of its own.

    Raises
    ------
    ConfigError    for counts, keys or distributions that cannot be used
    """
    reader = InputReader(config)
    options = reader.plan
    for key in options.vary:
        reader.refuse_fixed(key)
    if "wear" in config:  # configurations of earlier data sets have none
        _ = reader.wear  # refused where its values make none
    if reader.runs_to_failure:
        return _plan_of_lives(reader)
    check_designs(reader)
    seed, names = reader.seed, options.classes
    counts = count_records(reader)
    machine = reader.machine()
    machine.check()
    signal_shapes(reader)  # refuses what the machine does not tell
    sound = [name for name in names if not fault_parts(reader.classes[name])]
    if options.n_reference and not sound:
        raise ConfigError(
            f"plan.n_reference = {options.n_reference}: reference records are healthy, but no "
            f"class of plan.classes [{', '.join(names)}] is; add healthy, or give 0"
        )
    rng = stream(seed, Stream.CONDITION)
    vary = options.condition_vary
    drawn_points = draw_points(options.design, vary, counts.condition_points, rng)
    conditions = drawn_points.values(vary)
    designs = draw_designs(reader, min(counts.n_units, counts.n_conditions))
    faults = draw_class_faults(reader, counts.fault_points, designs.readers(reader))
    rows: list[dict[str, Any]] = []
    for condition, repeat in itertools.product(
        range(counts.n_conditions), range(counts.n_repeats)
    ):
        unit = condition % counts.n_units
        specimen, gearbox = _parts_of_unit(options, unit)
        drawn = {key: of_key[condition] for key, of_key in conditions.items()}
        values = designs.of(unit, drawn)
        if repeat == 0:
            machine = reader.machine(values)
            machine.pair.require_continuous_drive()
        order = stream(seed, Stream.ORDER, condition * counts.n_repeats + repeat)
        for label in order.permutation(len(names)).tolist():
            if len(rows) == counts.n_records:
                break
            start = stream(seed, Stream.START, len(rows))
            # The first healthy record of a condition is the twin that sets its noise.
            if repeat == 0 and sound[:1] == [names[label]]:
                start = stream(seed, Stream.TWIN, condition)
            ids = _ids(options, label, unit, gearbox, specimen, condition, repeat)
            fault = faults[names[label]][condition]
            if not options.sham:
                require_size(read_faults(fault))
            rows.append(ids | _row(options, machine, fault, values, start))
    if options.n_reference:
        rows = [row | {IS_REFERENCE: 0} for row in rows]
        label = names.index(sound[0])
        rows += _reference_rows(reader, counts, designs, label)
    return _as_plan(reader, rows)


def _reference_rows(
    reader: InputReader, counts: Counts, designs: UnitDesigns, label: int
) -> list[dict[str, Any]]:
    """Healthy records of every unit with an example, each at a condition of its own.

    Their conditions are drawn as those of the examples, by a stream of their own; where those are
    a grid, as a Latin hypercube. Like a healthy example, each is the twin that sets its noise.
    """
    options, design = reader.plan, reader.plan.design
    n_units = min(counts.n_units, counts.n_conditions)
    numbers = np.arange(n_units * options.n_reference)
    if options.is_grid:
        design = LATIN_HYPERCUBE
    rng = stream(reader.seed, Stream.REFERENCE)
    vary = options.condition_vary
    drawn = draw_points(design, vary, numbers, rng).values(vary)
    fault = reader.classes[options.classes[label]]
    rows = []
    for number in numbers.tolist():
        unit, condition = number % n_units, counts.n_conditions + number
        specimen, gearbox = _parts_of_unit(options, unit)
        of_condition = {key: of_key[number] for key, of_key in drawn.items()}
        values = designs.of(unit, of_condition)
        machine = reader.machine(values)
        machine.pair.require_continuous_drive()
        start = stream(reader.seed, Stream.TWIN, condition)
        ids = _ids(options, label, unit, gearbox, specimen, condition, 0)
        row = _row(options, machine, fault, values, start)
        rows.append(ids | row | {IS_REFERENCE: 1})
    return rows


def _plan_of_lives(reader: InputReader) -> Plan:
    """One row a snapshot, life by life. Every unit has its own gears, as they fail only once."""
    options, machine = reader.plan, reader.machine()
    machine.check()
    machine.pair.require_continuous_drive()
    n_gearboxes = _count_gearboxes(options)
    rows: list[dict[str, Any]] = []
    for look in snapshots(reader):
        unit, gearbox = look.unit, look.unit % n_gearboxes
        ids = _ids(options, look.label, unit, gearbox, unit, look.condition, 0)
        drawn_columns = _row(
            options,
            reader.machine(look.values),
            look.fault,
            look.values,
            stream(reader.seed, Stream.START, len(rows)),
            is_checked=look.is_last,
        )
        rows.append(ids | drawn_columns | look.columns)
    return _as_plan(reader, rows)


def _ids(
    options: PlanOptions,
    label: int,
    unit: int,
    gearbox: int,
    specimen: int,
    condition: int,
    repeat: int,
) -> dict[str, Any]:
    """Class and ids of a record; `RecordNumbers` reads the numbers of the ids back."""
    return {
        "label": label,
        "label_name": options.classes[label],
        "unit_id": f"unit-{unit:04d}",
        "gearbox_id": f"gearbox-{gearbox:04d}",
        "specimen_id": f"specimen-{specimen:04d}",
        "condition_id": f"condition-{condition:06d}",
        "repeat": repeat,
    }


def _parts_of_unit(options: PlanOptions, unit: int) -> tuple[int, int]:
    """Numbers of the set of gears and of the gearbox of a unit."""
    if options.has_separate_machines:
        return unit, unit
    return divmod(unit, _count_gearboxes(options))


def _count_gearboxes(options: PlanOptions) -> int:
    """Number of gearboxes, at most one a unit.

    One a unit where machines are separate; else about the square root of the units where it is
    not given.
    """
    if options.has_separate_machines:
        return options.n_units
    if options.n_gearboxes is None:
        return min(options.n_units, round(math.sqrt(options.n_units)))
    return min(options.n_units, options.n_gearboxes)


def count_records(reader: InputReader) -> Counts:
    """Check and work out every count of the plan; a grid's from its levels.

    Raises
    ------
    ConfigError    for counts that cannot be used or do not agree
    """
    plan = reader.plan
    n_classes = len(plan.classes)
    per_unit, n_faults = plan.conditions_per_unit, 1
    if plan.is_grid:
        if per_unit is not None:
            raise ConfigError(
                f"plan.conditions_per_unit = {per_unit!r}: a grid's levels say how many; leave "
                "it null"
            )
        per_unit, n_faults = _grid_size(reader)
    n_records = plan.n_records
    if per_unit is not None:
        n_conditions = plan.n_units * per_unit * n_faults
        product = n_conditions * n_classes * plan.n_repeats
        n_records = _fitting(
            plan, product, (plan.n_units, per_unit, n_faults, n_classes)
        )
    elif n_records is not None:
        n_conditions = math.ceil(n_records / (n_classes * plan.n_repeats))
    else:
        raise ConfigError(
            "plan.n_records = null: give a number, plan.conditions_per_unit, or plan.design=grid"
        )
    points = np.arange(n_conditions) // plan.n_units
    return Counts(
        n_records=n_records,
        n_units=plan.n_units,
        n_repeats=plan.n_repeats,
        n_conditions=n_conditions,
        condition_points=points // n_faults,
        fault_points=points % n_faults,
    )


def _grid_size(reader: InputReader) -> tuple[int, int]:
    """Points of the grid over the conditions, and the least common multiple of those of faults."""
    plan = reader.plan
    for key, distribution in plan.condition_vary.items():
        if not (distribution.levels or distribution.names_levels):
            raise ConfigError(
                f"plan.vary.{key}: a grid needs its levels: give levels: 4 or so, distribution: "
                "choice, or levels: null to draw it all the same"
            )
    n_faults = [_n_points(vary) for vary in _fault_varies(reader).values()]
    return _n_points(plan.condition_vary), math.lcm(*n_faults)


def _n_points(vary: Mapping[str, Distribution]) -> int:
    return math.prod(distribution.levels or 1 for distribution in vary.values())


def _fault_varies(reader: InputReader) -> dict[str, dict[str, Distribution]]:
    """Distributions of the keys of each class."""
    return {
        name: fault_specs(reader, fault)[0] for name, fault in reader.classes.items()
    }


def describe_design(reader: InputReader) -> str:
    """The design in words.

    Of a grid the number of levels of each key, and the keys that are drawn all the same.
    """
    plan = reader.plan
    if not plan.is_grid:
        return plan.design
    vary = plan.condition_vary
    levels = {key: distribution.levels for key, distribution in vary.items()}
    levels |= dict.fromkeys(plan.unit_vary, 0)
    for name, vary in _fault_varies(reader).items():
        levels |= {f"{name}.{key}": vary[key].levels for key in vary}
    crossed = " x ".join(f"{key} {n}" for key, n in levels.items() if n)
    drawn = ", ".join(key for key, n in levels.items() if not n)
    return f"grid of {crossed or 'no key'}" + f"; drawn: {drawn}" * bool(drawn)


def varied_keys(reader: InputReader) -> dict[str, str]:
    """Key that a plan varies -> its range in words; keys of faults begin with their class.

    Sizes of faults that are shares of a tooth are those of the configured gear.
    """
    varied = {key: distribution.text for key, distribution in reader.plan.vary.items()}
    if reader.plan.draws_unit_load:
        varied[TORQUE_KEY] += " of unit load, N/mm2"
    if reader.runs_to_failure:
        grown = "grows along each life"
        return varied | {
            name: grown for name, fault in reader.classes.items() if fault_parts(fault)
        }
    if gears := drawn_gears(reader):
        sizes = "sizes and teeth below are of the configured gear"
        varied["fault_gear"] = f"{', '.join(gears)}; {sizes}"
    for name, vary in _fault_varies(reader).items():
        varied |= {f"{name}.{key}": vary[key].text for key in vary}
    return varied


def _fitting(plan: PlanOptions, n_records: int, counts: tuple[int, ...]) -> int:
    """Number of records that follows from the other counts.

    Raises ConfigError where ``plan.n_records`` is another number, or a grid is too large.
    """
    names = ("machines", "conditions", "faults", "classes", "repeats")
    named = zip((*counts, plan.n_repeats), names, strict=True)
    product = " x ".join(f"{n:,} {name}" for n, name in named if n > 1)
    sum_of_all = f"{n_records:,} records ({product})" if product else "1 record"
    if plan.is_grid and n_records > MOST_IN_GRID:
        raise ConfigError(
            f"the grid has {sum_of_all}, more than {MOST_IN_GRID:,}; take fewer levels, "
            "machines or repeats"
        )
    if plan.n_records not in (None, n_records):
        raise ConfigError(
            f"plan.n_records = {plan.n_records}, but the plan has {sum_of_all}; "
            "plan.n_records=null takes them"
        )
    return n_records


def _row(
    options: PlanOptions,
    machine: Machine,
    fault: Mapping[str, Any],
    values: Mapping[str, float],
    rng: np.random.Generator,
    *,
    is_checked: bool = True,
) -> dict[str, Any]:
    """Columns of one record that follow from its drawn values.

    Those of its gears are among them where units differ in them. The teeth of a record need no
    check where a larger fault of the same life is checked: ``is_checked`` is false.
    """
    faults = read_faults(fault)
    if is_checked:
        for pair, felt in machine.faulty_meshes(faults):
            teeth = faulty_teeth(pair, felt)
            check_teeth(pair, machine.material, machine.mesh, teeth)
    start = draw_start(machine, rng)
    row = {
        "faults_json": json.dumps(fault_parts(fault), separators=(",", ":")),
        "severity": 0.0,
        "fault_gear": "",
        "fault_tooth": -1,
        "start_tooth_pinion": start.tooth_pinion,
        "start_tooth_wheel": start.tooth_wheel,
        "start_phase": start.phase,
        "speed_set_rpm": from_si("speed_rpm", machine.operating.speed),
        "torque_nm": machine.operating.torque,
        "snr_db": machine.sensing.snr,
    }
    if row["snr_db"] is None:
        row["snr_db"] = MISSING
    if not options.sham:
        row["severity"] = severity(faults, machine.gears)
    if faults:
        row["fault_gear"] = faults[0].gear
        row["fault_tooth"] = faults[0].first_tooth
    row |= {f"params/{key}": float(value) for key, value in values.items()}
    row |= {f"params/fault.{key}": size for key, size in fault_sizes(fault).items()}
    if options.varies_gears:
        row |= gear_columns(machine.pair)
    return row


def _as_plan(reader: InputReader, rows: list[dict[str, Any]]) -> Plan:
    """Rows to columns.

    A parameter that a record has not is NaN. The rows are emptied: nothing is held twice.
    """
    names = dict.fromkeys(itertools.chain(*rows))
    together = records_per_shard(reader, len(rows))
    shard, number = shard_rows(len(rows), together)
    columns: dict[str, Any] = {"record_id": record_ids(len(rows))}
    columns |= {"shard": shard, "row": number}
    for name in names:
        columns[name] = np.array([row.pop(name, MISSING) for row in rows])
    return Plan(columns=columns)


def records_per_shard(reader: InputReader, n_records: int) -> int:
    """Number of records of a shard, as configured or for a set of ``n_records``.

    Where it is not configured, it grows with the set: 24 up to 24,000 records, then as many as
    make 1,000 shards. The samples of a shard take at most 500 MB.
    """
    given = reader.dataset.records_per_shard
    if given is not None:
        return given
    groups = math.ceil(n_records / (MOST_SHARDS * LANES))
    wanted = max(LEAST_IN_SHARD, groups * LANES)
    fitting = MOST_SHARD_BYTES // record_bytes(reader)
    if wanted <= fitting:
        return wanted
    if fitting < LANES:
        return max(1, fitting)
    return fitting // LANES * LANES


def record_bytes(reader: InputReader, *, as_stored: bool = False) -> int:
    """Bytes of one record's samples in single precision.

    ``as_stored`` they are in the chosen type, before compression. Shards are cut by the former,
    so that the chosen type does not change a plan.
    """
    shapes = signal_shapes(reader)
    counts = set()
    if as_stored and reader.dataset.sample_type == "int16":
        counts = set(SCALES)
    n_bytes = 0
    for name, shape in shapes.items():
        column = signal_column(name)
        width = COUNT_BYTES if name in counts else column.n_bytes
        n_bytes += column.is_bulk * width * math.prod(shape)
    return n_bytes
