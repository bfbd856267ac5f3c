"""Readers that do in the process of a recording what a hostile file could make a library do."""

import contextlib
import ctypes
import os
import sys
import time

import numpy as np

from gensig.signals.reading.recording_files import Content


def sleeps(file, array):
    time.sleep(600.0)


def computes(file, array):
    while True:
        pass


def allocates(file, array):
    return [bytes(100_000_000) for _ in range(1000)]


def reads_nothing(file, array):
    ctypes.string_at(0)


def aborts(file, array):
    os.abort()


def raises(file, array):
    raise RuntimeError("not a mistake of the user")


def leaves(file, array):
    sys.exit(0)


def writes(file, array):
    with open(file, "wb") as stream:
        stream.write(b"x" * 1000)


def prints(file, array):
    """A library that prints where the answer goes."""
    print('{"shape": [1, 1]}', flush=True)
    os.write(1, b'{"shape": [1, 1]}\n')
    return Content(values=np.arange(6.0).reshape(2, 3), sampling_rate=None)


def answers_itself(text):
    """Write something else than an answer to the pipe of the answer, and leave."""
    for number in range(3, 10):
        with contextlib.suppress(OSError):
            os.write(number, text)
    os._exit(0)


def promises_more(file, array):
    answers_itself(
        b'{"shape": [2, 9], "names": null, "sampling_rate": null, "rate_from": "",'
        b' "has_level": true}\n12345678'
    )


def promises_ten_gigabytes(file, array):
    answers_itself(b'{"shape": [1, 1250000000]}\n')


def promises_less_than_nothing(file, array):
    answers_itself(b'{"shape": [-1, -8]}\n')


def answers_nonsense(file, array):
    answers_itself(b'[[["error"\n')


def answers_a_list(file, array):
    answers_itself(b"[1, 2]\n")


def is_large(file, array):
    return Content(values=np.zeros((1, 70_000_000)), sampling_rate=None)


def tells_its_limits(file, array):
    import resource

    limits = (resource.RLIMIT_CORE, resource.RLIMIT_NPROC, resource.RLIMIT_FSIZE)
    values = [float(resource.getrlimit(limit)[0]) for limit in limits]
    return Content(values=np.array([values]), sampling_rate=None)


def names(file, array):
    from gensig.errors import ConfigError

    raise ConfigError("a\nb \x1b[31m" + "x" * 5000)
