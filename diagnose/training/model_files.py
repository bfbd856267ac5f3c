"""The two files of a model folder on disk, read as a stranger's and written with their digests.

``model.json`` holds size and sha256 of every other file, and a sha256 of its own content.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from io import BufferedReader
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.dataset.storage.atomic import (
    open_part,
    refuse_larger,
    write_bytes,
    write_text,
)
from gensig.errors import DatasetError

WEIGHTS, DESCRIPTION = "model.safetensors", "model.json"
MODEL_SCHEMA_VERSION = 3
# Version 1 is without out_of_distribution and speed_rpm_range, 1 and 2 without digests.
READABLE_VERSIONS = (1, 2, MODEL_SCHEMA_VERSION)
FILES, DIGEST = "files", "sha256"  # keys of the description
MODEL = "model"
# bytes of the largest files that are read
LARGEST_DESCRIPTION, LARGEST_WEIGHTS = 8 * 2**20, 2**30
LARGEST_HEADER, LENGTH_BYTES = 2**20, 8  # of the file of weights
LARGEST_FURTHER = 64 * 2**20  # bytes of tensors beside those of the network
LARGEST_WHOLE = 2**63
# type of a stored tensor -> that of NumPy
DTYPES = {"F32": "float32", "F64": "float64", "I64": "int64"}
NOT_SIGNED = (
    "was written by an older version without the sha256 of its files: damage that leaves "
    "numbers finite goes unnoticed; train it again for one"
)

Kind = tuple[str, tuple[int, ...]]  # type of NumPy, shape


def write_files(
    folder: Path,
    weights: Mapping[str, NDArray[Any]],
    content: Mapping[str, Any],
    beside: Mapping[str, str],
) -> None:
    """Write the files of a model into a folder, which is made; the description last.

    Parameters
    ----------
    beside : name -> text of files beside the two
    """
    from safetensors.numpy import save

    folder.mkdir(parents=True, exist_ok=True)
    arrays = {name: np.array(value, order="C") for name, value in weights.items()}
    write_bytes(folder / WEIGHTS, save(arrays))
    for name, text in beside.items():
        write_text(folder / name, text)
    write_text(folder / DESCRIPTION, signed_text(folder, content, (WEIGHTS, *beside)))


def signed_text(folder: Path, content: Mapping[str, Any], names: Sequence[str]) -> str:
    """Text of a description with the digests that files of the folder have now."""
    signed = dict(content) | {
        "model_schema_version": MODEL_SCHEMA_VERSION,
        FILES: {name: facts_of(folder / name) for name in names},
    }
    signed[DIGEST] = content_digest(signed)
    return json.dumps(signed, indent=2, allow_nan=False) + "\n"


def facts_of(path: Path) -> dict[str, Any]:
    """Size and sha256 of a file of a model folder.

    Raises
    ------
    DatasetError    for anything but an ordinary file, and for one that is too large
    """
    with _opened(path, LARGEST_WEIGHTS) as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
        return {"bytes": file.tell(), DIGEST: digest}


def content_digest(content: Mapping[str, Any]) -> str:
    """Hexadecimal sha256 of the values of a description, whatever their layout and order."""
    values = {key: value for key, value in content.items() if key != DIGEST}
    text = json.dumps(values, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def read_content(folder: Path) -> dict[str, Any]:
    """Values of the description of a folder, checked against its digest.

    Raises
    ------
    DatasetError    for a missing, altered or too large file, one that is not JSON, numbers that
        are not finite, and another schema
    """
    path = folder / DESCRIPTION
    with _opened(path, LARGEST_DESCRIPTION) as file:
        text = file.read()
    try:
        content = json.loads(text.decode("utf-8"), parse_constant=_no_number)
        version = content["model_schema_version"]
        _check_values(content)
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise DatasetError(
            f"{path} does not describe a model: {one_line(error)}"
        ) from None
    is_known = type(version) is int and version in READABLE_VERSIONS
    if not is_known:
        *known, last = map(str, READABLE_VERSIONS)
        raise DatasetError(
            f"{path}: model schema {version!r}, this program reads {', '.join(known)} and {last}"
        )
    is_signed = FILES in content or DIGEST in content
    if is_signed != (version == MODEL_SCHEMA_VERSION):
        raise DatasetError(
            f"{path} was altered: schema {version} and its digests contradict each other; "
            "restore it from a copy"
        )
    if is_signed and content.get(DIGEST) != content_digest(content):
        raise DatasetError(
            f"{path} was altered: its values do not have the sha256 in it; restore it from a "
            "copy"
        )
    if is_signed:
        _check_listed(path, content.get(FILES))
    return content


def _no_number(name: str) -> None:
    raise ValueError(f"{name} is no finite number")


def _check_values(content: Any) -> None:
    """Refuse numbers that are not finite or absurdly large, and text that is no text."""
    waiting = [content]
    while waiting:
        value = waiting.pop()
        if isinstance(value, dict):
            waiting += [*value, *value.values()]
        elif isinstance(value, list):
            waiting += value
        elif isinstance(value, str):
            value.encode("utf-8")
        elif isinstance(value, int) and abs(value) > LARGEST_WHOLE:
            raise ValueError("a whole number has more than 64 bits")
        elif isinstance(value, float) and not math.isfinite(value):
            raise ValueError("a number is not finite")


def _check_listed(path: Path, files: Any) -> None:
    """Refuse a list of files that is none, or does not hold the weights."""
    is_list = isinstance(files, dict) and WEIGHTS in files
    if is_list and all(_is_entry(name, entry) for name, entry in files.items()):
        return
    raise DatasetError(
        f"{path} does not describe a model: {FILES} must hold bytes and sha256 of {WEIGHTS} and "
        "of other files in this folder"
    )


def _is_entry(name: str, entry: Any) -> bool:
    if not (isinstance(entry, dict) and set(entry) == {"bytes", DIGEST}):
        return False
    is_size = type(entry["bytes"]) is int and entry["bytes"] >= 0
    is_name = name not in ("", ".", "..", DESCRIPTION) and not set(name) & set("/\\\0")
    return is_size and is_name and isinstance(entry[DIGEST], str)


def tensors_of(
    folder: Path, expected: Mapping[str, Kind] | None = None
) -> dict[str, NDArray[Any]]:
    """All arrays of the file of weights, by their names.

    Parameters
    ----------
    folder : of the model
    expected : type and shape of tensors that must be there; nothing is read where they differ,
        and others may be there as far as they are small. None expects nothing

    Raises
    ------
    DatasetError    for a file that is absent, no ordinary one, altered, no safetensors file or
        too large, for numbers that are not finite, and for tensors that do not fit
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load

    path = folder / WEIGHTS
    files = read_content(folder).get(FILES)
    with _opened(path, LARGEST_WEIGHTS) as file:
        if files is not None:
            _check_size(path, file, files[WEIGHTS]["bytes"])
        kinds = _kinds(path, file)
        if expected is not None:
            _check_expected(path, kinds, expected)
        file.seek(0)
        raw = file.read()
    if files is not None and hashlib.sha256(raw).hexdigest() != files[WEIGHTS][DIGEST]:
        raise DatasetError(altered_text(path))
    try:
        tensors = load(raw)
    except (SafetensorError, ValueError, KeyError, TypeError) as error:
        raise DatasetError(
            f"{path} is not a safetensors file: {one_line(error)}"
        ) from None
    for name, values in tensors.items():
        if not np.isfinite(values).all():
            raise DatasetError(
                f"{path}: tensor {name[:80]!r} holds numbers that are not finite; the model is "
                "damaged: restore it or train it again"
            )
    return tensors


