"""Options of one's own in ./configs, which are found without being pointed to."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from gensig.errors import ConfigError
from gensig.options.files import USER_FOLDER, user_folder

T = TypeVar("T")


class OwnOptionsWarning(UserWarning):
    """Note that options of ./configs are used; said once."""

    once = True


def with_own_options(
    read: Callable[[str | Path | None], T], config_dir: str | Path | None
) -> T:
    """Result of ``read`` for a folder of own options; ./configs where none is given.

    ./configs is read only where the options of the package do not suffice, and a warning says so.

    Parameters
    ----------
    read : takes the folder, None for the package alone; raises ConfigError for an option that
        is not there
    config_dir : folder of own options; None where none is given

    Raises
    ------
    ConfigError    from ``read``; where ./configs does not help either, from the call with it
    """
    if config_dir is not None:
        return read(config_dir)
    folder = user_folder()
    if folder is None:
        return read(None)
    try:
        return read(None)
    except ConfigError:
        result = read(folder)
    say_read()
    return result


def say_read() -> None:
    """Warn that ./configs is read."""
    warnings.warn(
        f"./{USER_FOLDER} is read for options of your own; --config-dir DIR names another folder",
        OwnOptionsWarning,
        stacklevel=4,  # the caller of read_request
    )
