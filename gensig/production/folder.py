"""Making a data set on disk from a configuration: the joint of physics and data-set code."""

from __future__ import annotations

import dataclasses
import functools
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gensig.compilation import on_compilation
from gensig.dataset.columns import GEAR_NAMES, GEAR_PINION_TURNS, GEAR_TEETH
from gensig.dataset.folder.beginning import create_folder
from gensig.dataset.folder.failures import commonest, failure_reasons
from gensig.dataset.folder.joining import joined_folder
from gensig.dataset.folder.layout import PLAN, ShardEntry, read_manifest, shard_path
from gensig.dataset.folder.manifest import (
    finalize,
    identity_hash,
    record_failed_shard,
    record_shard,
)
from gensig.dataset.folder.run_log import log
from gensig.dataset.plan import Plan, PlanRows
from gensig.dataset.schema import SAMPLE_TYPES
from gensig.dataset.storage.compression import COMPRESSIONS, creation_options
from gensig.dataset.storage.receipts import (
    collect_receipts,
    read_receipt,
    receipt_path,
    write_receipt,
)
from gensig.dataset.storage.shard import ShardWriter
from gensig.dynamics.backends.registry import IMPLICIT_BACKEND
from gensig.dynamics.decimation import usable_band
from gensig.dynamics.integrator import records_together
from gensig.errors import ConfigError, DatasetError
from gensig.execution.base import Executor, ShardFailure
from gensig.life.life_options import runs_to_failure
from gensig.options.configuration import Configuration
from gensig.plan.make import make_plan
from gensig.production.record_counts import RecordCounts
from gensig.record.gear_columns import gear_columns
from gensig.record.machines import read_machine
from gensig.record.options import (
    DatasetOptions,
    read_dataset_options,
    read_plan_options,
)
from gensig.record.simulate import finished_records, signal_shapes
from gensig.systems.base import Machine
from gensig.terminal.run_progress import Progress
from gensig.units import channel_unit
from gensig.version import __version__


def begin_folder(config: Configuration, overrides: Sequence[str], out: Path) -> Plan:
    """Plan a data set and make its folder, ready for ``run_folder``.

    Nothing is touched if anything is wrong.
    """
    for key, allowed in (("compression", COMPRESSIONS), ("sample_type", SAMPLE_TYPES)):
        if config["dataset"][key] not in allowed:
            raise ConfigError(
                f"dataset.{key} = {config['dataset'][key]!r}; allowed: {', '.join(allowed)}"
            )
    dataset = read_dataset_options(config)
    creation_options(dataset.compression)  # refuses one whose package is missing
    plan = make_plan(config)
    recorded = config.with_entries(out=None).plain()
    create_folder(
        out,
        config=recorded,
        overrides=overrides,
        plan=plan,
        identity=identity_hash(recorded, __version__),
        seed=config.seed,
        generator_version=__version__,
    )
    planned = f"{plan.n_records} records in {plan.n_shards} shards are planned"
    log(out, f"gensig {__version__}: {planned}")
    return plan


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenShard:
    """Digest, size and number of failed records of a shard on disk."""

    sha256: str
    n_bytes: int
    n_failed: int


@dataclass(slots=True, kw_only=True)
class _Tally:
    """Records of a run: those on disk, and those that it made."""

    n_records: int
    n_done: int
    n_failed: int
    n_made: int = 0
    n_bytes: int = 0

    def add(self, n_records: int, shard: WrittenShard) -> None:
        """Count a shard that was made."""
        self.n_done += n_records
        self.n_made += n_records
        self.n_failed += shard.n_failed
        self.n_bytes += shard.n_bytes

    def progress(self, reason: str = "") -> Progress:
        """The state after a shard; ``reason`` says why it could not be made."""
        return Progress(**dataclasses.asdict(self), reason=reason)


