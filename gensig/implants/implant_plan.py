"""Plan of a set of implants: block, class, source and gain of every record, drawn beforehand."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Integers
from gensig.dataset.plan import Plan, record_ids, shard_rows
from gensig.errors import ConfigError
from gensig.implants.blocks import Block, Cut
from gensig.implants.carriers import Carrier
from gensig.implants.gearing import Gearing
from gensig.implants.options import ImplantOptions
from gensig.implants.simulated_pairs import CLASSES, HEALTHY, SimulatedPairs

Value = str | int | float

PLAN_STREAM, RECORD_STREAM = 7101, 7102
SHARD_BYTES = 64 * 1024**2  # of samples, at most
UNKNOWN_TOOTH = -1


@dataclass(frozen=True, slots=True, kw_only=True)
class Draw:
    """Everything drawn for one record.

    Attributes
    ----------
    name : of its class
    block : that carries
    start : sample of the recording at which the record begins
    gear : number of the gear of the machine whose turns the residual takes
    source : number of the simulated record
    second : number of another of the same gears, for a residual of two healthy records
    source_gear : gear of the simulated machine whose turns are taken
    channel : number of the simulated channel for the first of the carrier's; the next for the next
    gain_db : dB    level of the residual over the carrier's; NaN where it carries nothing
    shift, second_shift : share of the simulated signal at which it begins
    """

    name: str
    block: Block
    start: int
    gear: int
    source: int
    second: int
    source_gear: str
    channel: int
    gain_db: float
    shift: float
    second_shift: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ImplantPlan:
    """Draws of all records, and the table of a data set made of them."""

    draws: tuple[Draw, ...]
    class_names: tuple[str, ...]
    table: Plan


def random_stream(seed: int, *key: int) -> np.random.Generator:
    """Random numbers of one cause."""
    sequence = np.random.SeedSequence(seed, spawn_key=key)
    return np.random.Generator(np.random.Philox(sequence))


def make_implant_plan(
    pairs: SimulatedPairs,
    carriers: Sequence[Carrier],
    gearing: Gearing,
    cut: Cut,
    options: ImplantOptions,
) -> ImplantPlan:
    """All records with everything that is drawn for them.

    Blocks and classes are dealt in turn, so that every block carries every class as often. Sets of
    simulated gears are dealt to blocks, as far as there are enough: a split that keeps both apart
    then tests on carriers and on faults never seen. Starts, gains, channels and gears follow the
    same law in all classes.

    Raises
    ------
    ConfigError    for too few records
    """
    classes = _present_classes(pairs)
    blocks = cut.carrying
    least = len(classes) * len(blocks)
    if options.n_records < least:
        raise ConfigError(
            f"--records {options.n_records}: {len(blocks)} blocks carry {len(classes)} classes; "
            f"at least {least} are needed"
        )
    rng = random_stream(options.seed, PLAN_STREAM)
    pools = _pools(pairs, len(blocks), rng)
    draws = []
    for index in range(options.n_records):
        name, place = classes[index % len(classes)], index // len(classes) % len(blocks)
        pool = pools[place % len(pools)]
        block = blocks[place]
        latest = block.stop - cut.n_samples
        draw = _draw(pairs, pool, name, block, latest, gearing, options, rng)
        draws.append(draw)
    fitting = SHARD_BYTES // (4 * len(carriers[0].recording.sensors) * cut.n_samples)
    rows = [_row(pairs, carriers, gearing, classes, draw) for draw in draws]
    shard, row = shard_rows(len(rows), max(1, min(len(rows), fitting)))
    columns = {
        "record_id": record_ids(len(rows)),
        "shard": shard,
        "row": row,
        **{name: np.array([each[name] for each in rows]) for name in rows[0]},
        "repeat": _repeats(rows),
    }
    return ImplantPlan(
        draws=tuple(draws), class_names=classes, table=Plan(columns=columns)
    )


def _present_classes(pairs: SimulatedPairs) -> tuple[str, ...]:
    """Classes of which the set has sources; healthy always is one."""
    return tuple(
        name
        for label, name in enumerate(CLASSES)
        if name == HEALTHY or np.any(pairs.label == label)
    )


def _pools(
    pairs: SimulatedPairs, n_blocks: int, rng: np.random.Generator
) -> list[Integers]:
    """Sources in as many pools as blocks, or fewer: each with records of all faulty classes.

    A set of gears is in one pool.
    """
    faulty = [label for label in range(1, len(CLASSES)) if np.any(pairs.label == label)]
    is_source = pairs.label >= 0
    groups = rng.permutation(np.unique(pairs.group[is_source]))
    for n_pools in range(min(n_blocks, len(groups)), 1, -1):
        pools = [
            np.flatnonzero(np.isin(pairs.group, groups[k::n_pools]) & is_source)
            for k in range(n_pools)
        ]
        if all(set(faulty) <= set(pairs.label[pool].tolist()) for pool in pools):
            return pools
    return [np.flatnonzero(is_source)]


def _draw(
    pairs: SimulatedPairs,
    pool: Integers,
    name: str,
    block: Block,
    latest: int,
    gearing: Gearing,
    options: ImplantOptions,
    rng: np.random.Generator,
) -> Draw:
    """One record; every class takes the same law of start, gear, channel and gain."""
    wanted = pool[pairs.label[pool] == CLASSES.index(name)]
    if name == HEALTHY:
        wanted = pool  # the residual is between twins, which every record has
    source = int(rng.choice(wanted))
    # a healthy residual turns with the gear that a faulty one of the pool turns with
    like = int(rng.choice(pool[pairs.label[pool] > 0]))
    source_gear = pairs.fault_gear(like if name == HEALTHY else source)
    others = pool[(pairs.group[pool] == pairs.group[source]) & (pool != source)]
    second = int(rng.choice(others)) if len(others) else source
    gears = gearing.of_role(pairs.role(source_gear))
    gain = float(rng.uniform(*options.gain_db))
    carries = options.residual != "none"
    if name == HEALTHY and options.plain_healthy > 0.0:
        carries = carries and rng.uniform() >= options.plain_healthy
    shift, second_shift = rng.uniform(0.0, 1.0, 2).tolist()
    return Draw(
        name=name,
        block=block,
        start=int(rng.integers(block.start, latest + 1)),
        gear=int(rng.choice(np.array(gears))),
        source=source,
        second=second,
        source_gear=source_gear,
        channel=int(rng.choice(np.array(pairs.channels))),
        gain_db=gain if carries else float("nan"),
        shift=shift,
        second_shift=second_shift,
    )


def _row(
    pairs: SimulatedPairs,
    carriers: Sequence[Carrier],
    gearing: Gearing,
    classes: Sequence[str],
    draw: Draw,
) -> dict[str, Value]:
    """One row of the plan."""
    data, source = pairs.data, draw.source
    is_healthy = draw.name == HEALTHY
    specimen = str(data.column("specimen_id")[source])
    return {
        "label": classes.index(draw.name),
        "label_name": draw.name,
        "faults_json": "[]" if is_healthy else str(data.column("faults_json")[source]),
        "severity": 0.0 if is_healthy else float(data.column("severity")[source]),
        "fault_gear": "" if is_healthy else gearing.names[draw.gear],
        "fault_tooth": UNKNOWN_TOOTH,
        "start_tooth_pinion": UNKNOWN_TOOTH,
        "start_tooth_wheel": UNKNOWN_TOOTH,
        "start_phase": float("nan"),
        "speed_set_rpm": float(carriers[draw.block.recording].set_rpm),
        "torque_nm": float("nan"),
        "snr_db": float("nan"),
        "gearbox_id": draw.block.name,
        "specimen_id": specimen,
        "unit_id": draw.block.name,
        "condition_id": draw.block.name,
        "params/implant_gain_db": draw.gain_db,
        "params/implant_start_sample": float(draw.start),
        "params/implant_gear": float(draw.gear),
        "params/source_channel": float(draw.channel),
        "params/source_share": draw.shift,
        "params/second_source_share": draw.second_shift,
        "carrier_file": draw.block.file,
        "carrier_block": draw.block.number,
        "source_record": str(data.column("record_id")[source]),
        "second_source_record": str(data.column("record_id")[draw.second]),
        "source_gear": draw.source_gear,
    }


def _repeats(rows: Sequence[Mapping[str, Value]]) -> Integers:
    """Number of each row among those of its condition and class, from 0."""
    seen: Counter[tuple[Value, Value]] = Counter()
    numbers = []
    for row in rows:
        key = (row["condition_id"], row["label"])
        numbers.append(seen[key])
        seen[key] += 1
    return np.array(numbers, dtype=np.int64)
