"""Readers of foreign formats in a process of their own, with limits of memory and time.

A file of a stranger may crash or mislead the library that reads it. Whatever happens there, this
process gets the values or one line.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
from dataclasses import dataclass
from typing import IO, Any

import numpy as np

from gensig.errors import ConfigError
from gensig.signals.reading.recording_files import Content
from gensig.text.escaping import escaped
from gensig.text.user_file import MOST_BYTES

CODE = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from gensig.signals.reading.reader_child import main; main(sys.argv[2])"
)
# one thread: each takes address space
ENVIRONMENT = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"
)
LONGEST_FACTS = 16_000_000  # bytes, names of columns included
LONGEST_MESSAGE = 1_000  # characters
BYTES_A_SECOND = 2_000_000  # slowest reading that is waited for
DAMAGED = "the file is damaged or made to mislead; export it anew"


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Limits of the process that reads a file.

    Attributes
    ----------
    memory_bytes : beyond what the process has when it begins
    cpu_seconds : s    of computing
    seconds : s    until it is ended
    """

    memory_bytes: int
    cpu_seconds: int
    seconds: float


def limits_for(n_bytes: int) -> Limits:
    """Limits for a file of so many bytes: several copies of the largest array, and patience."""
    cpu_seconds = 20 + n_bytes // BYTES_A_SECOND
    return Limits(
        memory_bytes=6 * MOST_BYTES, cpu_seconds=cpu_seconds, seconds=4.0 * cpu_seconds
    )


def read_apart(reader: str, file: str, array: str | None, limits: Limits) -> Content:
    """Content of a file that a reader in another process returns.

    Parameters
    ----------
    reader : ``module:function``, called with `file` and `array`
    file : as the user named it
    array : name of an array; None is the reader's default
    limits : of the process

    Raises
    ------
    ConfigError    that of the reader; one line for a crash, and where a limit ends the process
    """
    request = {
        "reader": reader,
        "file": file,
        "array": array,
        "parent": os.getpid(),
        "memory_bytes": limits.memory_bytes,
        "cpu_seconds": limits.cpu_seconds,
    }
    with _started(file, request) as process:
        timer = threading.Timer(limits.seconds, process.kill)
        timer.daemon = True
        timer.start()
        try:
            content = _answer_of(file, process)
            status = process.wait()
        finally:
            is_late = not timer.is_alive()
            timer.cancel()
            process.kill()
    if content is None or status != 0:
        raise ConfigError(f"{file} cannot be read: {_end(status, is_late, limits)}")
    return content


def _started(file: str, request: dict[str, Any]) -> subprocess.Popen[bytes]:
    """The process that reads a file; it does not run the user's program again."""
    paths = json.dumps(list(map(str, sys.path)))
    try:
        return subprocess.Popen(
            [sys.executable, "-P", "-c", CODE, paths, json.dumps(request)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=os.environ | ENVIRONMENT,
        )
    except OSError as error:
        raise ConfigError(
            f"{file} cannot be read: no process starts to read it ({error.strerror}); end "
            "other programs"
        ) from None


def _answer_of(file: str, process: subprocess.Popen[bytes]) -> Content | None:
    """Content that a process wrote; None for anything else that it wrote."""
    assert process.stdout is not None
    # a process that went astray may write anything
    with (
        process.stdout as pipe,
        contextlib.suppress(ValueError, TypeError, LookupError, RecursionError),
    ):
        return _answer(file, pipe)
    return None


def _answer(file: str, pipe: IO[bytes]) -> Content | None:
    """Content from the pipe; None where the process ended before all of it was written."""
    line = pipe.readline(LONGEST_FACTS)
    if not line.endswith(b"\n"):
        return None
    facts = json.loads(line)
    if "error" in facts:
        raise ConfigError(_one_line(facts["error"]))
    if "out_of_memory" in facts:
        raise ConfigError(
            f"{file} cannot be read: its reader needs more memory than a recording of "
            f"{MOST_BYTES // 1_000_000} MB; {DAMAGED}"
        )
    n_channels, n_samples = map(int, facts["shape"])
    if min(n_channels, n_samples) < 0:
        return None
    if 8 * n_channels * n_samples > MOST_BYTES:
        raise ConfigError(f"{file} is larger than {MOST_BYTES // 1_000_000} MB; cut it")
    values = np.empty((n_channels, n_samples))
    if not _filled(values, pipe):
        return None
    return _content(facts, values)


def _content(facts: dict[str, Any], values: np.ndarray) -> Content:
    names, rate = facts["names"], facts["sampling_rate"]
    if names is not None:
        names = tuple(map(str, names))
    if rate is not None:
        rate = float(rate)
    return Content(
        values=values,
        sampling_rate=rate,
        rate_from=str(facts["rate_from"]),
        has_level=bool(facts["has_level"]),
        names=names,
    )


def _filled(values: np.ndarray, pipe: IO[bytes]) -> bool:
    """True where the pipe held as many bytes as the array has."""
    rest = values.reshape(values.size).data.cast("B")
    while len(rest):
        n_read = pipe.readinto(rest)  # type: ignore[attr-defined]
        if not n_read:
            return False
        rest = rest[n_read:]
    return True


def _end(status: int, is_late: bool, limits: Limits) -> str:
    """Reason for a process that ended without its answer."""
    if is_late:
        return f"its reader took more than {limits.seconds:g} s; {DAMAGED}"
    if status == -signal.SIGXCPU:
        return (
            f"its reader took more than {limits.cpu_seconds} s of computing; {DAMAGED}"
        )
    if status < 0:
        return f"its reader crashed ({signal.Signals(-status).name}); {DAMAGED}"
    return f"its reader ended with status {status}; {DAMAGED}"


def _one_line(text: str) -> str:
    """The text on one printable line of moderate length."""
    line = escaped(str(text))
    if len(line) > LONGEST_MESSAGE:
        return f"{line[: LONGEST_MESSAGE - 3]}..."
    return line