def altered_text(path: Path) -> str:
    """The line on a file of a model that has another sha256 than its description says."""
    return f"{path} was altered: its sha256 is not the one in {DESCRIPTION}; restore it from a copy"


def _check_size(path: Path, file: BufferedReader, recorded: int) -> None:
    size = file.seek(0, 2)
    file.seek(0)
    if size != recorded:
        raise DatasetError(
            f"{path} was altered: it has {size} bytes, {DESCRIPTION} says {recorded}; restore it "
            "from a copy"
        )


def _kinds(path: Path, file: BufferedReader) -> dict[str, Kind]:
    """Type and shape of every tensor, from the header, whose promise the file must keep."""
    size = file.seek(0, 2)
    file.seek(0)
    length = int.from_bytes(file.read(LENGTH_BYTES), "little")
    if not 0 < length <= min(LARGEST_HEADER, size - LENGTH_BYTES):
        raise DatasetError(
            f"{path} is not a safetensors file: its header has {length} bytes, the file {size}"
        )
    try:
        header = json.loads(file.read(length).decode("utf-8"))
        kinds = {
            name: _kind(entry)
            for name, entry in header.items()
            if name != "__metadata__"
        }
    except (
        ValueError,
        KeyError,
        TypeError,
        AttributeError,
        RecursionError,
    ) as error:
        raise DatasetError(
            f"{path} is not a safetensors file: {one_line(error)}"
        ) from None
    promised = sum(map(n_bytes, kinds.values()))
    if promised != size - LENGTH_BYTES - length:
        raise DatasetError(
            f"{path} is damaged: its header promises {promised} bytes of numbers, it holds "
            f"{size - LENGTH_BYTES - length}; restore it from a copy"
        )
    return kinds


