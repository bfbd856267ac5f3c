"""The process that reads one recording of a stranger: its limits, and its answer on a pipe.

It imports little, because a user waits for it. Its answer is a line of JSON and the values.
"""

from __future__ import annotations

import ctypes
import importlib
import json
import os
import signal
import sys
from typing import IO, Any

import numpy as np

from gensig.errors import GensigError

PARENT_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG of prctl
MOST_OPEN_FILES = 64
STATM = "/proc/self/statm"


def main(text: str) -> None:
    """Read one file and leave.

    Parameters
    ----------
    text : JSON with ``reader`` as ``module:function``, ``file``, ``array``, ``parent`` (its
        process), ``memory_bytes`` and ``cpu_seconds``
    """
    request = json.loads(text)
    answer = _private_output()
    _die_with(request["parent"])
    module, _, name = request["reader"].partition(":")
    read = getattr(importlib.import_module(module), name)
    _limit(request["memory_bytes"], request["cpu_seconds"])
    try:
        content = read(request["file"], request["array"])
        _write(answer, content)
    except GensigError as error:
        _write_line(answer, {"error": str(error)})
    except MemoryError:
        _write_line(answer, {"out_of_memory": True})
    answer.flush()
    os._exit(0)  # nothing to tidy: the parent has the answer


def _private_output() -> IO[bytes]:
    """The pipe to the parent; what a library prints goes nowhere."""
    pipe = os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    return pipe


def _die_with(parent: int) -> None:
    """End this process when the parent ends."""
    if sys.platform == "linux":
        prctl = ctypes.CDLL(None).prctl
        prctl(PARENT_DEATH_SIGNAL, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(1)


def _limit(memory_bytes: int, cpu_seconds: int) -> None:
    """Bound memory and time; refuse files to write, further processes and core dumps.

    A system without such limits has none; the parent ends the process when its time is over.
    """
    sys.dont_write_bytecode = True
    try:
        import resource
    except ImportError:
        return
    address_space = _address_space(resource.getpagesize()) + memory_bytes
    limits = {
        resource.RLIMIT_AS: address_space,
        resource.RLIMIT_CPU: cpu_seconds,
        resource.RLIMIT_CORE: 0,
        resource.RLIMIT_FSIZE: 0,
        resource.RLIMIT_NOFILE: MOST_OPEN_FILES,
        resource.RLIMIT_NPROC: 0,
    }
    for limit, value in limits.items():
        hard = resource.getrlimit(limit)[1]
        if hard != resource.RLIM_INFINITY:
            value = min(value, hard)
        # computing time keeps its hard limit, at which no signal would tell the reason
        if limit != resource.RLIMIT_CPU:
            hard = value
        resource.setrlimit(limit, (value, hard))


def _address_space(page_bytes: int) -> int:
    """Bytes of the address space that are used now; 0 where the system does not tell."""
    try:
        with open(STATM, encoding="ascii") as file:
            return int(file.read().split()[0]) * page_bytes
    except OSError:
        return 0


def _write(answer: IO[bytes], content: Any) -> None:
    values = np.ascontiguousarray(content.values, dtype=np.float64)
    facts = {
        "shape": values.shape,
        "names": content.names,
        "sampling_rate": content.sampling_rate,
        "rate_from": content.rate_from,
        "has_level": content.has_level,
    }
    _write_line(answer, facts)
    answer.write(values.data)


def _write_line(answer: IO[bytes], facts: dict[str, Any]) -> None:
    answer.write(json.dumps(facts).encode() + b"\n")
