"""A set of implants on disk: a data set like any other, made of recordings instead of a plan alone.

Its folder names its sources (`gensig.implants.implant_sources`), so that a run that was killed goes
on with the bits of an undisturbed one, or says which source is gone.
"""

from __future__ import annotations

import functools
import json
from pathlib import Path
from typing import Any

from gensig.dataset.columns import GEAR_NAMES, GEAR_PINION_TURNS, GEAR_TEETH
from gensig.dataset.folder.beginning import create_folder
from gensig.dataset.folder.joining import IMPLANTS
from gensig.dataset.folder.layout import (
    FINGERPRINTS,
    OVERRIDES,
    PLAN,
    ConfigContent,
    Manifest,
    ShardEntry,
    read_config,
    read_manifest,
    shard_path,
)
from gensig.dataset.folder.manifest import differing_keys, identity_hash
from gensig.dataset.folder.run_log import log
from gensig.dataset.plan import Plan, plan_text
from gensig.dataset.schema import IDENTITY, SCHEMA_VERSION
from gensig.dataset.storage.atomic import sha256_file, sha256_text
from gensig.dataset.storage.attributes import Attribute
from gensig.dataset.storage.guard import same_file
from gensig.dataset.storage.receipts import write_receipt
from gensig.dataset.storage.shard import ShardWriter
from gensig.errors import DatasetError
from gensig.execution.local import LocalExecutor
from gensig.implants.blocks import blocks_content
from gensig.implants.fingerprints import fingerprints_content, fingerprints_of
from gensig.implants.implant_sources import (
    ImplantSources,
    open_implanter,
    read_sources,
    source_words,
)
from gensig.implants.implanting import Implanter
from gensig.production.folder import SIMULATION, Maker
from gensig.production.record_counts import RecordCounts
from gensig.signals.resampling import PASS_SHARE
from gensig.version import __version__

PARAMS = "params/"
# blocks are cut and records are made in this process: the implanter is at hand
HERE = LocalExecutor(n_workers=1)


def begin_implants(out: Path, implanter: Implanter, sources: ImplantSources) -> Maker:
    """Make the folder of a set of implants; returns the maker of its shards, for `HERE`.

    Raises
    ------
    DatasetError    where ``out`` holds anything, before anything is touched
    """
    plan, config = implanter.plan.table, configuration(implanter)
    create_folder(
        out,
        config=config | {FINGERPRINTS: _fingerprints(implanter)},
        overrides=source_words(sources, out),
        plan=plan,
        seed=implanter.options.seed,
        generator_version=__version__,
    )
    planned = f"{plan.n_records} records in {plan.n_shards} shards are planned"
    log(out, f"gensig {__version__}: {planned}")
    return Maker(
        plan=lambda *_: plan,
        check=lambda _: None,
        write=functools.partial(write_implant_shard, implanter=implanter),
    )


def maker_of(out: Path) -> Maker:
    """The maker of what a folder lacks: by its recordings, or by simulation."""
    if IMPLANTS in read_config(out):
        return IMPLANTING
    return SIMULATION


def write_implant_shard(
    out: Path,
    shard_index: int,
    *,
    counts: RecordCounts | None = None,
    implanter: Implanter | None = None,
) -> ShardEntry:
    """Write one shard; its bits depend on the folder's sources only.

    Parameters
    ----------
    counts : takes the records that are written
    implanter : of the folder; None opens its sources

    Raises
    ------
    DatasetError    as `_sources_checked`
    """
    implanter = implanter or _implanter(out)
    sizes = implanter.plan.table.shard_sizes()
    n_rows, first = sizes[shard_index], sum(sizes[:shard_index])
    writer = _writer(out, implanter, shard_index, n_rows)
    with writer:
        if counts is not None:
            counts.begin(shard_index)
        for row in range(n_rows):
            signal = implanter.record(first + row)
            values = _values(implanter, first + row)
            writer.write(row, {"acceleration": signal}, values)
            if counts is not None:
                counts.set(shard_index, row + 1)
    write_receipt(out, shard_index, writer.entry)
    return writer.entry


