"""What the verbs share: a parser that complains in one line, and the refusal of a folder that holds something."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import NoReturn

from gensig.errors import ConfigError, DatasetError


class Parser(argparse.ArgumentParser):
    """Parser whose complaints are the one line of `diagnose.cli.main`."""

    def error(self, message: str) -> NoReturn:
        """Refuse the words."""
        raise ConfigError(f"{message}; see {self.prog} --help")


def verb_parser(verb: str, description: str, epilog: str) -> Parser:
    """Parser of a verb, to be given its arguments."""
    return Parser(
        prog=f"diagnose {verb}",
        description=description,
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )


def refuse_existing(folder: Path) -> None:
    """Refuse an output folder that holds anything; touches nothing."""
    if folder.is_dir() and not any(folder.iterdir()):
        return
    if folder.exists() or folder.is_symlink():
        raise DatasetError(f"out={folder} exists and is not an empty folder; choose another or remove it")
