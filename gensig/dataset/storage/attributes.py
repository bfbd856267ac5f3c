"""HDF5 attributes of fixed size: text, numbers and lists of them go in and come back the same."""

import math
from collections.abc import Sequence

import h5py
import numpy as np

from gensig.errors import DatasetError

ATTRIBUTE_BYTES_LIMIT = 60_000
# What h5py raises on damaged files, seen by fuzzing.
HDF5_ERRORS = (
    OSError,
    RuntimeError,
    KeyError,
    ValueError,
    TypeError,
    OverflowError,
    MemoryError,
)

Attribute = str | int | float | Sequence[str] | Sequence[int] | Sequence[float]


def set_attribute(target: h5py.HLObject, name: str, value: Attribute) -> None:
    """Store text, a number or a list of one kind as an attribute of fixed size.

    DatasetError for anything else.
    """
    if isinstance(value, str):
        data: np.ndarray = _text_array([value], name).reshape(())
    elif (
        isinstance(value, Sequence)
        and value
        and all(isinstance(item, str) for item in value)
    ):
        data = _text_array([str(item) for item in value], name)
    else:
        data = np.asarray(value)
        if data.dtype.kind == "b":
            data = data.astype(np.int8)
        if data.dtype.kind not in "if":
            raise DatasetError(
                f"attribute {name} is {value!r}; allowed are text, int, float and lists of one "
                "of them"
            )
    if data.nbytes > ATTRIBUTE_BYTES_LIMIT:
        raise DatasetError(
            f"attribute {name} has {data.nbytes} bytes, HDF5 allows about {ATTRIBUTE_BYTES_LIMIT}; "
            "make it a column or a file beside the shards"
        )
    dtype = data.dtype
    if dtype.kind == "S":
        dtype = h5py.string_dtype("utf-8", dtype.itemsize)
    target.attrs.create(name, data, shape=data.shape, dtype=dtype)


def _text_array(texts: list[str], name: str) -> np.ndarray:
    if any("\0" in text for text in texts):
        raise DatasetError(f"attribute {name} contains a NUL character; remove it")
    encoded = [text.encode("utf-8") for text in texts]
    return np.array(encoded, dtype=f"S{max(1, max(map(len, encoded)))}")


def read_attributes(target: h5py.HLObject) -> dict:
    """Attributes as text, int, float or lists of them.

    Those of any other type are left out, and so are those larger than `set_attribute` writes.
    """
    attributes: dict = {}
    for name in target.attrs:
        if not isinstance(name, str):  # a damaged name comes as bytes
            continue
        stored = target.attrs.get_id(name)
        kind = stored.dtype.kind
        if kind not in ("S", "i", "u", "f") or _n_bytes(stored) > ATTRIBUTE_BYTES_LIMIT:
            continue
        value = np.asarray(target.attrs[name])
        if kind == "S" or value.dtype.kind == "O":
            value = decoded(value)
        attributes[name] = value.tolist()
    return attributes


def oversized_attributes(target: h5py.HLObject) -> list[str]:
    """Names of attributes that `read_attributes` leaves out because they are too large."""
    return [
        name
        for name in target.attrs
        if isinstance(name, str)
        and _n_bytes(target.attrs.get_id(name)) > ATTRIBUTE_BYTES_LIMIT
    ]


def _n_bytes(stored: h5py.h5a.AttrID) -> int:
    """Bytes of an attribute's values, by its shape and type."""
    return math.prod(stored.shape or (1,)) * stored.dtype.itemsize


def decoded(values: np.ndarray) -> np.ndarray:
    """Bytes of fixed length as text.

    Bytes that are no UTF-8 are shown as replacement characters.
    """
    return np.char.decode(np.asarray(values, dtype="S"), "utf-8", "replace")
