"""A set of implants on disk: a data set like any other, less that nothing simulates it again."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from gensig.dataset.columns import GEAR_NAMES, GEAR_PINION_TURNS, GEAR_TEETH
from gensig.dataset.folder.beginning import create_folder, refuse_used
from gensig.dataset.folder.closing import finalize
from gensig.dataset.folder.joining import IMPLANTS
from gensig.dataset.folder.layout import shard_path
from gensig.dataset.folder.manifest import identity_hash, record_shard
from gensig.dataset.folder.run_log import log
from gensig.dataset.schema import IDENTITY, SCHEMA_VERSION
from gensig.dataset.storage.attributes import Attribute
from gensig.dataset.storage.shard import ShardWriter
from gensig.implants.blocks import blocks_content
from gensig.implants.implanting import Implanter
from gensig.signals.resampling import PASS_SHARE
from gensig.version import __version__

PARAMS = "params/"


def write_implants(
    out: Path,
    implanter: Implanter,
    *,
    typed: Sequence[str],
    tell: Callable[[int, int], None] = lambda done, total: None,
) -> None:
    """Write the records of an implanter as a data set, a shard at a time.

    Parameters
    ----------
    out : folder that does not exist, or is empty
    typed : words of the command, for ``overrides.yaml``
    tell : takes the number of records made, and of all

    Raises
    ------
    DatasetError    where ``out`` holds anything, before anything is touched
    """
    refuse_used(out)
    plan, options = implanter.plan.table, implanter.options
    config = configuration(implanter)
    identity = identity_hash(config, __version__)
    create_folder(
        out,
        config=config,
        overrides=typed,
        plan=plan,
        identity=identity,
        seed=options.seed,
        generator_version=__version__,
    )
    first = 0
    for shard, n_rows in enumerate(plan.shard_sizes()):
        writer = _writer(out, implanter, config, identity, shard, n_rows)
        with writer:
            for row in range(n_rows):
                signal = implanter.record(first + row)
                values = _values(implanter, first + row)
                writer.write(row, {"acceleration": signal}, values)
                tell(first + row + 1, plan.n_records)
        record_shard(out, shard, writer.sha256, writer.n_bytes, writer.n_failed)
        log(out, f"shard {shard}: {n_rows} records, {writer.n_bytes} bytes")
        first += n_rows
    finalize(out)


def configuration(implanter: Implanter) -> dict[str, Any]:
    """Content of ``config.yaml``: all that decides the bits, and all blocks."""
    options, manifest = implanter.options, implanter.pairs.data.manifest
    recordings = [
        {
            "file": carrier.name,
            "sha256": carrier.sha256,
            "samples_sha256": carrier.samples_sha256,
            "sampling_rate_hz": carrier.recording.sampling_rate,
            "channels": list(carrier.recording.sensors),
            "n_samples": int(carrier.recording.acceleration.shape[1]),
            "speed_set_rpm": float(carrier.set_rpm),
        }
        for carrier in implanter.carriers
    ]
    return {
        "seed": options.seed,
        "dataset": {"compression": "none", "sample_type": "float32"},
        "plan": {
            "n_records": options.n_records,
            "classes": list(implanter.plan.class_names),
        },
        IMPLANTS: {
            "source_identity": manifest.identity,
            "source_version": manifest.generator_version,
            "teeth": list(implanter.gearing.teeth),
            "gain_low_db": options.gain_db[0],
            "gain_high_db": options.gain_db[1],
            "path": options.path,
            "residual": options.residual,
            "duration_s": options.duration,
            "held_out_share": options.held_out,
            "plain_healthy_share": options.plain_healthy,
            "recordings": recordings,
            "blocks": blocks_content(implanter.cut.blocks),
        },
    }


def _attributes(
    implanter: Implanter, config: dict[str, Any], identity: str
) -> dict[str, Attribute]:
    """Root attributes of the shards."""
    gearing, first = implanter.gearing, implanter.carriers[0].recording
    gears: dict[str, Attribute] = {}
    if gearing.n_stages > 1:
        turns = [1.0 / gearing.turns(gear) for gear in range(len(gearing.teeth))]
        gears = {
            GEAR_NAMES: list(gearing.names),
            GEAR_TEETH: list(gearing.teeth),
            GEAR_PINION_TURNS: turns,
        }
    return {
        "schema_version": SCHEMA_VERSION,
        "generator_version": __version__,
        IDENTITY: identity,
        "sampling_rate_hz": first.sampling_rate,
        "usable_band_hz": [0.0, PASS_SHARE * first.sampling_rate],
        "channel_names": list(first.sensors),
        "channel_units": ["m/s^2"] * len(first.sensors),
        "class_names": list(implanter.plan.class_names),
        "n_teeth_pinion": gearing.teeth[0],
        "n_teeth_wheel": gearing.teeth[1],
        **gears,
        "config_json": json.dumps(config, sort_keys=True),
    }


def _writer(
    out: Path,
    implanter: Implanter,
    config: dict[str, Any],
    identity: str,
    shard: int,
    n_rows: int,
) -> ShardWriter:
    names = implanter.plan.table.columns
    n_channels = len(implanter.carriers[0].recording.sensors)
    return ShardWriter(
        shard_path(out, shard),
        n_records=n_rows,
        signals={"acceleration": (n_channels, implanter.cut.n_samples)},
        params=[name.removeprefix(PARAMS) for name in names if name.startswith(PARAMS)],
        attributes=_attributes(implanter, config, identity),
        shard_index=shard,
    )


def _values(implanter: Implanter, index: int) -> dict[str, str | int | float]:
    """Columns of one record."""
    plan, gearing = implanter.plan.table, implanter.gearing
    only_planned = {
        "shard",
        "row",
        "carrier_file",
        "carrier_block",
        "source_record",
        "second_source_record",
        "source_gear",
    }
    row = plan.record(index)
    speed = implanter.speed_rpm(index)
    gear = implanter.plan.draws[index].gear
    return {
        **{name: value for name, value in row.items() if name not in only_planned},
        "speed_rpm": speed,
        "mesh_frequency_hz": speed / 60.0 * gearing.mesh_order(gear),
    }
