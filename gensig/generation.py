"""From a configuration to a data set on disk: the joint between physics and the data-set code."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gensig.dataset.layout import read_config, shard_path
from gensig.dataset.manifest import (
    create_folder,
    finalize,
    identity_hash,
    read_manifest,
    record_failed_shard,
    record_shard,
)
from gensig.dataset.plan import read_plan
from gensig.dataset.shard import COMPRESSIONS, ShardWriter
from gensig.errors import ConfigError, DatasetError
from gensig.execution.local import ShardFailure, n_workers, run_shards
from gensig.planning import make_plan
from gensig.records import read_seed, simulate_records
from gensig.sensing.decimation import usable_band
from gensig.systems.registry import read_system
from gensig.systems.spur_pair import SpurPair
from gensig.units import from_si
from gensig.version import __version__


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """One finished shard: how many of how many records are done, and how many of them failed."""

    n_done: int
    n_records: int
    n_failed: int
    reason: str


def begin_folder(config: dict[str, Any], overrides: Sequence[str], out: Path) -> int:
    """Plan a data set and make its folder, ready for ``run_folder``; nothing is touched if anything is wrong.

    Returns
    -------
    number of shards
    """
    n_workers(config["executor"]["n_workers"])
    if config["dataset"]["compression"] not in COMPRESSIONS:
        raise ConfigError(
            f"dataset.compression = {config['dataset']['compression']!r}; allowed: {', '.join(COMPRESSIONS)}"
        )
    if not isinstance(config["dataset"]["store_clean"], bool):
        raise ConfigError(f"dataset.store_clean = {config['dataset']['store_clean']!r} must be true or false")
    plan = make_plan(config)
    recorded = {**config, "out": None}
    create_folder(
        out,
        config=recorded,
        overrides=overrides,
        plan=plan,
        identity=identity_hash(recorded, __version__),
        seed=read_seed(config),
        generator_version=__version__,
    )
    return plan.n_shards


def run_folder(out: Path, *, workers: int, on_shard: Callable[[Progress], None]) -> tuple[int, list[str]]:
    """Make the shards that a folder still lacks, then close it.

    Returns
    -------
    number of failed records, and one line for each shard that could not be made; the folder is complete only if
    there is none
    """
    manifest, config = read_manifest(out), read_config(out)
    if manifest.identity != identity_hash(config, __version__):
        raise DatasetError(
            f"{out} was begun by gensig {manifest.generator_version} or its config.yaml was changed; this is gensig "
            f"{__version__}: go on with that version, or start a new folder"
        )
    rows = [entry.rows for entry in manifest.shards]
    open_shards = [index for index, entry in enumerate(manifest.shards) if entry.state != "done"]
    n_done, n_failed = sum(rows) - sum(rows[index] for index in open_shards), manifest.n_failed
    problems: list[str] = []
    job = functools.partial(write_shard, out)
    for index, result in run_shards(job, open_shards, workers=workers):
        if isinstance(result, ShardFailure):
            record_failed_shard(out, index)
            problems.append(f"shard {index}: {result.reason}")
            on_shard(Progress(n_done=n_done, n_records=sum(rows), n_failed=n_failed, reason=problems[-1]))
            continue
        record_shard(out, index, result.sha256, result.n_bytes, result.n_failed)
        n_done, n_failed = n_done + rows[index], n_failed + result.n_failed
        on_shard(Progress(n_done=n_done, n_records=sum(rows), n_failed=n_failed, reason=""))
    if not problems:
        finalize(out)
    return n_failed, problems


BLOCK = 16  # records simulated and written at a time


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenShard:
    """Digest, size and number of failed records of a shard on disk."""

    sha256: str
    n_bytes: int
    n_failed: int


def write_shard(out: Path, shard_index: int) -> WrittenShard:
    """Simulate and write one shard of a folder; its bits depend on nothing but the folder's plan and configuration."""
    config, plan = read_config(out), read_plan(out / "plan.csv")
    indices = plan.rows(shard_index)
    params = [name.removeprefix("params/") for name in plan.columns if name.startswith("params/")]
    writer = open_shard(shard_path(out, shard_index), config, len(indices), params)
    with writer:
        for first in range(0, len(indices), BLOCK):
            rows = [plan.record(int(index)) for index in indices[first : first + BLOCK]]
            for row, record in enumerate(simulate_records(config, rows), start=first):
                writer.write(row, record.signals, record.values)
    return WrittenShard(sha256=writer.sha256, n_bytes=writer.n_bytes, n_failed=writer.n_failed)


def open_shard(path: Path, config: Mapping[str, Any], n_records: int, params: Sequence[str]) -> ShardWriter:
    """Writer for records of one configuration."""
    system = read_system(config)
    n_channels = len(system.sensing.channels)
    n_samples = round(system.operating.duration * system.sensing.sampling_rate)
    shapes: dict[str, tuple[int, ...]] = {
        "acceleration": (n_channels, n_samples),
        "fault_multihot": (len(config["plan"]["classes"]),),
        "signal_power": (n_channels,),
        "noise_power": (n_channels,),
    }
    if config["dataset"]["store_clean"]:
        shapes["acceleration_clean"] = (n_channels, n_samples)
    return ShardWriter(
        path,
        n_records=n_records,
        signals=shapes,
        params=params,
        attributes=root_attributes(config, system),
        compression=config["dataset"]["compression"],
    )


def root_attributes(config: Mapping[str, Any], system: SpurPair) -> dict[str, Any]:
    """What is the same for every record of a data set."""
    pair = system.pair
    rotation = [name.endswith("rotation") for name in system.sensing.channels]
    return {
        "generator_version": __version__,
        "sampling_rate_hz": system.sensing.sampling_rate,
        "usable_band_hz": list(usable_band(system.sensing.sampling_rate)),
        "channel_names": list(system.sensing.channels),
        "channel_units": ["rad/s^2" if turns else "m/s^2" for turns in rotation],
        "class_names": list(config["plan"]["classes"]),
        "n_teeth_pinion": pair.pinion.n_teeth,
        "n_teeth_wheel": pair.wheel.n_teeth,
        "normal_module_mm": from_si("normal_module_mm", pair.pinion.normal_module),
        "pressure_angle_deg": from_si("pressure_angle_deg", pair.pinion.pressure_angle),
        "face_width_mm": from_si("face_width_mm", pair.pinion.face_width),
        "center_distance_mm": from_si("center_distance_mm", pair.center_distance),
        "transverse_contact_ratio": pair.transverse_contact_ratio,
        "config_json": json.dumps({**config, "out": None, "executor": None}, sort_keys=True),
    }