def _implanter(out: Path) -> Implanter:
    return _opened(out, same_file(out / OVERRIDES))


@functools.lru_cache(maxsize=1)
def _opened(out: Path, _changed: tuple[int, ...]) -> Implanter:
    """Implanter of the sources that a folder names, opened once for all its shards."""
    manifest, config = read_manifest(out), read_config(out)
    sources = _sources_checked(out, manifest, config)
    implanter = open_implanter(sources)
    made = configuration(implanter)
    keys = differing_keys(config, made)
    if identity_hash(made, __version__) != manifest.identity or keys:
        raise _other_set(out, f"another {', '.join(keys[:3])}")
    text = plan_text(implanter.plan.table)
    if sha256_text(text) != manifest.files.get(PLAN):
        raise _other_set(out, f"another {PLAN}")
    return implanter


def _other_set(out: Path, what: str) -> DatasetError:
    return DatasetError(
        f"{out}: its sources give {what} here than where it was begun; go on with the libraries "
        "that its manifest.json names, or give the same `gensig implant` another out=DIR"
    )


def _sources_checked(
    out: Path, manifest: Manifest, config: ConfigContent
) -> ImplantSources:
    """Sources of a folder, none of them gone or altered.

    Raises
    ------
    DatasetError    with one line, for the first that is
    """
    if manifest.files.get(OVERRIDES) != sha256_file(out / OVERRIDES):
        raise DatasetError(
            f"{out / OVERRIDES} was altered, and names the sources; restore it from a copy"
        )
    sources = read_sources(out)
    try:
        section = config[IMPLANTS]
        identity = section["source_identity"]
        digests = [entry["sha256"] for entry in section["recordings"]]
    except (KeyError, TypeError) as error:
        raise DatasetError(
            f"the configuration of {out} names no sources; restore it from a copy"
        ) from error
    for file, digest in zip(sources.files or (), digests, strict=False):
        if not file.is_file():
            raise DatasetError(
                f"{file} is gone, a recording that {out} is made of; put it back there, or "
                f"{out.name} where it was, then `gensig resume` goes on"
            )
        if sha256_file(file) != digest:
            raise DatasetError(
                f"{file} was altered since {out} was begun with it; put the recording back as "
                "it was, or give the same `gensig implant` another out=DIR"
            )
    try:
        found = read_manifest(sources.data).identity
    except DatasetError as error:
        raise DatasetError(
            f"{sources.data} is gone, the simulated set that {out} is made of; put it back "
            f"there, or {out.name} where it was, then `gensig resume` goes on"
        ) from error
    if found != identity:
        raise DatasetError(
            f"{sources.data} is another simulated set than {out} was begun with; put that back, "
            "or give the same `gensig implant` another out=DIR"
        )
    return sources


def _planned_again(out: Path, _config: ConfigContent) -> Plan:
    return _implanter(out).plan.table


def _check(out: Path) -> None:
    _implanter(out)


IMPLANTING = Maker(plan=_planned_again, check=_check, write=write_implant_shard)


def configuration(implanter: Implanter) -> dict[str, Any]:
    """Content of ``config.yaml`` but fingerprints: what decides the bits, and all blocks."""
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


def _fingerprints(implanter: Implanter) -> list[dict[str, Any]]:
    """Fingerprints of all recordings, as plain values."""
    recordings = {
        carrier.samples_sha256: carrier.recording for carrier in implanter.carriers
    }
    return fingerprints_content(fingerprints_of(recordings))


def _attributes(implanter: Implanter) -> dict[str, Attribute]:
    """Root attributes of the shards."""
    config = configuration(implanter)
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
        IDENTITY: identity_hash(config, __version__),
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


def _writer(out: Path, implanter: Implanter, shard: int, n_rows: int) -> ShardWriter:
    names = implanter.plan.table.columns
    n_channels = len(implanter.carriers[0].recording.sensors)
    return ShardWriter(
        shard_path(out, shard),
        n_records=n_rows,
        signals={"acceleration": (n_channels, implanter.cut.n_samples)},
        params=[name.removeprefix(PARAMS) for name in names if name.startswith(PARAMS)],
        attributes=_attributes(implanter),
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
