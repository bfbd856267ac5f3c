"""Data-set folders as an accident or a stranger could leave them.

One change a seed, the same for the same seed.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from gensig.dataset.storage.atomic import sha256_file

SECRET = b"nobody outside this folder may read me"
Shard = Callable[[h5py.File, Path], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Mutant:
    """A change of a folder.

    ``forged``: sha256 and size in the manifest were made to fit, as only a stranger would.
    ``refused``: reading must raise, and not only ``verify``.
    """

    kind: str
    forged: bool = False
    refused: bool = False


def mutate(folder: Path, seed: int) -> Mutant:
    """Change one thing in a folder, which becomes the mutant of this seed."""
    rng = np.random.default_rng(seed)
    family = (
        "bytes",
        "bytes",
        "forged bytes",
        "structure",
        "structure",
        "manifest",
        "manifest",
        "text",
    )[seed % 8]
    if family == "bytes":
        return damage(folder, _file(folder, rng), rng)
    if family == "forged bytes":
        damaged = damage(folder, _shard(folder, rng), rng)
        forge(folder)
        return Mutant(kind=f"forged {damaged.kind}", forged=True)
    if family == "structure":
        name = list(STRUCTURES)[(seed // 8 * 2 + seed % 2) % len(STRUCTURES)]
        path = _shard(folder, rng)
        with h5py.File(path, "r+") as file:
            STRUCTURES[name](file, folder)
        forge(folder)
        return Mutant(kind=name, forged=True, refused=True)
    if family == "manifest":
        return _manifest(folder, seed // 8 * 2 + seed % 2, rng)
    return _text(folder, rng)


def forge(folder: Path) -> None:
    """Make every sha256 and size fit the files again."""
    path = folder / "manifest.json"
    manifest = json.loads(path.read_text(encoding="utf-8"))
    for entry in manifest["shards"]:
        shard = folder / "shards" / entry["name"]
        if shard.is_file():
            entry |= {"sha256": sha256_file(shard), "bytes": shard.stat().st_size}
    manifest["files"] = {name: _digest(folder / name) for name in manifest["files"]}
    path.write_text(json.dumps(manifest), encoding="utf-8")
    forge_checksums(folder)


def forge_checksums(folder: Path) -> None:
    """Make `SHA256SUMS` fit the files again, whatever they are."""
    path = folder / "SHA256SUMS"
    names = [
        line.partition("  ")[2]
        for line in path.read_text(encoding="utf-8").splitlines()
    ]
    path.write_text(
        "".join(f"{_digest(folder / name)}  {name}\n" for name in names),
        encoding="utf-8",
    )


def _digest(path: Path) -> str:
    """The sha256 of an ordinary file, and any for what is none."""
    if not path.is_file():
        return "0" * 64
    return sha256_file(path)


def _file(folder: Path, rng: np.random.Generator) -> Path:
    names = [
        "plan.csv",
        "index.h5",
        "config.yaml",
        "README.md",
        "croissant.json",
        "SHA256SUMS",
        *sorted(path.name for path in (folder / "splits").iterdir()),
    ]
    name = str(rng.choice(names))
    other = (
        folder / "splits" / name
        if (folder / "splits" / name).exists()
        else folder / name
    )
    return _shard(folder, rng) if rng.random() < 0.75 else other


def _shard(folder: Path, rng: np.random.Generator) -> Path:
    return Path(
        str(rng.choice([str(path) for path in sorted((folder / "shards").iterdir())]))
    )


def damage(folder: Path, path: Path, rng: np.random.Generator) -> Mutant:
    """Flipped, overwritten, lost, doubled or swapped bytes.

    Half of them in the head, where HDF5 keeps its tables.
    """
    before = path.read_bytes()
    content = bytearray(before)
    size = len(content)
    at = int(rng.integers(min(size, 8192) if rng.random() < 0.5 else size))
    length = int(min(rng.integers(1, 200), size - at))
    kind = str(
        rng.choice(
            [
                "flip",
                "flip",
                "flip",
                "noise",
                "zeros",
                "ones",
                "cut",
                "extended",
                "doubled",
                "swapped",
            ]
        )
    )
    if kind == "flip":
        for place in {at, *rng.integers(0, size, int(rng.integers(0, 4))).tolist()}:
            content[place] ^= 1 << int(rng.integers(8))
    elif kind == "noise":
        content[at : at + length] = rng.bytes(length)
    elif kind in ("zeros", "ones"):
        content[at : at + length] = (b"\0" if kind == "zeros" else b"\xff") * length
    elif kind == "cut":
        del content[at:]
    elif kind == "extended":
        content += rng.bytes(length)
    elif kind == "doubled":
        content[at:at] = content[at : at + length]
    else:
        to = int(rng.integers(0, max(1, size - length)))
        content[at : at + length], content[to : to + length] = (
            content[to : to + length],
            content[at : at + length],
        )
    if bytes(content) == before:  # noise can repeat what was there
        content[at] ^= 1
        kind = "flip"
    path.write_bytes(content)
    return Mutant(kind=f"{kind} in {path.name}")


def _replaced(name: str, make: Callable[[h5py.File, str], Any]) -> Shard:
    def change(file: h5py.File, _folder: Path) -> None:
        del file[name]
        make(file, name)

    return change


def _outside(file: h5py.File, folder: Path) -> str:
    """A file beside the folder, which no reader of the folder may open."""
    path = folder.parent / "outside.h5"
    if not path.exists():
        with h5py.File(path, "w") as other:
            other["acceleration"] = np.zeros(file["acceleration"].shape, "f4")
            other["secret"] = np.void(SECRET)
    (folder.parent / "outside.bin").write_bytes(SECRET * 20_000)
    return f"../../{path.name}"


def _external_link(file: h5py.File, folder: Path) -> None:
    target = _outside(file, folder)
    del file["acceleration"]
    file["acceleration"] = h5py.ExternalLink(target, "/acceleration")


def _virtual(file: h5py.File, folder: Path) -> None:
    target, shape = _outside(file, folder), file["acceleration"].shape
    del file["acceleration"]
    layout = h5py.VirtualLayout(shape, "f4")
    layout[...] = h5py.VirtualSource(target, "acceleration", shape)
    file.create_virtual_dataset("acceleration", layout)


def _external_storage(file: h5py.File, folder: Path) -> None:
    _outside(file, folder)
    shape = file["acceleration"].shape
    del file["acceleration"]
    file.create_dataset(
        "acceleration",
        shape,
        "f4",
        external=[("../../outside.bin", 0, h5py.h5f.UNLIMITED)],
    )


def _unwritten(file: h5py.File, name: str) -> None:
    file.create_dataset(
        name, (file["record_id"].shape[0], 2, 10**11), "f4", chunks=(1, 2, 1000)
    )


def _gzip_bomb(file: h5py.File, name: str) -> None:
    n = file["record_id"].shape[0]
    data = file.create_dataset(
        name, (n, 2, 10**9), "f4", chunks=(1, 2, 10**6), compression="gzip"
    )
    data[0, :, : 10**6] = 0.0


def _chunk_bomb(file: h5py.File, name: str) -> None:
    n = file["record_id"].shape[0]
    data = file.create_dataset(
        name,
        (n, 2, 4),
        "f4",
        maxshape=(None, None, None),
        chunks=(1, 2, 4 * 10**8),
        compression="gzip",
    )
    assert data.chunks


def _link_names(file: h5py.File, _folder: Path) -> None:
    file["params/again"] = h5py.SoftLink("/acceleration")


def _loop(file: h5py.File, _folder: Path) -> None:
    file["params/loop"] = file["params"]


def _typed(name: str, dtype: Any) -> Shard:
    return _replaced(
        name, lambda file, key: file.create_dataset(key, (_rows(file), 2), dtype)
    )


def _rows(file: h5py.File) -> int:
    return int(file["record_id"].shape[0])


def _attribute(name: str, value: Any) -> Shard:
    def change(file: h5py.File, _folder: Path) -> None:
        if value is None:
            del file.attrs[name]
        else:
            file.attrs[name] = value

    return change


def _more(name: str, **options: Any) -> Shard:
    return lambda file, _folder: file.create_dataset(name, **options) and None


STRUCTURES: dict[str, Shard] = {
    "soft link": _replaced(
        "label",
        lambda file, name: file.__setitem__(name, h5py.SoftLink("/fault_tooth")),
    ),
    "soft link one level down": _link_names,
    "dangling soft link": lambda file, _folder: file.__setitem__(
        "more", h5py.SoftLink("/nowhere")
    ),
    "external link": _external_link,
    "virtual source outside": _virtual,
    "external storage": _external_storage,
    "group loop": _loop,
    "object type": _typed("torque_nm", h5py.vlen_dtype(np.float64)),
    "text of any length": _replaced(
        "label_name", lambda f, n: f.create_dataset(n, (_rows(f),), h5py.string_dtype())
    ),
    "compound type": _typed("severity", np.dtype([("a", "f8"), ("b", "i4")])),
    "opaque type": _typed("severity", np.dtype("V8")),
    "references": _typed("severity", h5py.ref_dtype),
    "arrays in rows": _typed("severity", np.dtype(("f8", (3,)))),
    "complex": _typed("severity", np.dtype("c16")),
    "unknown column of objects": _more("more", shape=(1,), dtype=h5py.string_dtype()),
    "scalar": _replaced("label", lambda file, name: file.create_dataset(name, data=1)),
    "empty": _replaced(
        "label", lambda file, name: file.create_dataset(name, data=h5py.Empty("i2"))
    ),
    "no rows": _replaced(
        "record_id", lambda file, name: file.create_dataset(name, (0,), "S32")
    ),
    "other rows": _replaced(
        "label", lambda file, name: file.create_dataset(name, (_rows(file) + 1,), "i2")
    ),
    "text for numbers": _replaced(
        "label", lambda file, name: file.create_dataset(name, (_rows(file),), "S4")
    ),
    "numbers for text": _replaced(
        "status", lambda file, name: file.create_dataset(name, (_rows(file),), "i4")
    ),
    "never written": _replaced("acceleration", _unwritten),
    "gzip bomb": _replaced("acceleration", _gzip_bomb),
    "chunk bomb": _replaced("acceleration", _chunk_bomb),
    "bomb in a label": _replaced(
        "label", lambda f, n: f.create_dataset(n, (10**12,), "i2", chunks=(1000,))
    ),
    "bomb in width": _replaced(
        "label_name",
        lambda f, n: f.create_dataset(n, (_rows(f),), "S2000000", chunks=(1,)),
    ),
    "unknown filter": _replaced(
        "label",
        lambda f, n: f.create_dataset(
            n, data=np.zeros(_rows(f), "i2"), chunks=(1,), scaleoffset=2
        ),
    ),
    "another version": _attribute("schema_version", 99),
    "version as text": _attribute("schema_version", "1"),
    "no version": _attribute("schema_version", None),
    "no rate": _attribute("sampling_rate_hz", -1.0),
    "rate as list": _attribute("sampling_rate_hz", [1.0, 2.0]),
    "channels as numbers": _attribute("channel_names", [1, 2]),
    "one channel name": _attribute("channel_names", np.array([b"a"])),
    "no classes": _attribute("class_names", None),
}


def _manifest(folder: Path, number: int, rng: np.random.Generator) -> Mutant:
    """Forged names and numbers, keys that are gone, values of another kind, damaged text."""
    path = folder / "manifest.json"
    content = json.loads(path.read_text(encoding="utf-8"))
    forgeries: dict[str, Callable[[], Any]] = {
        "traversal in a shard's name": lambda: content["shards"][0].update(
            name="../../outside.h5"
        ),
        "absolute shard name": lambda: content["shards"][0].update(name="/etc/passwd"),
        "device as shard": lambda: content["shards"][1].update(name="/dev/zero"),
        "traversal in a file's name": lambda: content["files"].update(
            {"../../outside.bin": "0" * 64}
        ),
        "traversal in a split's name": lambda: content["files"].update(
            {"splits/../plan.csv": "0" * 64}
        ),
        "shards swapped": lambda: content["shards"].reverse(),
        "shard twice": lambda: content["shards"].append(content["shards"][0]),
        "shard gone": lambda: content["shards"].pop(),
        "a billion records": lambda: (
            content.update(n_records=10**9),
            content["shards"][0].update(rows=10**9),
        ),
        "rows moved": lambda: (
            content["shards"][0].update(rows=1),
            content["shards"][1].update(rows=3),
        ),
        "negative rows": lambda: content["shards"][0].update(rows=-1),
        "huge number": lambda: content.update(n_records=10**400),
        "another seed": lambda: content.update(seed=content["seed"] + 1),
        "plan not listed": lambda: content["files"].pop("plan.csv"),
        "split not listed": lambda: content["files"].pop(
            "splits/random_window_leaky.csv"
        ),
        "overrides not listed": lambda: content["files"].pop("overrides.yaml"),
        "index not listed": lambda: content["files"].pop("index.h5"),
        "another version": lambda: content.update(schema_version=2),
        "another generator": lambda: content.update(generator_version="9"),
        "not complete": lambda: content.update(state="incomplete"),
        "unknown state": lambda: content.update(state="done"),
        "shard not done": lambda: content["shards"][1].update(state="planned"),
        "failures made up": lambda: content["shards"][0].update(n_failed=1),
        "size made up": lambda: content["shards"][0].update(bytes=1),
    }
    names = [*forgeries, "text", "text", "kind", "gone"]
    name = names[number % len(names)]
    if name in forgeries:
        forgeries[name]()
        path.write_text(json.dumps(content), encoding="utf-8")
    elif name == "text":
        damaged = damage(folder, path, rng)
        return Mutant(kind=f"manifest {damaged.kind}")
    else:
        place = (
            content
            if rng.random() < 0.5
            else content["shards"][int(rng.integers(len(content["shards"])))]
        )
        key = str(rng.choice([key for key in place if key != "environment"]))
        values = [None, True, [], {}, "x", -1, 1.5, 10**30, [[[[]]]], "\x00", "\ud800"]
        place.pop(key) if name == "gone" else place.update(
            {key: values[int(rng.integers(len(values)))]}
        )
        path.write_text(json.dumps(content), encoding="utf-8")
        name = f"{key} {name}"
    forge_checksums(folder)
    return Mutant(kind=f"manifest: {name}")


def _text(folder: Path, rng: np.random.Generator) -> Mutant:
    """Plan, configuration or split changed, with a manifest that agrees."""
    name = str(
        rng.choice(
            [
                "plan.csv",
                "config.yaml",
                "overrides.yaml",
                "splits/random_window_leaky.csv",
            ]
        )
    )
    path = folder / name
    text = path.read_text(encoding="utf-8")
    first = text.splitlines()[1].split(",")[0] if name.endswith("csv") else ""
    changes = {
        "name that leads out": text.replace(first or "seed", "../../evil", 1),
        "very long line": text + "x" * 10**5 + "\n",
        "quote": text + '"',
        "nul": text + "\0\n",
        "deep": text + "[" * 5000,
        "tag": text + "\nx: !!python/object/apply:os.system ['touch evil']\n",
        "alias": text + "\na: &a [1]\nb: [*a, *a]\n",
        "big number": text.replace("0", "9" * 40, 1),
        "no text": "",
    }
    kind = str(rng.choice(list(changes)))
    path.write_text(changes[kind], encoding="utf-8")
    if kind == "deep" and rng.random() < 0.5:
        return Mutant(kind=f"{kind} in {name}")
    forge(folder)
    return Mutant(kind=f"{kind} in {name}, forged", forged=True)