def run_folder(
    out: Path,
    *,
    executor: Executor,
    on_shard: Callable[[Progress], None],
    asked: Configuration | None = None,
    counts: RecordCounts | None = None,
) -> tuple[int, list[str]]:
    """Make the shards that a folder still lacks, then close it.

    A task of an array job makes its share only.

    Parameters
    ----------
    executor : where the shards are made; it decides no bit
    on_shard : called at the beginning, and for every shard that is finished or could not be made
    counts : takes the records of shards at work
    asked : a configuration that must agree with the folder's in all that decides bits

    Returns
    -------
    number of failed records, and one line for each shard that could not be made; the folder is
    complete only without such a line
    """
    out = out.resolve()
    if asked is None:
        joined_folder(out)
    else:
        joined_folder(out, asked=asked.plain())
    if executor.closes:
        collect_receipts(out)
    manifest = read_manifest(out)
    rows = [entry.rows for entry in manifest.shards]
    mine = executor.share(range(len(rows)))
    entries = {index: manifest.shards[index] for index in mine}
    if not executor.closes:
        entries |= _receipts(out, mine)
    missing = [index for index in mine if not _is_there(out, index, entries[index])]
    done = [index for index in mine if index not in missing]
    tally = _Tally(
        n_records=sum(rows[index] for index in mine),
        n_done=sum(rows[index] for index in done),
        n_failed=sum(entries[index].n_failed for index in done),
    )
    problems: list[str] = []
    # The log of a closed folder is closed too.
    logged = executor.closes and not manifest.is_complete
    if logged:
        n_missing = f"{len(missing)} of {len(mine)} shards to make"
        log(out, f"gensig {__version__}, {executor}: {n_missing}")
    on_shard(tally.progress())
    job = functools.partial(write_shard, out, counts=counts)
    try:
        for index, result in executor.run(job, missing):
            if counts is not None:
                counts.set(index, 0)
            reason = _recorded(out, index, result, rows[index], closes=executor.closes)
            if reason:
                problems.append(reason)
            if isinstance(result, WrittenShard):
                tally.add(rows[index], result)
            on_shard(tally.progress(reason))
    except BaseException as error:
        if logged:
            log(out, f"ended by {type(error).__name__}: {error}")
        raise
    if logged and not problems:
        _close(out)
    return tally.n_failed, problems


def _recorded(
    out: Path,
    index: int,
    result: WrittenShard | ShardFailure,
    n_records: int,
    *,
    closes: bool,
) -> str:
    """Enter a shard in manifest and log; returns the reason why it could not be made, or ''.

    A task of an array job enters nothing: ``gensig finalize`` does.
    """
    if isinstance(result, ShardFailure):
        reason = f"shard {index}: {result.reason}"
        if closes:
            record_failed_shard(out, index)
            log(out, f"{reason}; not made")
        return reason
    if closes:
        record_shard(out, index, result.sha256, result.n_bytes, result.n_failed)
        receipt_path(out, index).unlink(missing_ok=True)
        sizes = f"{result.n_failed} failed, {result.n_bytes} bytes"
        log(out, f"shard {index}: {n_records} records, {sizes}")
    return ""


def _close(out: Path) -> None:
    """Close the folder; the log is closed with it, and takes no line afterwards."""
    if reasons := failure_reasons(out):
        failed = f"{len(reasons)} of {read_manifest(out).n_records} records failed"
        log(out, f"{failed}: {commonest(reasons)}")
    log(out, "every shard is done; closing")
    finalize(out)


def _receipts(out: Path, indices: Iterable[int]) -> dict[int, ShardEntry]:
    """Entries of the shards that other tasks of an array job have made."""
    receipts = {index: read_receipt(out, index) for index in indices}
    return {index: entry for index, entry in receipts.items() if entry is not None}


def _is_there(out: Path, index: int, entry: ShardEntry) -> bool:
    """True for a shard that is done and whose file has not been lost or cut since."""
    path = shard_path(out, index)
    return (
        entry.state == "done" and path.is_file() and path.stat().st_size == entry.bytes
    )


def close_folder(out: Path) -> int:
    """Close a folder made by tasks of an array job; returns the number of failed records.

    Raises
    ------
    DatasetError    when a shard is missing, which is named
    """
    joined_folder(out)
    collect_receipts(out)
    if not read_manifest(out).is_complete:
        _close(out)
    return read_manifest(out).n_failed


# records simulated and written at a time, and bytes of their samples; larger blocks are no faster
MOST_BLOCK, BLOCK_BYTES = 16, 2**27
# the same by the implicit method, which takes seconds a record
IMPLICIT_BLOCK = 4


def write_shard(
    out: Path, shard_index: int, *, counts: RecordCounts | None = None
) -> WrittenShard:
    """Simulate and write one shard; its bits depend only on the folder's plan and configuration.

    ``counts`` takes the records that are written.

    Raises
    ------
    DatasetError    where the folder was begun by another version than that of this process
    """
    config, plan, sizes = _folder_inputs(out, (out / PLAN).stat().st_mtime_ns)
    n_records, begin = sizes[shard_index], sum(sizes[:shard_index])
    params = [
        name.removeprefix("params/")
        for name in plan.names
        if name.startswith("params/")
    ]
    writer = open_shard(shard_path(out, shard_index), config, n_records, params)
    together = block_length(config)
    with writer, _compilation_told(counts):
        for first in range(0, n_records, together):
            rows = plan.records(begin + first, min(together, n_records - first))
            _check_rows(out, rows, shard_index, first)
            for row, record in enumerate(finished_records(config, rows), start=first):
                writer.write(row, record.signals, record.values)
                if counts is not None:
                    counts.set(shard_index, row + 1)
    written = WrittenShard(
        sha256=writer.sha256, n_bytes=writer.n_bytes, n_failed=writer.n_failed
    )
    write_receipt(out, shard_index, rows=n_records, **dataclasses.asdict(written))
    return written


