"""What the verbs write.

Numbers as JSON, a figure, an option of a group. Refused before anything is computed for it.
"""

from __future__ import annotations

import json
import math
from argparse import Namespace
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.commands.console import replaced_file
from gensig.errors import ConfigError

FIGURE_TYPES = (".png", ".svg", ".pdf")


def check_file(flag: str, name: str | None, types: tuple[str, ...] = ()) -> None:
    """Refuse a file name that cannot be written.

    Another type than ``types`` (where given), or no such folder.
    """
    if name is None:
        return
    path = Path(name)
    if types and path.suffix not in types:
        raise ConfigError(f"{flag} {name}: the name must end in {', '.join(types)}")
    if not path.parent.is_dir():
        raise ConfigError(
            f"{flag} {name}: there is no folder {path.parent}; make it first"
        )
    if path.is_dir():
        raise ConfigError(f"{flag} {name} is a folder; give the name of a file")


def check_outputs(arguments: Namespace) -> None:
    """Refuse ``--json`` and ``--plot`` that cannot be written."""
    check_file("--json", arguments.json)
    check_file("--plot", arguments.plot, FIGURE_TYPES)


def check_new(flag: str, name: str | None, *, force: bool) -> None:
    """Refuse to replace data or options, which may be all there is of them.

    Figures and JSON are made again.
    """
    if name is not None and Path(name).exists() and not force:
        raise ConfigError(
            f"{flag} {name} is there already; choose another name, or add --force to replace it"
        )


def option_file(name: str, group: str, *, force: bool) -> Path:
    """The file of a new option of a configuration group; its stem becomes the option's name."""
    target = Path(name)
    if target.suffix != ".yaml" or not target.stem.isidentifier():
        raise ConfigError(
            f"--out {name}: give a file NAME.yaml in a folder {group}, NAME without spaces"
        )
    if (
        target.parent.name != group or target.parent.exists()
    ):  # a new folder of that name is made with the option
        check_file("--out", name)
    check_new("--out", name, force=force)
    return target


def write_option(target: Path, text: str) -> None:
    """Write an option of a group, with its folder where that is new, and say how to take it."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with replaced_file(target) as path:
        path.write_text(text, encoding="utf-8")
    folder = target.absolute().parent
    print(
        f"{target}: take it with {folder.name}={target.stem} --config-dir {target.parent.parent}"
    )


def write_outputs(
    arguments: Namespace, content: Mapping[str, Any], draw: Callable[[Path], None]
) -> None:
    """Write ``content`` to ``--json`` and let ``draw`` make the figure of ``--plot``, each only
    where asked for.
    """
    if arguments.json is not None:
        with replaced_file(arguments.json) as path:
            text = json.dumps(plain(content), indent=1, allow_nan=False)
            path.write_text(text + "\n", encoding="utf-8")
    if arguments.plot is not None:
        with replaced_file(arguments.plot) as path:
            draw(path)


def plain(value: Any) -> Any:
    """Arrays as lists, and null for what is not finite, which JSON cannot hold."""
    if isinstance(value, Mapping):
        return {key: plain(one) for key, one in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def highest(sound: NDArray[np.float64], faulty: NDArray[np.float64] | None) -> str:
    """The highest stiffness of a pair, and of the faulty one where there is one."""
    both = "" if faulty is None else f" sound, {faulty.max():.4e} N/m faulty"
    return f"{sound.max():.4e} N/m{both}"
