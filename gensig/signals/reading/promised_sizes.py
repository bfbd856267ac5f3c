"""Sizes that the header of a recording promises, checked before anything is allocated."""

from __future__ import annotations

import io
import math
import struct
import zlib
from pathlib import Path
from typing import IO

import numpy as np

from gensig.errors import ConfigError
from gensig.text.user_file import MOST_BYTES

MEGABYTE = 1_000_000
LONGEST_NPY_HEADER = 10_000  # bytes; numpy's own limit
RIFF_HEADER = 12  # bytes: RIFF, size, WAVE
NO_SIZE = 0xFFFFFFFF  # of a chunk whose size stands in the chunk ds64
MAT5_HEADER = 128  # bytes
MAT5_ORDERS = {b"IM": "<", b"MI": ">"}
MI_MATRIX, MI_COMPRESSED = 14, 15  # types of the elements of a MATLAB file


def check_decoded(file: str, n_values: int, name: str = "it") -> None:
    """Raise ConfigError for more values than are read, at 8 bytes each."""
    if 8 * n_values > MOST_BYTES:
        raise ConfigError(
            f"{file}: {name} is larger than {MOST_BYTES // MEGABYTE} MB; cut it"
        )


def check_held(file: str, promised: int, held: int) -> None:
    """Raise ConfigError for a header that promises more bytes than the file holds."""
    if promised > held:
        raise ConfigError(
            f"{file}: its header promises {promised:,} bytes, the file holds {held:,}; it is cut "
            "or damaged: copy it anew"
        )


def check_npy(file: str, stream: IO[bytes], n_bytes: int, name: str = "it") -> int:
    """Number of values of an array in numpy's format.

    Parameters
    ----------
    file : in messages
    stream : at the beginning of the array
    n_bytes : length of the array with its header
    name : of the array, in messages

    Raises
    ------
    ValueError    for another format
    ConfigError    for an array that is cut or too large
    """
    start = io.BytesIO(stream.read(LONGEST_NPY_HEADER + 12))
    version = np.lib.format.read_magic(start)
    if version == (1, 0):
        shape, _, dtype = np.lib.format.read_array_header_1_0(start)
    elif version == (2, 0):
        shape, _, dtype = np.lib.format.read_array_header_2_0(start)
    else:
        raise ValueError("names in UTF-8, which arrays of numbers do not have")
    if any(length < 0 for length in shape):
        raise ValueError("an array of negative length")
    n_values = math.prod(shape)
    check_decoded(file, n_values, name)
    check_held(file, n_values * dtype.itemsize, n_bytes - start.tell())
    return n_values


def check_wav(file: str) -> None:
    """Check the samples that the header of a WAV file promises.

    Raises
    ------
    ConfigError    for samples that are not there or too many
    struct.error, ZeroDivisionError    for a damaged header
    """
    path = Path(file).expanduser()
    n_bytes = path.stat().st_size
    n_values_a_byte = 1.0
    with path.open("rb") as stream:
        riff = stream.read(RIFF_HEADER)[:4]
        order = {b"RIFX": ">"}.get(riff, "<")
        large = 0
        while len(head := stream.read(8)) == 8:
            name, size = struct.unpack(f"{order}4sI", head)
            begin = stream.tell()
            if name == b"ds64":
                large = struct.unpack("<QQ", stream.read(16))[1]
            if name == b"fmt ":
                form = struct.unpack(f"{order}HHIIHH", stream.read(16))
                n_values_a_byte = 1.0 / (form[4] // form[1])
            if name == b"data":
                if riff == b"RF64" and size == NO_SIZE:
                    size = large
                check_decoded(file, int(size * n_values_a_byte))
                check_held(file, size, n_bytes - begin)
            stream.seek(begin + size + size % 2)


def check_mat(file: str, shapes: dict[str, tuple[int, ...]], *wanted: str) -> None:
    """Check arrays of a MATLAB file of version 4, 5 or 7.

    Parameters
    ----------
    file : as the user named it
    shapes : of the arrays that the file promises
    wanted : names of those that will be read

    Raises
    ------
    ConfigError    for an array that is not there or too large
    """
    for name in wanted:
        if name in shapes:
            check_decoded(file, math.prod(map(int, shapes[name])), name)


def check_mat_elements(file: str) -> None:
    """Check the sizes of the elements of a MATLAB file of version 5 or 7, before it is parsed.

    Raises
    ------
    ConfigError    for an element that is cut or too large
    struct.error, zlib.error    for a damaged element
    """
    path = Path(file).expanduser()
    n_bytes = path.stat().st_size
    with path.open("rb") as stream:
        mark = stream.read(MAT5_HEADER)[126:]
        if mark not in MAT5_ORDERS:
            return  # version 4, or no MATLAB file
        order = MAT5_ORDERS[mark]
        while len(head := stream.read(8)) == 8:
            kind, size = struct.unpack(f"{order}II", head)
            begin = stream.tell()
            check_held(file, size, n_bytes - begin)
            if kind == MI_COMPRESSED:
                start = zlib.decompressobj().decompress(stream.read(min(size, 512)), 8)
                kind, decoded = struct.unpack(f"{order}II", start)
                if kind == MI_MATRIX:
                    check_decoded(file, decoded // 8, "an array")
            stream.seek(begin + size)