def _compilation_told(counts: RecordCounts | None) -> AbstractContextManager[None]:
    if counts is None:
        return nullcontext()
    return on_compilation(counts.compiling)


@functools.lru_cache(maxsize=1)
def _folder_inputs(
    out: Path, _changed: int
) -> tuple[Configuration, PlanRows, list[int]]:
    """Configuration, plan and records of each shard, read once for many shards of a folder."""
    manifest, config = joined_folder(out)
    return (
        Configuration(config),
        PlanRows(out / PLAN),
        [entry.rows for entry in manifest.shards],
    )


def _check_rows(
    out: Path, rows: Sequence[Mapping[str, Any]], shard_index: int, first: int
) -> None:
    if any(
        (row["shard"], row["row"]) != (shard_index, first + k)
        for k, row in enumerate(rows)
    ):
        raise DatasetError(
            f"{out / PLAN} and the manifest disagree on shard {shard_index}; "
            "restore both from a copy"
        )


def block_length(config: Configuration) -> int:
    """Records that are simulated at a time: enough for full speed, few enough for the memory."""
    system = read_machine(config)
    n_bytes = (
        8
        * len(system.sensing.channels)
        * round(system.operating.duration * system.sensing.sampling_rate)
    )
    most = MOST_BLOCK
    if system.solver.backend == IMPLICIT_BACKEND:
        most = IMPLICIT_BLOCK
    return max(records_together(system.solver), min(most, BLOCK_BYTES // n_bytes))


def open_shard(
    path: Path, config: Configuration, n_records: int, params: Sequence[str]
) -> ShardWriter:
    """Writer for records of one configuration."""
    system, dataset = read_machine(config), read_dataset_options(config)
    plan = read_plan_options(config)
    return ShardWriter(
        path,
        n_records=n_records,
        signals=signal_shapes(config, system),
        params=params,
        attributes=root_attributes(config, system),
        compression=dataset.compression,
        sample_type=dataset.sample_type,
        lives=runs_to_failure(config),
        references=plan.n_reference > 0,
        gears=plan.varies_gears,
    )


def _shaft_sensors(dataset: DatasetOptions, system: Machine) -> dict[str, Any]:
    """Attributes of the stored shaft signals: shafts, pulses and lines."""
    tacho, encoder = system.sensing.tacho, system.sensing.encoder
    attributes: dict[str, Any] = {}
    if dataset.store_tacho:
        attributes |= {
            "tacho_shaft": tacho.shaft,
            "tacho_pulses_per_turn": tacho.pulses_per_turn,
        }
    if dataset.store_encoder:
        attributes |= {
            "encoder_shaft": encoder.shaft,
            "encoder_lines_per_turn": encoder.lines_per_turn,
        }
    return attributes


def _gears_of_line(system: Machine) -> dict[str, Any]:
    """Names, teeth and turns of all gears; none for a gear pair, which has columns for them."""
    if len(system.meshes) == 1:
        return {}
    turns = system.pinion_turns
    return {
        GEAR_NAMES: list(system.gears),
        GEAR_TEETH: [gear.n_teeth for gear in system.gears.values()],
        GEAR_PINION_TURNS: [turns[name] for name in system.gears],
    }


def root_attributes(config: Configuration, system: Machine) -> dict[str, Any]:
    """Attributes that hold for every record of a data set."""
    geometry, torque_of = {}, {}
    if not read_plan_options(config).varies_gears:
        geometry = gear_columns(system.pair)
    if system.torque_of:
        torque_of = {"torque_of": system.torque_of}
    return {
        "generator_version": __version__,
        "sampling_rate_hz": system.sensing.sampling_rate,
        "usable_band_hz": list(usable_band(system.sensing.sampling_rate)),
        "channel_names": list(system.sensing.channel_names),
        "source_names": list(system.sensing.channels),
        "channel_units": [channel_unit(name) for name in system.sensing.channel_names],
        **_shaft_sensors(read_dataset_options(config), system),
        **torque_of,
        "class_names": list(config["plan"]["classes"]),
        **geometry,
        **_gears_of_line(system),
        "config_json": json.dumps(
            config.with_entries(out=None, executor=None).plain(), sort_keys=True
        ),
    }
