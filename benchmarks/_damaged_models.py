"""Model folders as an accident or a stranger could leave them: one change a seed."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from safetensors.numpy import load, save

from benchmarks._damaged_folders import Mutant, damage
from benchmarks._stored_models import ASKED
from diagnose.training.model_files import DESCRIPTION, WEIGHTS, signed_text

Random = np.random.Generator
HUGE = 10**9
SIGNED_ANEW = " (signed anew)"


def mutate(models: Path, seed: int) -> Mutant:
    """Change one thing in one of the models of a folder; ``kind`` begins with its name."""
    rng = np.random.default_rng(seed)
    name = ASKED[seed % len(ASKED)].name
    family = list(FAMILIES)[seed // len(ASKED) % len(FAMILIES)]
    mutant = FAMILIES[family](models / name, rng)
    kind = f"{name}: {mutant.kind}"
    if mutant.forged:
        kind += SIGNED_ANEW
    return Mutant(kind=kind, forged=mutant.forged, refused=mutant.refused)


def forge(folder: Path, content: Any = None) -> None:
    """Sign a folder anew, as only a stranger would, with other values if they are given."""
    path = folder / DESCRIPTION
    if content is None:
        content = json.loads(path.read_text(encoding="utf-8"))
    names = list(content.get("files") or [WEIGHTS])
    path.write_text(signed_text(folder, content, names), encoding="utf-8")


def _file(folder: Path, rng: Random) -> Path:
    """The description or the weights."""
    return folder / str(rng.choice([DESCRIPTION, WEIGHTS]))


def _bytes(folder: Path, rng: Random) -> Mutant:
    return damage(folder, _file(folder, rng), rng)


def _weight_bytes(folder: Path, rng: Random) -> Mutant:
    return damage(folder, folder / WEIGHTS, rng)


def _exchanged(folder: Path, rng: Random) -> Mutant:
    """A file that is empty, gone, of another model, or in place of the other one."""
    path = _file(folder, rng)
    other = rng.choice([asked.name for asked in ASKED if asked.name != folder.name])
    kind = str(rng.choice(["emptied", "removed", "of another model", "in wrong place"]))
    if kind == "emptied":
        path.write_bytes(b"")
    elif kind == "removed":
        path.unlink()
    elif kind == "of another model":
        shutil.copyfile(folder.parent / str(other) / path.name, path)
    else:
        both = folder / DESCRIPTION, folder / WEIGHTS
        first, second = (one.read_bytes() for one in both)
        both[0].write_bytes(second)
        both[1].write_bytes(first)
    return Mutant(kind=f"{path.name} {kind}", refused=True)


def _special(folder: Path, rng: Random) -> Mutant:
    """A pipe, a device, a link or a folder in place of a file."""
    path = _file(folder, rng)
    kinds = ["pipe", "link", "dangling link", "link to a device", "folder", "device"]
    kind = str(rng.choice(kinds))
    kept = path.with_name("kept")
    path.rename(kept)
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "link":
        path.symlink_to(kept)
    elif kind == "dangling link":
        path.symlink_to(folder / "nowhere")
    elif kind == "link to a device":
        path.symlink_to("/dev/zero")
    elif kind == "device":
        try:
            os.mknod(path, 0o20600, os.makedev(1, 5))
        except OSError:  # only root may, and not everywhere
            os.mkfifo(path)
            kind = "pipe"
    else:
        path.mkdir()
    return Mutant(kind=f"{kind} for {path.name}", refused=True)


# JSON texts that stand for a value
HOSTILE = (
    "null",
    "true",
    "-1",
    "0",
    "1e308",
    "-1e308",
    "1e999",
    "NaN",
    "-Infinity",
    "1e-300",
    "0.5",
    "9007199254740993",
    "1" + "0" * 400,
    '""',
    '"any"',
    '"\\ud800"',
    '"' + "x" * 100_000 + '"',
    "[]",
    "[1]",
    "[null, null]",
    "[1, 2, 3]",
    "{}",
    '{"kind": "small_cnn"}',
    "[" * 5000 + "]" * 5000,
)
MARK = "\u2603"


def _value(folder: Path, rng: Random) -> Mutant:
    """One value of the description replaced, and the folder signed anew where that is possible."""
    path = folder / DESCRIPTION
    content = json.loads(path.read_text(encoding="utf-8"))
    places = [
        place for place in _places(content) if place[0] not in ("files", "sha256")
    ]
    place = places[int(rng.integers(len(places)))]
    text = HOSTILE[int(rng.integers(len(HOSTILE)))]
    kind = f"{'.'.join(map(str, place))} = {text[:20]}"
    target = content
    for key in place[:-1]:
        target = target[key]
    try:
        target[place[-1]] = json.loads(text)
        forge(folder, content)
    except (ValueError, RecursionError):
        target[place[-1]] = MARK
        written = json.dumps(content, ensure_ascii=False)
        path.write_text(written.replace(f'"{MARK}"', text), encoding="utf-8")
    return Mutant(kind=kind, forged=True)


def _places(content: Any, above: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths of all values within a value."""
    entries: list[tuple[Any, Any]] = []
    if isinstance(content, dict):
        entries = list(content.items())
    elif isinstance(content, list):
        entries = list(enumerate(content))
    found = []
    for key, value in entries:
        found += [(*above, key), *_places(value, (*above, key))]
    return found


def _names(n: int) -> list[str]:
    return [f"a{k}" for k in range(n)]


