"""Data sets that a stranger made to mislead, every digest, size and identity recomputed.

One forgery a seed, the same for the same seed. Whatever `FORGERIES` change, the set says of itself
that it is whole: only the values tell.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import _forged_hdf5 as hdf5
from benchmarks import _forged_tables as tables
from benchmarks._damaged_folders import Mutant
from benchmarks._forged_tables import (
    COUNTS,
    FORBIDDEN_TEXT,
    Forgery,
    Rng,
    chosen,
    edited,
)

PARTS = (
    "manifest.json",
    "plan.csv",
    "config.yaml",
    "overrides.yaml",
    "index.h5",
    "SHA256SUMS",
    "README.md",
    "croissant.json",
    "run.log",
    "splits/by_unit.csv",
    "shards/shard-00001.h5",
    "figures",
    "splits",
    "shards",
    ".beginning",
)


def pipe(path: Path) -> None:
    os.mkfifo(path)


def bound_socket(path: Path) -> None:
    here = os.getcwd()
    os.chdir(path.parent)  # the path of a socket is short
    with socket.socket(socket.AF_UNIX) as made:
        made.bind(path.name)
    os.chdir(here)


def device(path: Path) -> None:
    try:
        os.mknod(path, 0o600 | 0o020000, os.makedev(1, 5))  # zeros without end
    except PermissionError:
        pipe(path)


def special_file(make: Callable[[Path], Any]) -> Forgery:
    def forgery(folder: Path, rng: Rng) -> None:
        path = folder / chosen(PARTS, rng)
        if rng.random() < 0.3:
            with edited(folder / "manifest.json") as content:
                content["state"] = "incomplete"
                content["shards"][-1]["state"] = "planned"
            path = folder / chosen((*PARTS, "shards/.shard-00002.h5.done"), rng)
        if path.exists():
            path.rename(folder.parent / "moved")
        make(path)

    return forgery


_LONG_NAMES = np.array([b"a" * 400] * 10**5)
_FAST_GZIP: dict[str, Any] = {"compression": "gzip", "compression_opts": 1}
_SOME = np.array(["a", "b"], dtype=object)
# fmt: off
FORGERIES: dict[str, Forgery] = {
    "manifest: rows of a finished shard": tables.manifest_rows("done"),
    "manifest: rows of a planned shard": tables.manifest_rows("planned"),
    "manifest: many finished shards": tables.many_shards("done"),
    "manifest: many planned shards": tables.many_shards("planned"),
    "manifest: bytes": tables.shard_entry_value("bytes", *COUNTS),
    "manifest: failures": tables.shard_entry_value("n_failed", *COUNTS, 3),
    "manifest: seed": tables.manifest_value("seed", *COUNTS, 10**400, 1),
    "manifest: generator": tables.manifest_value(
        "generator_version", "9" * 10**6, "0.1.0", *FORBIDDEN_TEXT
    ),
    "manifest: environment": tables.manifest_change(tables.odd_environment),
    "manifest: many files": tables.manifest_change(tables.listed_files),
    "manifest: deep": tables.manifest_change(tables.deep_values),
    "plan: many rows": tables.table_change(tables.long_plan),
    "plan: many columns": tables.table_change(tables.wide_plan),
    "plan: one wide cell": tables.table_change(tables.wide_cell),
    "plan: shard": tables.plan_column(
        "shard", *map(str, COUNTS), "-1", "1.5", whole=False
    ),
    "plan: row": tables.plan_column("row", *map(str, COUNTS), "-1", whole=False),
    "plan: id": tables.plan_column(
        "record_id", "../x", "r000001", "", "a" * 10**5, "é", whole=False
    ),
    "plan: speed": tables.plan_column(
        "speed_set_rpm", "nan", "inf", "-1", "0", "1e300", "1e-300"
    ),
    "plan: torque": tables.plan_column("torque_nm", "nan", "inf", "-1e300", "1e300"),
    "plan: text": tables.plan_column("condition_id", *FORBIDDEN_TEXT, "a" * 70),
    "plan: parameter": tables.plan_column(
        "params/fault.crack_depth_mm", "nan", "inf", "1e300", "x"
    ),
    "splits: many rows": tables.table_change(tables.long_split, "splits/by_unit.csv"),
    "splits: one wide cell": tables.table_change(
        tables.wide_split, "splits/by_unit.csv"
    ),
    "splits: fractions": tables.split_column(
        "start_fraction", "nan", "-1", "0.99999999", "1e-300"
    ),
    "splits: ends": tables.split_column("stop_fraction", "1e-300", "1e-9", "inf", "2"),
    "splits: subset": tables.split_column(
        "subset", "x", "test", "train", *FORBIDDEN_TEXT
    ),
    "splits: records": tables.split_column("record_id", "r000000", "x", "é", ""),
    "config: records": tables.setting(
        "plan.n_records", *COUNTS, -1, 0, "x", None, [1], 1.5
    ),
    "config: records a shard": tables.setting(
        "dataset.records_per_shard", *COUNTS, -1, 0, "x", None, 1.5
    ),
    "config: duration": tables.setting(
        "operating.duration_s", 1e6, 1e12, 1e300, -1, 0, float("inf"), float("nan"), "x"
    ),
    "config: rate": tables.setting(
        "sensing.sampling_rate_hz", 1e12, 1e300, -1, 0, "x", True
    ),
    "config: units": tables.setting("plan.n_gearboxes", *COUNTS, -1, "x"),
    "config: classes": tables.setting(
        "plan.classes", [], "x", ["x"] * 10**4, [1], {"a": 1}, None
    ),
    "config: sections": tables.setting("sensing", None, 1, [], {}, "x"),
    "config: gear": tables.setting("gear", None, [], {"a": 1}, "x"),
    "config: compression": tables.setting("dataset.compression", "x", 1, None, []),
    "config: out": tables.setting("out", "../evil", "/dev/null", 1),
    "shards: units of numbers": hdf5.attribute_value(
        "channel_units", [1, 2, 3, 4], 5, [1.5] * 4, "m/s^2"
    ),
    "shards: other units": hdf5.attribute_value(
        "channel_units",
        _SOME,
        np.array(["x"] * 4, dtype=object),
        _LONG_NAMES,
        np.array(["\x1b[2J"] * 4, dtype=object),
        "gone",
    ),
    "shards: unit of a data set": hdf5.attribute_value(
        "unit", 5, [1, 2], "\x1b[2J", where="acceleration"
    ),
    "shards: channel names": hdf5.attribute_value(
        "channel_names",
        np.array(["a"] * 4, dtype=object),
        _LONG_NAMES,
        5,
        [1, 2, 3, 4],
        np.array(["", "\x1b", "<b>", "a"], dtype=object),
    ),
    "shards: many channels": hdf5.many_channels,
    "shards: class names": hdf5.attribute_value(
        "class_names",
        _SOME,
        _LONG_NAMES,
        np.array(["a"] * 4, dtype=object),
        5,
        np.array(["\x1b", "<b>", "", "crack"], dtype=object),
    ),
    "shards: source names": hdf5.attribute_value(
        "source_names", 5, [1], _LONG_NAMES, "x", "gone"
    ),
    "shards: rate": hdf5.attribute_value(
        "sampling_rate_hz", 1e-300, 1e300, 2**62, float("nan"), [1.0]
    ),
    "shards: band": hdf5.attribute_value(
        "usable_band_hz", "x", [1.0], [5.0, 1.0], [np.nan, np.inf], 3
    ),
    "shards: configuration": hdf5.attribute_value(
        "config_json",
        "[" * 50_000,
        "1",
        "[]",
        "{}",
        5,
        '{"plan":3}',
        '{"gear":[]}',
        "x",
    ),
    "shards: teeth": hdf5.attribute_value(
        "n_teeth_pinion", 0, -1, 2**62, "x", 1.5, [1, 2], "gone"
    ),
    "shards: gears": hdf5.attribute_value("gear_names", 5, [1, 2], _SOME, _LONG_NAMES),
    "shards: gear teeth": hdf5.attribute_value("gear_teeth", 5, "x", [1], [0] * 5000),
    "shards: geometry": hdf5.attribute_value(
        "normal_module_mm", 0.0, np.nan, 1e300, "x", [1.0]
    ),
    "shards: torque of": hdf5.attribute_value("torque_of", 5, [1], "\x1b[2J", "x"),
    "shards: generator": hdf5.attribute_value(
        "generator_version", 5, "x" * 50_000, "\x1b[2J"
    ),
    "shards: label": hdf5.unknown_label,
    "shards: faults": hdf5.odd_faults,
    "shards: speed": hdf5.data_values(
        "speed_rpm", np.nan, 0.0, -1.0, 1e300, np.inf, 1e-300
    ),
    "shards: severity": hdf5.data_values("severity", np.nan, -1.0, 1e300, np.inf),
    "shards: status": hdf5.data_values("status", b"failed", b"x", b"", b"\xff"),
    "shards: teeth of faults": hdf5.data_values("fault_tooth", 2**31 - 1, -(2**31)),
    "shards: powers": hdf5.data_values("signal_power", np.nan, -1.0, 1e300, 0.0),
    "shards: samples": hdf5.data_values(
        "acceleration", np.inf, np.nan, 0.0, 3e38, 1e-40
    ),
    "shards: no sample": hdf5.resized("acceleration", (4, 0)),
    "shards: one sample": hdf5.resized("acceleration", (4, 1), chunks=(1, 4, 1)),
    "shards: no channel": hdf5.resized("acceleration", (0, 10)),
    "shards: absurd samples": hdf5.resized(
        "acceleration", (4, 10**7), chunks=(1, 4, 10**6), **_FAST_GZIP
    ),
    "shards: absurd chunk": hdf5.resized(
        "acceleration", (4, 35 * 10**6), chunks=(1, 4, 35 * 10**6), **_FAST_GZIP
    ),
    "shards: structure": hdf5.shard_structure,
    "shards: many columns": hdf5.many_columns,
    "index: structure": hdf5.index_structure,
    "index: source": hdf5.index_change(hdf5.index_source),
    "index: shape": hdf5.index_change(hdf5.index_shape),
    "index: columns": hdf5.index_change(hdf5.index_columns),
    "index: attribute": hdf5.index_change(hdf5.index_attribute),
    "index: another file": hdf5.index_is_shard,
    "special: pipe": special_file(pipe),
    "special: socket": special_file(bound_socket),
    "special: device": special_file(device),
    "special: folder": special_file(Path.mkdir),
}
# fmt: on
# forgeries that every reader must refuse, and not only `gensig verify`
REFUSED = frozenset(
    name
    for name in FORGERIES
    if name
    in ("index: structure", "index: source", "index: shape", "shards: structure")
)


def forge_set(folder: Path, seed: int) -> Mutant:
    """Forge the set of a seed in a folder."""
    names = list(FORGERIES)
    name = names[seed % len(names)]
    FORGERIES[name](folder, np.random.default_rng(seed))
    return Mutant(kind=name, forged=True, refused=name in REFUSED)
