"""Data sets that one call of ``gensig generate`` or ``gensig plan`` asks for."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from gensig.errors import ConfigError
from gensig.options.compose import job_folders, sweep
from gensig.options.typed_only import refuse_untyped
from gensig.plan.request import Request, read_request


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """One data set: its request, a name that tells it from the others, and its folder.

    ``folder`` is None where ``out`` is not given.
    """

    request: Request
    name: str
    folder: Path | None


def typed_words(arguments: Namespace) -> list[str]:
    """Typed overrides, with those that were typed as flags.

    Raises
    ------
    ConfigError    for a key that is given as a flag too
    """
    flags = {"out": arguments.out_flag, "executor.n_workers": arguments.workers}
    words = list(arguments.overrides)
    for key, value in flags.items():
        if value is None:
            continue
        if any(word.startswith(f"{key}=") for word in words):
            raise ConfigError(f"{key} is given as a flag too; leave one out")
        words.append(f"{key}={value}")
    return words


def read_jobs(arguments: Namespace) -> list[Job]:
    """The one data set of the typed words, or with -m one for each combination of values.

    All are composed before the first one is made. With -m each gets a folder below ``out``.

    Raises
    ------
    ConfigError    for anything that cannot be used, and for several values of ``out``
    """
    words = typed_words(arguments)
    combinations = [words]
    if arguments.multirun:
        combinations = sweep(words, config_dir=arguments.config_dir)
    requests = [
        read_request(
            combination, config_dir=arguments.config_dir, stored=arguments.config
        )
        for combination in combinations
    ]
    for request, combination in zip(requests, combinations, strict=True):
        refuse_untyped(request.config, combination)
    parents = {str(request.config["out"] or "") for request in requests}
    if len(parents) > 1:
        raise ConfigError(
            "out must be one folder; with -m each data set gets a folder below it"
        )
    names = [""]
    if arguments.multirun:
        names = job_folders(combinations)
    folders = _folders(parents.pop(), names)
    return [
        Job(request=request, name=name, folder=folder)
        for request, name, folder in zip(requests, names, folders, strict=True)
    ]


def _folders(out: str, names: Sequence[str]) -> Sequence[Path | None]:
    """Folder of each data set; a set without a name takes ``out`` itself."""
    if not out:
        return [None] * len(names)
    return [Path(out).expanduser() / name for name in names]