# A description of absurd sizes.
SIZES: dict[str, Callable[[dict[str, Any]], Any]] = {
    "10^6 channels": lambda c: c.update(channel_names=_names(10**6)),
    "200 channels": lambda c: c.update(channel_names=_names(200)),
    "10^5 classes": lambda c: c.update(class_names=_names(10**5)),
    "900 classes": lambda c: c.update(class_names=_names(900)),
    "window of 10^9": lambda c: c.update(window_samples=HUGE),
    "window of 10^6": lambda c: c.update(window_samples=10**6),
    "stride of 1": lambda c: c.update(stride_samples=1),
    "rate of 10^8": lambda c: c.update(sampling_rate_hz=1e8),
    "rate of 1": lambda c: c.update(sampling_rate_hz=1.0),
    "widths of 10^9": lambda c: c["model"].update(widths=[HUGE, HUGE]),
    "widths of 2000": lambda c: c["model"].update(widths=[2000, 2000]),
    "kernels of 10^9": lambda c: c["model"].update(kernels=[HUGE + 1, 3]),
    "kernels of 1999": lambda c: c["model"].update(kernels=[1999, 1999]),
    "10^5 layers": lambda c: c["model"].update(
        widths=[1] * 10**5, kernels=[1] * 10**5, strides=[1] * 10**5
    ),
    "strides of 0": lambda c: c["model"].update(strides=[0, 0]),
    "hidden of 10^9": lambda c: c["model"].update(n_hidden=HUGE),
    "points of 10^9": lambda c: c["model"].update(samples_per_tooth=HUGE),
    "points of 2048": lambda c: c["model"].update(samples_per_tooth=2048),
    "teeth of 10^9": lambda c: c.update(n_teeth=[HUGE, HUGE]),
    "resamples of 10^12": lambda c: c.update(n_bootstrap=10**12),
}


def _size(folder: Path, rng: Random) -> Mutant:
    content = json.loads((folder / DESCRIPTION).read_text(encoding="utf-8"))
    kind = str(rng.choice(list(SIZES)))
    SIZES[kind](content)
    forge(folder, content)
    return Mutant(kind=kind, forged=True)


def _header(folder: Path, rng: Random) -> Mutant:
    """A file of weights whose header promises what is not there."""
    path = folder / WEIGHTS
    kind = str(rng.choice(["header of 2^62", "promise of 2^50", "deep header"]))
    header = b"[" * 100_000
    if kind == "promise of 2^50":
        entry = {"dtype": "F32", "shape": [2**50], "data_offsets": [0, 2**52]}
        header = json.dumps({"input_scale": entry}).encode()
    length = 2**62 if kind == "header of 2^62" else len(header)
    path.write_bytes(length.to_bytes(8, "little") + header)
    forge(folder)
    return Mutant(kind=kind, forged=True, refused=True)


Tensors = dict[str, Any]


def _first_float(tensors: Tensors, rng: Random) -> str:
    names = sorted(name for name, value in tensors.items() if value.dtype.kind == "f")
    return str(rng.choice(names))


def _set(value: float) -> Callable[[Tensors, str], None]:
    def change(tensors: Tensors, name: str) -> None:
        tensors[name].flat[0] = value

    return change


def _fill(value: float) -> Callable[[Tensors, str], None]:
    def change(tensors: Tensors, name: str) -> None:
        tensors[name].fill(value)

    return change


def _as(dtype: str) -> Callable[[Tensors, str], None]:
    def change(tensors: Tensors, name: str) -> None:
        tensors[name] = tensors[name].astype(dtype)

    return change


def _shaped(change_shape: Callable[[Any], Any]) -> Callable[[Tensors, str], None]:
    def change(tensors: Tensors, name: str) -> None:
        tensors[name] = np.array(change_shape(tensors[name]), order="C")

    return change


TENSORS: dict[str, Callable[[Tensors, str], Any]] = {
    "NaN": _set(np.nan),
    "infinity": _set(np.inf),
    "all NaN": _fill(np.nan),
    "all 3e38": _fill(3e38),
    "all 0": _fill(0.0),
    "float16": _as("f2"),
    "float64": _as("f8"),
    "whole numbers": _as("i4"),
    "flags": _as("?"),
    "one row less": _shaped(lambda value: value[:-1]),
    "flat": _shaped(np.ravel),
    "one axis more": _shaped(lambda value: value[None]),
    "empty": _shaped(lambda value: value[:0]),
    "absent": lambda tensors, name: tensors.pop(name),
    "renamed": lambda tensors, name: tensors.update({"other": tensors.pop(name)}),
    "one more": lambda tensors, name: tensors.update({"more": tensors[name]}),
}


def _tensor(folder: Path, rng: Random) -> Mutant:
    path = folder / WEIGHTS
    tensors = {name: np.array(value) for name, value in load(path.read_bytes()).items()}
    kind, name = str(rng.choice(list(TENSORS))), _first_float(tensors, rng)
    TENSORS[kind](tensors, name)
    path.write_bytes(save(tensors))
    forge(folder)
    return Mutant(kind=f"{name} {kind}", forged=True)


FAMILIES: dict[str, Callable[[Path, Random], Mutant]] = {
    "bytes": _bytes,
    "bytes of weights": _weight_bytes,
    "more bytes": _bytes,
    "exchanged": _exchanged,
    "special": _special,
    "value": _value,
    "value again": _value,
    "size": _size,
    "header": _header,
    "tensor": _tensor,
    "tensor again": _tensor,
}
