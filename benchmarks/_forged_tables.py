"""Forged manifests, plans, splits and configurations, signed again."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import yaml

from benchmarks._damaged_folders import forge, forge_checksums
from gensig.dataset.folder.layout import read_manifest, shard_name
from gensig.dataset.folder.manifest import identity_hash
from gensig.dataset.storage.index import write_index

Rng = np.random.Generator
Forgery = Callable[[Path, Rng], None]
# counts that no folder of this size holds; the last ones fit no integer of numpy
COUNTS = (10**6, 10**7, 10**9, 10**12, 2**31, 2**63 - 1, 2**63, 10**30)
MANY_SHARDS = (10**4, 2 * 10**5)
FORBIDDEN_TEXT = (
    "\x1b[2J",
    "<script>alert(1)</script>",
    "=cmd|' /C calc'!A0",
    "é" * 40,
)


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


def chosen(values: Any, rng: Rng) -> Any:
    return values[int(rng.integers(len(values)))]


def manifest_change(change: Callable[[dict[str, Any], Rng], Any]) -> Forgery:
    def forgery(folder: Path, rng: Rng) -> None:
        with edited(folder / "manifest.json") as content:
            change(content, rng)
        forge_checksums(folder)

    return forgery


def manifest_rows(state: str) -> Forgery:
    """Rows of one shard and of the set, which agree and are absurd."""

    def change(content: dict[str, Any], rng: Rng) -> None:
        entry = chosen(content["shards"], rng)
        count = chosen(COUNTS, rng)
        content["n_records"] += count - entry["rows"]
        entry |= {"rows": count, "state": state}
        if state == "planned":
            content["state"] = "incomplete"

    return manifest_change(change)


def many_shards(state: str) -> Forgery:
    def change(content: dict[str, Any], rng: Rng) -> None:
        last, count = content["shards"][-1], chosen(MANY_SHARDS, rng)
        first = len(content["shards"])
        more = [
            last | {"name": shard_name(first + i), "state": state} for i in range(count)
        ]
        content["shards"] += more
        content["n_records"] += last["rows"] * count
        if state == "planned":
            content["state"] = "incomplete"

    return manifest_change(change)


def manifest_value(key: str, *values: Any) -> Forgery:
    return manifest_change(
        lambda content, rng: content.update({key: chosen(values, rng)})
    )


def shard_entry_value(key: str, *values: Any) -> Forgery:
    def change(content: dict[str, Any], rng: Rng) -> None:
        chosen(content["shards"], rng)[key] = chosen(values, rng)

    return manifest_change(change)


def odd_environment(content: dict[str, Any], rng: Rng) -> None:
    values = (["a", 1], {"b": {}}, "x" * 10**6, 10**300, None, *FORBIDDEN_TEXT)
    for key in content["environment"]:
        content["environment"][key] = chosen(values, rng)


def listed_files(content: dict[str, Any], rng: Rng) -> None:
    count = chosen((10**3, 10**5), rng)
    names = [f"splits/a{number}.csv" for number in range(count)]
    content["files"] |= dict.fromkeys(names, "0" * 64)


def deep_values(content: dict[str, Any], rng: Rng) -> None:
    deep: Any = 1
    for _ in range(int(chosen((60, 900), rng))):
        deep = {"a": deep}
    content[chosen(("configuration", "environment"), rng)] = {"deep": deep}


def table_change(
    change: Callable[[list[list[str]], Rng], Any], name: str = "plan.csv"
) -> Forgery:
    def forgery(folder: Path, rng: Rng) -> None:
        with rows_of(folder / name) as rows:
            change(rows, rng)
        forge(folder)

    return forgery


def plan_column(name: str, *values: str, whole: bool = True) -> Forgery:
    """A value in a column of the plan: in all rows, or in one."""

    def change(rows: list[list[str]], rng: Rng) -> None:
        place, value = rows[0].index(name), chosen(values, rng)
        for row in rows[1:] if whole else [chosen(rows[1:], rng)]:
            row[place] = value

    return table_change(change)


def long_plan(rows: list[list[str]], rng: Rng) -> None:
    row = rows[-1]
    for number in range(int(chosen((10**4, 3 * 10**5), rng))):
        rows.append([f"x{number}", row[1], str(int(row[2]) + 1 + number), *row[3:]])


def wide_plan(rows: list[list[str]], rng: Rng) -> None:
    count = int(chosen((10**3, 10**5), rng))
    rows[0] += [f"more{number}" for number in range(count)]
    for row in rows[1:]:
        row += ["1"] * count


def wide_cell(rows: list[list[str]], rng: Rng) -> None:
    """One long text, which an array of text repeats for every row."""
    row = rows[-1]
    if len(rows) < 1000:
        long_plan(rows, rng)
    row[chosen((0, len(row) - 1), rng)] = "a" * 10**6


def split_column(name: str, *values: str) -> Forgery:
    def change(rows: list[list[str]], rng: Rng) -> None:
        place = rows[0].index(name)
        for row in rows[1 : 1 + int(chosen((1, len(rows)), rng))]:
            row[place] = chosen(values, rng)

    return table_change(change, "splits/by_unit.csv")


def long_split(rows: list[list[str]], rng: Rng) -> None:
    record, _, _, subset = rows[1]
    count = int(chosen((10**4, 10**6), rng))
    rows += [
        [record, repr(i / count), repr((i + 1) / count), subset] for i in range(count)
    ]


def wide_split(rows: list[list[str]], rng: Rng) -> None:
    long_split(rows, rng)
    rows[-1][0] = "a" * 10**6


def setting(key: str, *values: Any) -> Forgery:
    """A value of the configuration, with an identity that agrees."""

    def forgery(folder: Path, rng: Rng) -> None:
        with edited(folder / "config.yaml") as content:
            *above, last = key.split(".")
            part = content
            for name in above:
                part = part[name]
            part[last] = chosen(values, rng)
        reidentify(folder)
        if rng.random() < 0.5:  # resume has something to make
            with edited(folder / "manifest.json") as manifest:
                manifest["state"] = "incomplete"
                manifest["shards"][-1]["state"] = "planned"

    return forgery
