"""Simulation and writing of one shard."""

from __future__ import annotations

import functools
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gensig.compilation import on_compilation
from gensig.dataset.columns import GEAR_NAMES, GEAR_PINION_TURNS, GEAR_TEETH
from gensig.dataset.folder.joining import joined_folder, refuse_implants
from gensig.dataset.folder.layout import (
    PLAN,
    Manifest,
    ShardEntry,
    shard_path,
)
from gensig.dataset.plan import PlanRows
from gensig.dataset.schema import IDENTITY
from gensig.dataset.storage.guard import same_file
from gensig.dataset.storage.receipts import (
    write_receipt,
)
from gensig.dataset.storage.shard import ShardWriter
from gensig.dynamics.backends.registry import IMPLICIT_BACKEND
from gensig.dynamics.decimation import usable_band
from gensig.dynamics.integrator import records_together
from gensig.errors import DatasetError
from gensig.options.configuration import Configuration
from gensig.production.record_counts import RecordCounts
from gensig.record.inputs import InputReader
from gensig.record.options import DatasetOptions
from gensig.record.simulate import finished_records, gear_columns, signal_shapes
from gensig.systems.base import Machine
from gensig.units import channel_unit
from gensig.version import __version__

# records simulated and written at a time, and bytes of their samples; larger blocks are no faster
MOST_BLOCK, BLOCK_BYTES = 16, 2**27
# the same by the implicit method, which takes seconds a record
IMPLICIT_BLOCK = 4


def write_shard(
    out: Path, shard_index: int, *, counts: RecordCounts | None = None
) -> ShardEntry:
    """Simulate and write one shard; its bits depend only on the folder's plan and configuration.

    ``counts`` takes the records that are written.

    Raises
    ------
    DatasetError    where the folder was begun by another version than that of this process
    """
    reader, plan, manifest = _folder_inputs(out, same_file(out / PLAN))
    sizes = manifest.shard_sizes
    n_records, begin = sizes[shard_index], sum(sizes[:shard_index])
    params = [
        name.removeprefix("params/")
        for name in plan.names
        if name.startswith("params/")
    ]
    writer = open_shard(
        shard_path(out, shard_index),
        reader,
        n_records,
        params,
        identity=manifest.identity,
        shard_index=shard_index,
    )
    together = block_length(reader.machine())
    with writer, _compilation_told(counts, shard_index):
        for first in range(0, n_records, together):
            rows = plan.records(begin + first, min(together, n_records - first))
            _check_rows(out, rows, shard_index, first)
            for row, record in enumerate(finished_records(reader, rows), start=first):
                writer.write(row, record.signals, record.values)
                if counts is not None:
                    counts.set(shard_index, row + 1)
    write_receipt(out, shard_index, writer.entry)
    return writer.entry


@contextmanager
def _compilation_told(counts: RecordCounts | None, shard: int) -> Iterator[None]:
    """Begin the shard in the counts, and tell them of the compilations within the block."""
    if counts is None:
        yield
        return
    total = 0.0

    def tell_end(seconds: float) -> None:
        nonlocal total
        total += seconds
        counts.compiled(shard, total)

    counts.begin(shard)
    with on_compilation(lambda: counts.compiling(shard), tell_end):
        yield


@functools.lru_cache(maxsize=1)
def _folder_inputs(
    out: Path, _changed: tuple[int, ...]
) -> tuple[InputReader, PlanRows, Manifest]:
    """Reader, plan and manifest at its beginning, made once for many shards of a folder."""
    manifest, config = joined_folder(out)
    refuse_implants(out, config)
    return InputReader(Configuration(config)), PlanRows(out / PLAN), manifest


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


def block_length(system: Machine) -> int:
    """Records that are simulated at a time: enough for full speed, few enough for the memory."""
    n_bytes = 8 * len(system.sensing.channels) * system.n_samples
    most = MOST_BLOCK
    if system.solver.backend == IMPLICIT_BACKEND:
        most = IMPLICIT_BLOCK
    return max(records_together(system.solver), min(most, BLOCK_BYTES // n_bytes))


def open_shard(
    path: Path,
    reader: InputReader,
    n_records: int,
    params: Sequence[str],
    *,
    identity: str | None = None,
    shard_index: int | None = None,
) -> ShardWriter:
    """Writer for records of one configuration.

    Parameters
    ----------
    path : file of the shard
    reader : decides signals, columns and attributes
    n_records : rows of the shard
    params : names of the columns ``params/<name>``
    identity, shard_index : data set and number of the shard; None for records of no data set
    """
    dataset, plan = reader.dataset, reader.plan
    attributes = root_attributes(reader)
    if identity is not None:
        attributes[IDENTITY] = identity
    return ShardWriter(
        path,
        n_records=n_records,
        signals=signal_shapes(reader),
        params=params,
        attributes=attributes,
        shard_index=shard_index,
        compression=dataset.compression,
        sample_type=dataset.sample_type,
        lives=reader.runs_to_failure,
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


def root_attributes(reader: InputReader) -> dict[str, Any]:
    """Attributes that hold for every record of a data set."""
    system = reader.machine()
    geometry, torque_of = {}, {}
    if not reader.plan.varies_gears:
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
        **_shaft_sensors(reader.dataset, system),
        **torque_of,
        "class_names": list(reader.plan.classes),
        **geometry,
        **_gears_of_line(system),
        "config_json": json.dumps(
            reader.config.with_entries(out=None, executor=None).plain(), sort_keys=True
        ),
    }