def _kind(entry: Mapping[str, Any]) -> Kind:
    if entry["dtype"] not in DTYPES:
        raise ValueError(
            f"tensors are of type {', '.join(DTYPES)}, not {str(entry['dtype'])[:20]!r}"
        )
    shape = tuple(entry["shape"])
    if not all(type(length) is int and length >= 0 for length in shape):
        raise ValueError("the shape of a tensor is no list of whole numbers")
    return DTYPES[entry["dtype"]], shape


def n_bytes(kind: Kind) -> int:
    """Bytes of a tensor."""
    dtype, shape = kind
    return np.dtype(dtype).itemsize * math.prod(shape)


def _check_expected(
    path: Path, kinds: Mapping[str, Kind], expected: Mapping[str, Kind]
) -> None:
    where = f"{path} does not fit {DESCRIPTION}"
    for name, kind in expected.items():
        if name not in kinds:
            raise DatasetError(f"{where}: it holds no {name}")
        if not _is_same(kinds[name], kind):
            raise DatasetError(
                f"{where}: {name} is {_kind_text(kinds[name])}, the network needs "
                f"{_kind_text(kind)}"
            )
    further = [kind for name, kind in kinds.items() if name not in expected]
    if sum(map(n_bytes, further)) > LARGEST_FURTHER:
        raise DatasetError(
            f"{where}: tensors beside the network's have more than {LARGEST_FURTHER} bytes"
        )


def _is_same(stored: Kind, wanted: Kind) -> bool:
    """True for equal kinds; a single number is stored as a list of one."""
    one = (1,)
    return stored[0] == wanted[0] and (stored[1] or one) == (wanted[1] or one)


def _kind_text(kind: Kind) -> str:
    dtype, shape = kind
    return f"{dtype} ({', '.join(map(str, shape))[:80]})"


def _opened(path: Path, limit: int) -> BufferedReader:
    """An ordinary file of a model folder, of at most so many bytes."""
    try:
        file = open_part(path, part_of=MODEL)
    except OSError as error:
        raise DatasetError(
            f"{path} cannot be read: {error.strerror}; check its permissions"
        ) from None
    try:
        refuse_larger(path, file, limit, MODEL)
    except DatasetError:
        file.close()
        raise
    return file


def one_line(error: Exception) -> str:
    """Text of an error on one line, cut to 160 characters."""
    return " ".join(str(error).split())[:160]
