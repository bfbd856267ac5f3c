"""Forged shards, all alike, and forged indexes, signed again."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from benchmarks._damaged_folders import STRUCTURES, forge
from benchmarks._forged_tables import Forgery, Rng, chosen, every_shard, plan_column


def attribute_value(name: str, *values: Any, where: str = "/") -> Forgery:
    """A root attribute of all shards, or one of a data set."""

    def forgery(folder: Path, rng: Rng) -> None:
        value = chosen(values, rng)

        def change(file: h5py.File) -> None:
            if isinstance(value, str) and value == "gone":
                del file[where].attrs[name]
            elif isinstance(value, np.ndarray) and value.nbytes > 60_000:
                dense_attribute(file, name, value)
            else:
                file[where].attrs[name] = value

        every_shard(folder, change)

    return forgery


def dense_attribute(file: h5py.File, name: str, value: np.ndarray) -> None:
    """An attribute of any size, which the newest format of HDF5 stores apart."""
    path = Path(file.filename)
    newer = path.with_suffix(".new")
    with h5py.File(newer, "w", libver="latest") as other:
        for key in file:
            file.copy(key, other)
        for key in file.attrs:
            other.attrs[key] = file.attrs[key]
        with suppress(KeyError):
            del other.attrs[name]
        other.attrs[name] = value
    file.close()
    os.replace(newer, path)


def data_values(name: str, *values: Any) -> Forgery:
    """One value in all rows of a data set of all shards."""

    def forgery(folder: Path, rng: Rng) -> None:
        value = chosen(values, rng)

        def change(file: h5py.File) -> None:
            file[name][...] = value

        every_shard(folder, change)

    return forgery


def unknown_label(folder: Path, rng: Rng) -> None:
    """A class number that no class has, in plan and shards."""
    value = int(chosen((-1, 4, 999, 32767, -32768), rng))
    plan_column("label", str(value))(folder, rng)
    data_values("label", value)(folder, rng)


def odd_faults(folder: Path, rng: Rng) -> None:
    texts = (
        "{}",
        "[[]]",
        "no",
        '[{"kind":"x"}]',
        '[{"kind":"crack","gear":3,"tooth":1e9}]',
        '[{"kind":"crack","gear":"pinion","tooth":1000000000,"crack_depth_mm":1e9}]',
        "[" * 2000,
        '[{"kind":"crack"}]',
        "null",
        "1" * 4000,
        '["crack"]',
    )
    text = chosen(texts, rng)
    plan_column("faults_json", text)(folder, rng)
    data_values("faults_json", np.bytes_(text.encode()))(folder, rng)


def resized(name: str, tail: tuple[int, ...], **options: Any) -> Forgery:
    """A data set of all shards in another shape behind its rows, hardly stored."""

    def forgery(folder: Path, rng: Rng) -> None:
        def change(file: h5py.File) -> None:
            dtype, n = file[name].dtype, file["record_id"].shape[0]
            del file[name]
            made = file.create_dataset(name, (n, *tail), dtype, **options)
            if options:
                made[0] = np.zeros(made.shape[1:], dtype)

        every_shard(folder, change)

    return forgery


def shard_structure(folder: Path, rng: Rng) -> None:
    """A forbidden structure in all shards alike."""
    names = [name for name in STRUCTURES if name != "another version"]
    change = STRUCTURES[chosen(names, rng)]
    every_shard(folder, lambda file: change(file, folder))


def many_columns(folder: Path, rng: Rng) -> None:
    count = int(chosen((500, 10_001), rng))

    def change(file: h5py.File) -> None:
        n = file["record_id"].shape[0]
        for number in range(count):
            file.create_dataset(f"params/p{number}", data=np.zeros(n))

    every_shard(folder, change)


def many_channels(folder: Path, rng: Rng) -> None:
    """As many channels as names, and many of both."""
    count = int(chosen((10**4, 10**5, 10**6), rng))

    def change(file: h5py.File) -> None:
        n = file["record_id"].shape[0]
        del file["acceleration"]
        file.create_dataset(
            "acceleration",
            data=np.zeros((n, count, 1), "f4"),
            chunks=(1, count, 1),
            compression="gzip",
        )
        dense_attribute(file, "channel_names", np.array([b"a" * 30] * count))

    every_shard(folder, change)


def index_change(change: Callable[[h5py.File, Path, Rng], Any]) -> Forgery:
    def forgery(folder: Path, rng: Rng) -> None:
        with h5py.File(folder / "index.h5", "r+") as file:
            change(file, folder, rng)
        forge(folder)

    return forgery


def index_structure(folder: Path, rng: Rng) -> None:
    """A forbidden structure of a shard in the index."""
    names = (
        "soft link",
        "external link",
        "virtual source outside",
        "external storage",
        "group loop",
        "object type",
        "never written",
        "gzip bomb",
        "chunk bomb",
        "unknown filter",
        "no rows",
        "dangling soft link",
        "empty",
        "scalar",
    )
    change = STRUCTURES[chosen(names, rng)]
    index_change(lambda file, place, _rng: change(file, place))(folder, rng)


def index_source(file: h5py.File, folder: Path, rng: Rng) -> None:
    """A virtual source elsewhere: out of the folder, at another shard, column or stretch."""
    names = (
        "../../outside.h5",
        "/etc/passwd",
        "shards/../../outside.h5",
        "manifest.json",
        "shards/shard-00009.h5",
        ".",
        "shards/shard-%%b.h5",
        "shards/shard-00001.h5",
    )
    n, source = file["label"].shape[0], chosen(names, rng)
    del file["label"]
    layout = h5py.VirtualLayout((n,), "i2")
    layout[:] = h5py.VirtualSource(source, chosen(("label", "repeat"), rng), (n,))
    file.create_virtual_dataset("label", layout, fillvalue=-1)


def index_shape(file: h5py.File, folder: Path, rng: Rng) -> None:
    """Another number of rows than the manifest says, from the right shards."""
    n = int(chosen((1, 10**9, 10**15), rng))
    del file["label"]
    layout = h5py.VirtualLayout((n,), "i2")
    layout[:1] = h5py.VirtualSource("shards/shard-00000.h5", "label", (1,))
    file.create_virtual_dataset("label", layout)


def index_columns(file: h5py.File, folder: Path, rng: Rng) -> None:
    if rng.random() < 0.5:
        del file[chosen(("label", "acceleration", "record_id", "params"), rng)]
    else:
        file.create_dataset("extra", data=np.arange(7))


def index_attribute(file: h5py.File, folder: Path, rng: Rng) -> None:
    name = chosen(("channel_names", "channel_units", "identity", "class_names"), rng)
    file.attrs[name] = chosen((1, "x", [1, 2, 3]), rng)


def index_is_shard(folder: Path, rng: Rng) -> None:
    content = (folder / "shards" / "shard-00000.h5").read_bytes()
    (folder / "index.h5").write_bytes(chosen((content, b"", b"no HDF5"), rng))
    forge(folder)
