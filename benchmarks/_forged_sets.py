"""Data sets that a stranger made to mislead, every digest, size and identity recomputed.

One forgery a seed, the same for the same seed. Whatever `FORGERIES` change, the set says of itself
that it is whole: only the values tell.
"""

from __future__ import annotations

import csv
import json
import os
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import yaml

from benchmarks._damaged_folders import STRUCTURES, Mutant, forge, forge_checksums
from gensig.dataset.folder.layout import read_manifest, shard_name
from gensig.dataset.folder.manifest import identity_hash
from gensig.dataset.storage.index import write_index

Rng = np.random.Generator
Forgery = Callable[[Path, Rng], None]
# counts that no folder of this size holds; the last ones fit no integer of numpy
COUNTS = (10**6, 10**7, 10**9, 10**12, 2**31, 2**63 - 1, 2**63, 10**30)
FORBIDDEN_TEXT = (
    "\x1b[2J",
    "<script>alert(1)</script>",
    "=cmd|' /C calc'!A0",
    "é" * 40,
)


def forge_set(folder: Path, seed: int) -> Mutant:
    """Forge the set of a seed in a folder."""
    names = list(FORGERIES)
    name = names[seed % len(names)]
    FORGERIES[name](folder, np.random.default_rng(seed))
    return Mutant(kind=name, forged=True, refused=name in REFUSED)


@contextmanager
def edited(path: Path) -> Iterator[Any]:
    """Content of a JSON or YAML file, written back after the change."""
    text = path.read_text(encoding="utf-8")
    is_json = path.suffix == ".json"
    content = json.loads(text) if is_json else yaml.safe_load(text)
    yield content
    text = json.dumps(content) if is_json else yaml.safe_dump(content)
    path.write_text(text, encoding="utf-8")


