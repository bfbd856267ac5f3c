"""Files of new options: their names, a check that they compose, and the commands that follow."""

from __future__ import annotations

import shlex
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from gensig.dataset.storage.made_together import write_together
from gensig.errors import ConfigError
from gensig.faults.registry import read_faults
from gensig.options.files import USER_FOLDER
from gensig.options.groups import options
from gensig.plan.request import read_request
from gensig.record.machines import read_machine
from gensig.text.option_writing import is_option_name


def check_name(name: str, groups: Iterable[str], files: Iterable[Path]) -> None:
    """Raise ConfigError for a name that no option can have, that is shipped, or taken."""
    if not is_option_name(name):
        raise ConfigError(
            f"'{name}' cannot be the name of a gearbox: "
            "use a letter, then letters, digits, _ and -, at most 64"
        )
    for group in groups:
        if name in options(group):
            raise ConfigError(
                f"{group}={name} comes with gensig and would hide yours; "
                "choose another name"
            )
    for file in files:
        if file.exists():
            raise _taken(file)


def _taken(file: Path) -> ConfigError:
    return ConfigError(
        f"{file} is there already; choose another name or --dir, or edit it"
    )


def check_texts(
    name: str, texts: Mapping[str, str], tables: Mapping[str, str] | None = None
) -> None:
    """Raise for an experiment that makes no machine, before anything is written.

    Parameters
    ----------
    texts : group -> text of its option ``name``
    tables : key of ``system`` -> text of the table that it names
    """
    with tempfile.TemporaryDirectory() as folder:
        words = [f"experiment={name}"]
        for group, text in texts.items():
            _write(Path(folder) / group / f"{name}.yaml", text)
        for key, text in (tables or {}).items():
            file = Path(folder) / f"{key}.csv"
            _write(file, text)
            words.append(f"system.{key}={file}")
        config = read_request(words, config_dir=folder).config
        for fault in config["classes"].values():
            read_faults(fault)
        read_machine(config)


def check_free(files: Mapping[Path, str]) -> None:
    """Raise ConfigError for a file that is there with another text.

    One with the same text was left by a call that was killed.
    """
    for file, text in files.items():
        if file.exists() and not _holds(file, text):
            raise _taken(file)


def write_options(files: Mapping[Path, str]) -> None:
    """Write texts to those files that are missing, in their order, with their folders.

    Parameters
    ----------
    files : of one gearbox, its experiment last: where that is, all others are

    Raises
    ------
    DatasetError    when the disk refuses, after which nothing new is left
    """
    missing = {file: text for file, text in files.items() if not file.exists()}
    write_together(missing, instead="choose another --dir")


def _holds(file: Path, text: str) -> bool:
    """True for an ordinary file of that text."""
    content = text.encode()
    if not file.is_file() or file.stat().st_size != len(content):
        return False
    return file.read_bytes() == content


def _write(file: Path, text: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")


def next_commands(folder: Path, name: str) -> Sequence[str]:
    """Commands on a new gearbox, as they are typed; ./configs needs no flag."""
    words = f"experiment={name}"
    if folder != Path(USER_FOLDER):
        words = f"--config-dir {shlex.quote(str(folder))} {words}"
    return [
        f"gensig simulate {words} fault=missing_tooth --plot {name}.png",
        f"gensig generate {words} out=runs/{name}",
        f"gensig report runs/{name}",
    ]
