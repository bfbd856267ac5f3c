"""Compiled functions of the core: options of Numba, and its cache on the disk."""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path
from types import FunctionType
from typing import Any

from numba import njit
from numba.core import types

from gensig.compilation import readable, watch

watch()

# A step costs a third less without Numba's reference counting, which these kernels do not need:
# arrays are borrowed, none is made.
OPTIONS: dict[str, Any] = {"cache": True, "error_model": "numpy", "_nrt": False}


def source_stamp(folder: Path) -> str:
    """Hash of all private modules below a folder, whose compiled functions call each other."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("_[!_]*.py")):
        name = str(path.relative_to(folder))
        digest.update(name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


_STAMP = source_stamp(Path(__file__).parents[1])  # of the whole package


def _stamped(decorator):
    """The decorator, with a cache that is stale after a change of any of the files.

    Numba checks only the file of the function itself, and would use code that was compiled of the
    former content of another file.
    """

    def decorate(function):
        dispatcher = decorator(function)
        if hasattr(dispatcher, "_cache"):  # not where NUMBA_DISABLE_JIT is set
            cache = dispatcher._cache
            files, identity = cache._cache_file, _identity(dispatcher)
            files._source_stamp = _STAMP
            files._load_index = functools.partial(readable, files._load_index)
            cache._index_key = functools.partial(_index_key, identity)
            _compile_once(dispatcher)
        return dispatcher

    return decorate


def _identity(value):
    """Names and code of a function and of all that it encloses; the type of any other value.

    Numba has hashes, which differ between processes for functions that enclose compiled ones.
    """
    function = getattr(value, "py_func", getattr(value, "_function", value))
    if not isinstance(function, FunctionType):
        return type(value).__module__, type(value).__qualname__
    cells = function.__closure__ or ()
    enclosed = [_identity(cell.cell_contents) for cell in cells]
    name = function.__module__, function.__qualname__
    return *name, function.__code__.co_code, *enclosed


def _index_key(identity, sig, codegen):
    return sig, codegen.magic_tuple(), identity


def _compile_once(dispatcher) -> None:
    """Let callers whose numbers are known share the code of those whose numbers are not."""
    template = dispatcher.get_call_template

    def of_unknown(kinds, named):
        return template(tuple(map(types.unliteral, kinds)), named)

    dispatcher.get_call_template = of_unknown


compiled: Any = _stamped(functools.partial(njit, nogil=True, **OPTIONS)())
inlined: Any = _stamped(functools.partial(njit, inline="always", **OPTIONS)())