@contextmanager
def rows_of(path: Path) -> Iterator[list[list[str]]]:
    """Rows of a CSV file with its header, written back after the change."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    yield rows
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def every_shard(folder: Path, change: Callable[[h5py.File], Any]) -> None:
    """Change all shards alike, write the index over them, and sign the folder again."""
    for path in sorted((folder / "shards").iterdir()):
        with h5py.File(path, "r+") as file:
            change(file)
    with suppress(Exception):  # the shards are refused: the old index stays
        write_index(folder, read_manifest(folder))
    forge(folder)


def reidentify(folder: Path) -> None:
    """Give manifest and shards the identity of the configuration that now lies in the folder."""
    config = yaml.safe_load((folder / "config.yaml").read_text(encoding="utf-8"))
    with edited(folder / "manifest.json") as manifest:
        identity = identity_hash(config, manifest["generator_version"])
        manifest |= {"identity": identity, "configuration": config}
    every_shard(
        folder, lambda file: file.attrs.modify("identity", np.bytes_(identity.encode()))
    )


def _chosen(values: Any, rng: Rng) -> Any:
    return values[int(rng.integers(len(values)))]


# --- manifest ---------------------------------------------------------------------------------


def _manifest(change: Callable[[dict[str, Any], Rng], Any]) -> Forgery:
    def forgery(folder: Path, rng: Rng) -> None:
        with edited(folder / "manifest.json") as content:
            change(content, rng)
        forge_checksums(folder)

    return forgery


def _rows(state: str) -> Forgery:
    """Rows of one shard and of the set, which agree and are absurd."""

    def change(content: dict[str, Any], rng: Rng) -> None:
        entry = _chosen(content["shards"], rng)
        count = _chosen(COUNTS, rng)
        content["n_records"] += count - entry["rows"]
        entry |= {"rows": count, "state": state}
        if state == "planned":
            content["state"] = "incomplete"

    return _manifest(change)


def _many_shards(state: str) -> Forgery:
    def change(content: dict[str, Any], rng: Rng) -> None:
        last, count = content["shards"][-1], _chosen((10**4, 2 * 10**5), rng)
        first = len(content["shards"])
        more = [
            last | {"name": shard_name(first + i), "state": state} for i in range(count)
        ]
        content["shards"] += more
        content["n_records"] += last["rows"] * count
        if state == "planned":
            content["state"] = "incomplete"

    return _manifest(change)


def _value(key: str, *values: Any) -> Forgery:
    return _manifest(lambda content, rng: content.update({key: _chosen(values, rng)}))


def _entry(key: str, *values: Any) -> Forgery:
    def change(content: dict[str, Any], rng: Rng) -> None:
        _chosen(content["shards"], rng)[key] = _chosen(values, rng)

    return _manifest(change)


def _environment(content: dict[str, Any], rng: Rng) -> None:
    values = (["a", 1], {"b": {}}, "x" * 10**6, 10**300, None, *FORBIDDEN_TEXT)
    for key in content["environment"]:
        content["environment"][key] = _chosen(values, rng)


def _listed_files(content: dict[str, Any], rng: Rng) -> None:
    count = _chosen((10**3, 10**5), rng)
    names = [f"splits/a{number}.csv" for number in range(count)]
    content["files"] |= dict.fromkeys(names, "0" * 64)


def _deep(content: dict[str, Any], rng: Rng) -> None:
    deep: Any = 1
    for _ in range(int(_chosen((60, 900), rng))):
        deep = {"a": deep}
    content[_chosen(("configuration", "environment"), rng)] = {"deep": deep}


# --- plan and splits --------------------------------------------------------------------------


def _plan(
    change: Callable[[list[list[str]], Rng], Any], name: str = "plan.csv"
) -> Forgery:
    def forgery(folder: Path, rng: Rng) -> None:
        with rows_of(folder / name) as rows:
            change(rows, rng)
        forge(folder)

    return forgery


def _column(name: str, *values: str, whole: bool = True) -> Forgery:
    """A value in a column of the plan: in all rows, or in one."""

    def change(rows: list[list[str]], rng: Rng) -> None:
        place, value = rows[0].index(name), _chosen(values, rng)
        for row in rows[1:] if whole else [_chosen(rows[1:], rng)]:
            row[place] = value

    return _plan(change)


def _long_plan(rows: list[list[str]], rng: Rng) -> None:
    row = rows[-1]
    for number in range(int(_chosen((10**4, 3 * 10**5), rng))):
        rows.append([f"x{number}", row[1], str(int(row[2]) + 1 + number), *row[3:]])


def _wide_plan(rows: list[list[str]], rng: Rng) -> None:
    count = int(_chosen((10**3, 10**5), rng))
    rows[0] += [f"more{number}" for number in range(count)]
    for row in rows[1:]:
        row += ["1"] * count


def _wide_cell(rows: list[list[str]], rng: Rng) -> None:
    """One long text, which an array of text repeats for every row."""
    row = rows[-1]
    if len(rows) < 1000:
        _long_plan(rows, rng)
    row[_chosen((0, len(row) - 1), rng)] = "a" * 10**6


def _split_column(name: str, *values: str) -> Forgery:
    def change(rows: list[list[str]], rng: Rng) -> None:
        place = rows[0].index(name)
        for row in rows[1 : 1 + int(_chosen((1, len(rows)), rng))]:
            row[place] = _chosen(values, rng)

    return _plan(change, "splits/by_unit.csv")


def _long_split(rows: list[list[str]], rng: Rng) -> None:
    record, _, _, subset = rows[1]
    count = int(_chosen((10**4, 10**6), rng))
    rows += [
        [record, repr(i / count), repr((i + 1) / count), subset] for i in range(count)
    ]


def _wide_split(rows: list[list[str]], rng: Rng) -> None:
    _long_split(rows, rng)
    rows[-1][0] = "a" * 10**6


# --- configuration ----------------------------------------------------------------------------


def _setting(key: str, *values: Any) -> Forgery:
    """A value of the configuration, with an identity that agrees."""

    def forgery(folder: Path, rng: Rng) -> None:
        with edited(folder / "config.yaml") as content:
            *above, last = key.split(".")
            part = content
            for name in above:
                part = part[name]
            part[last] = _chosen(values, rng)
        reidentify(folder)
        if rng.random() < 0.5:  # resume has something to make
            with edited(folder / "manifest.json") as manifest:
                manifest["state"] = "incomplete"
                manifest["shards"][-1]["state"] = "planned"

    return forgery


# --- shards -----------------------------------------------------------------------------------


def _attribute(name: str, *values: Any, where: str = "/") -> Forgery:
    """A root attribute of all shards, or one of a data set."""

    def forgery(folder: Path, rng: Rng) -> None:
        value = _chosen(values, rng)

        def change(file: h5py.File) -> None:
            if isinstance(value, str) and value == "gone":
                del file[where].attrs[name]
            elif isinstance(value, np.ndarray) and value.nbytes > 60_000:
                _dense(file, name, value)
            else:
                file[where].attrs[name] = value

        every_shard(folder, change)

    return forgery


def _dense(file: h5py.File, name: str, value: np.ndarray) -> None:
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


def _values(name: str, *values: Any) -> Forgery:
    """One value in all rows of a data set of all shards."""

    def forgery(folder: Path, rng: Rng) -> None:
        value = _chosen(values, rng)

        def change(file: h5py.File) -> None:
            file[name][...] = value

        every_shard(folder, change)

    return forgery


def _label(folder: Path, rng: Rng) -> None:
    """A class number that no class has, in plan and shards."""
    value = int(_chosen((-1, 4, 999, 32767, -32768), rng))
    _column("label", str(value))(folder, rng)
    _values("label", value)(folder, rng)


def _faults(folder: Path, rng: Rng) -> None:
    texts = (
        "{}", "[[]]", "no", '[{"kind":"x"}]', '[{"kind":"crack","gear":3,"tooth":1e9}]',
        '[{"kind":"crack","gear":"pinion","tooth":1000000000,"crack_depth_mm":1e9}]',
        "[" * 2000, '[{"kind":"crack"}]', "null", "1" * 4000, '["crack"]',
    )  # fmt: skip
    text = _chosen(texts, rng)
    _column("faults_json", text)(folder, rng)
    _values("faults_json", np.bytes_(text.encode()))(folder, rng)


def _resized(name: str, tail: tuple[int, ...], **options: Any) -> Forgery:
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


def _structure(folder: Path, rng: Rng) -> None:
    """A forbidden structure in all shards alike."""
    names = [name for name in STRUCTURES if name != "another version"]
    change = STRUCTURES[_chosen(names, rng)]
    every_shard(folder, lambda file: change(file, folder))


def _many_columns(folder: Path, rng: Rng) -> None:
    count = int(_chosen((2000, 20000), rng))

    def change(file: h5py.File) -> None:
        n = file["record_id"].shape[0]
        for number in range(count):
            file.create_dataset(f"params/p{number}", data=np.zeros(n))

    every_shard(folder, change)


def _many_channels(folder: Path, rng: Rng) -> None:
    """As many channels as names, and many of both."""
    count = int(_chosen((10**4, 10**5, 10**6), rng))

    def change(file: h5py.File) -> None:
        n = file["record_id"].shape[0]
        del file["acceleration"]
        file.create_dataset(
            "acceleration",
            data=np.zeros((n, count, 1), "f4"),
            chunks=(1, count, 1),
            compression="gzip",
        )
        _dense(file, "channel_names", np.array([b"a" * 30] * count))

    every_shard(folder, change)


# --- index.h5 ---------------------------------------------------------------------------------


def _index(change: Callable[[h5py.File, Path, Rng], Any]) -> Forgery:
    def forgery(folder: Path, rng: Rng) -> None:
        with h5py.File(folder / "index.h5", "r+") as file:
            change(file, folder, rng)
        forge(folder)

    return forgery


def _index_structure(folder: Path, rng: Rng) -> None:
    """A forbidden structure of a shard in the index."""
    names = ("soft link", "external link", "virtual source outside", "external storage",
             "group loop", "object type", "never written", "gzip bomb", "chunk bomb",
             "unknown filter", "no rows", "dangling soft link", "empty", "scalar")  # fmt: skip
    change = STRUCTURES[_chosen(names, rng)]
    _index(lambda file, place, _rng: change(file, place))(folder, rng)


def _index_source(file: h5py.File, folder: Path, rng: Rng) -> None:
    """A virtual source elsewhere: out of the folder, at another shard, column or stretch."""
    names = ("../../outside.h5", "/etc/passwd", "shards/../../outside.h5", "manifest.json",
             "shards/shard-00009.h5", ".", "shards/shard-%b.h5", "shards/shard-00001.h5")  # fmt: skip
    n, source = file["label"].shape[0], _chosen(names, rng)
    del file["label"]
    layout = h5py.VirtualLayout((n,), "i2")
    layout[:] = h5py.VirtualSource(source, _chosen(("label", "repeat"), rng), (n,))
    file.create_virtual_dataset("label", layout, fillvalue=-1)


def _index_shape(file: h5py.File, folder: Path, rng: Rng) -> None:
    """Another number of rows than the manifest says, from the right shards."""
    n = int(_chosen((1, 10**9, 10**15), rng))
    del file["label"]
    layout = h5py.VirtualLayout((n,), "i2")
    layout[:1] = h5py.VirtualSource("shards/shard-00000.h5", "label", (1,))
    file.create_virtual_dataset("label", layout)


def _index_columns(file: h5py.File, folder: Path, rng: Rng) -> None:
    if rng.random() < 0.5:
        del file[_chosen(("label", "acceleration", "record_id", "params"), rng)]
    else:
        file.create_dataset("extra", data=np.arange(7))


def _index_attribute(file: h5py.File, folder: Path, rng: Rng) -> None:
    name = _chosen(("channel_names", "channel_units", "identity", "class_names"), rng)
    file.attrs[name] = _chosen((1, "x", [1, 2, 3]), rng)


def _index_is_shard(folder: Path, rng: Rng) -> None:
    content = (folder / "shards" / "shard-00000.h5").read_bytes()
    (folder / "index.h5").write_bytes(_chosen((content, b"", b"no HDF5"), rng))
    forge(folder)


# --- what is no ordinary file -----------------------------------------------------------------

PARTS = (
    "manifest.json", "plan.csv", "config.yaml", "overrides.yaml", "index.h5", "SHA256SUMS",
    "README.md", "croissant.json", "run.log", "splits/by_unit.csv", "shards/shard-00001.h5",
    "figures", "splits", "shards", ".beginning",
)  # fmt: skip


def _pipe(path: Path) -> None:
    os.mkfifo(path)


def _socket(path: Path) -> None:
    here = os.getcwd()
    os.chdir(path.parent)  # the path of a socket is short
    with socket.socket(socket.AF_UNIX) as made:
        made.bind(path.name)
    os.chdir(here)


def _device(path: Path) -> None:
    try:
        os.mknod(path, 0o600 | 0o020000, os.makedev(1, 5))  # zeros without end
    except PermissionError:
        _pipe(path)


def _special(make: Callable[[Path], Any]) -> Forgery:
    def forgery(folder: Path, rng: Rng) -> None:
        path = folder / _chosen(PARTS, rng)
        if rng.random() < 0.3:
            with edited(folder / "manifest.json") as content:
                content["state"] = "incomplete"
                content["shards"][-1]["state"] = "planned"
            path = folder / _chosen((*PARTS, "shards/.shard-00002.h5.done"), rng)
        if path.exists():
            path.rename(folder.parent / "moved")
        make(path)

    return forgery


_LONG_NAMES = np.array([b"a" * 400] * 10**5)
_SOME = np.array(["a", "b"], dtype=object)
FORGERIES: dict[str, Forgery] = {
    "manifest: rows of a finished shard": _rows("done"),
    "manifest: rows of a planned shard": _rows("planned"),
    "manifest: many finished shards": _many_shards("done"),
    "manifest: many planned shards": _many_shards("planned"),
    "manifest: bytes": _entry("bytes", *COUNTS),
    "manifest: failures": _entry("n_failed", *COUNTS, 3),
    "manifest: seed": _value("seed", *COUNTS, 10**400, 1),
    "manifest: generator": _value("generator_version", "9" * 10**6, "0.1.0", *FORBIDDEN_TEXT),
    "manifest: environment": _manifest(_environment),
    "manifest: many files": _manifest(_listed_files),
    "manifest: deep": _manifest(_deep),
    "plan: many rows": _plan(_long_plan),
    "plan: many columns": _plan(_wide_plan),
    "plan: one wide cell": _plan(_wide_cell),
    "plan: shard": _column("shard", *map(str, COUNTS), "-1", "1.5", whole=False),
    "plan: row": _column("row", *map(str, COUNTS), "-1", whole=False),
    "plan: id": _column("record_id", "../x", "r000001", "", "a" * 10**5, "é", whole=False),
    "plan: speed": _column("speed_set_rpm", "nan", "inf", "-1", "0", "1e300", "1e-300"),
    "plan: torque": _column("torque_nm", "nan", "inf", "-1e300", "1e300"),
    "plan: text": _column("condition_id", *FORBIDDEN_TEXT, "a" * 70),
    "plan: parameter": _column("params/fault.crack_depth_mm", "nan", "inf", "1e300", "x"),
    "splits: many rows": _plan(_long_split, "splits/by_unit.csv"),
    "splits: one wide cell": _plan(_wide_split, "splits/by_unit.csv"),
    "splits: fractions": _split_column("start_fraction", "nan", "-1", "0.99999999", "1e-300"),
    "splits: ends": _split_column("stop_fraction", "1e-300", "1e-9", "inf", "2"),
    "splits: subset": _split_column("subset", "x", "test", "train", *FORBIDDEN_TEXT),
    "splits: records": _split_column("record_id", "r000000", "x", "é", ""),
    "config: records": _setting("plan.n_records", *COUNTS, -1, 0, "x", None, [1], 1.5),
    "config: records a shard": _setting(
        "dataset.records_per_shard", *COUNTS, -1, 0, "x", None, 1.5
    ),
    "config: duration": _setting(
        "operating.duration_s", 1e6, 1e12, 1e300, -1, 0, float("inf"), float("nan"), "x"
    ),
    "config: rate": _setting("sensing.sampling_rate_hz", 1e12, 1e300, -1, 0, "x", True),
    "config: units": _setting("plan.n_gearboxes", *COUNTS, -1, "x"),
    "config: classes": _setting("plan.classes", [], "x", ["x"] * 10**4, [1], {"a": 1}, None),
    "config: sections": _setting("sensing", None, 1, [], {}, "x"),
    "config: gear": _setting("gear", None, [], {"a": 1}, "x"),
    "config: compression": _setting("dataset.compression", "x", 1, None, []),
    "config: out": _setting("out", "../evil", "/dev/null", 1),
    "shards: units of numbers": _attribute("channel_units", [1, 2, 3, 4], 5, [1.5] * 4, "m/s^2"),
    "shards: other units": _attribute(
        "channel_units", _SOME, np.array(["x"] * 4, dtype=object), _LONG_NAMES,
        np.array(["\x1b[2J"] * 4, dtype=object), "gone",
    ),  # fmt: skip
    "shards: unit of a data set": _attribute(
        "unit", 5, [1, 2], "\x1b[2J", where="acceleration"
    ),
    "shards: channel names": _attribute(
        "channel_names", np.array(["a"] * 4, dtype=object), _LONG_NAMES, 5, [1, 2, 3, 4],
        np.array(["", "\x1b", "<b>", "a"], dtype=object),
    ),  # fmt: skip
    "shards: many channels": _many_channels,
    "shards: class names": _attribute(
        "class_names", _SOME, _LONG_NAMES, np.array(["a"] * 4, dtype=object), 5,
        np.array(["\x1b", "<b>", "", "crack"], dtype=object),
    ),  # fmt: skip
    "shards: source names": _attribute("source_names", 5, [1], _LONG_NAMES, "x", "gone"),
    "shards: rate": _attribute("sampling_rate_hz", 1e-300, 1e300, 2**62, float("nan"), [1.0]),
    "shards: band": _attribute("usable_band_hz", "x", [1.0], [5.0, 1.0], [np.nan, np.inf], 3),
    "shards: configuration": _attribute(
        "config_json", "[" * 50_000, "1", "[]", "{}", 5, '{"plan":3}', '{"gear":[]}', "x"
    ),
    "shards: teeth": _attribute("n_teeth_pinion", 0, -1, 2**62, "x", 1.5, [1, 2], "gone"),
    "shards: gears": _attribute("gear_names", 5, [1, 2], _SOME, _LONG_NAMES),
    "shards: gear teeth": _attribute("gear_teeth", 5, "x", [1], [0] * 5000),
    "shards: geometry": _attribute("normal_module_mm", 0.0, np.nan, 1e300, "x", [1.0]),
    "shards: torque of": _attribute("torque_of", 5, [1], "\x1b[2J", "x"),
    "shards: generator": _attribute("generator_version", 5, "x" * 50_000, "\x1b[2J"),
    "shards: label": _label,
    "shards: faults": _faults,
    "shards: speed": _values("speed_rpm", np.nan, 0.0, -1.0, 1e300, np.inf, 1e-300),
    "shards: severity": _values("severity", np.nan, -1.0, 1e300, np.inf),
    "shards: status": _values("status", b"failed", b"x", b"", b"\xff"),
    "shards: teeth of faults": _values("fault_tooth", 2**31 - 1, -(2**31)),
    "shards: powers": _values("signal_power", np.nan, -1.0, 1e300, 0.0),
    "shards: samples": _values("acceleration", np.inf, np.nan, 0.0, 3e38, 1e-40),
    "shards: no sample": _resized("acceleration", (4, 0)),
    "shards: one sample": _resized("acceleration", (4, 1), chunks=(1, 4, 1)),
    "shards: no channel": _resized("acceleration", (0, 10)),
    "shards: absurd samples": _resized("acceleration", (4, 2 * 10**7), chunks=(1, 4, 2 * 10**6), compression="gzip"),
    "shards: absurd chunk": _resized("acceleration", (4, 6 * 10**7), chunks=(1, 4, 6 * 10**7), compression="gzip"),
    "shards: structure": _structure,
    "shards: many columns": _many_columns,
    "index: structure": _index_structure,
    "index: source": _index(_index_source),
    "index: shape": _index(_index_shape),
    "index: columns": _index(_index_columns),
    "index: attribute": _index(_index_attribute),
    "index: another file": _index_is_shard,
    "special: pipe": _special(_pipe),
    "special: socket": _special(_socket),
    "special: device": _special(_device),
    "special: folder": _special(Path.mkdir),
}  # fmt: skip
# forgeries that every reader must refuse, and not only `gensig verify`
REFUSED = frozenset(
    name for name in FORGERIES
    if name in ("index: structure", "index: source", "index: shape", "shards: structure")
)  # fmt: skip
