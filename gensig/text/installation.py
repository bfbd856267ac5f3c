"""The command that adds an extra to this installation of gensig."""

from __future__ import annotations

import json
import shlex
import shutil
import sys
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

NAME = "gensig"


def install(extra: str) -> str:
    """The pip command that adds an extra, and for a checkout the folder where it is to be run.

    gensig is on no package index, so the command names what gensig was installed from: a checkout,
    a wheel or an address, as pip has noted it (``direct_url.json``, PEP 610).
    """
    checkout = Path(__file__).resolve().parents[2]
    if (checkout / "pyproject.toml").is_file():
        return _from_folder(checkout, extra, editable=True)
    origin = _origin()
    url = str(origin.get("url", ""))
    if "vcs_info" in origin:
        kind, commit = (origin["vcs_info"][key] for key in ("vcs", "commit_id"))
        return _command(f"{NAME}[{extra}] @ {kind}+{url}@{commit}")
    if url and not url.startswith("file:"):
        return _command(f"{NAME}[{extra}] @ {url}")
    if not url:
        return _command(f"{NAME}[{extra}]")
    path = Path(unquote(urlsplit(url).path))
    if "dir_info" in origin:
        return _from_folder(path, extra, editable=False)
    if not path.exists():
        return f"{_command(f'{path.name}[{extra}]')} in the folder that has this file"
    return _command(f"{path}[{extra}]")


def _from_folder(folder: Path, extra: str, *, editable: bool) -> str:
    words = [f".[{extra}]"]
    if editable:
        words.insert(0, "--editable")
    where = str(folder)
    if not folder.is_dir():
        where = "a checkout of gensig"
    return f"{_command(*words)} in {where}"


def _command(*words: str) -> str:
    """``pip install`` with the pip of this Python: a shell may find that of another."""
    pip = "pip"
    found = shutil.which(pip)
    here = Path(sys.executable).parent
    if found is None or Path(found).parent != here:
        pip = f"{shlex.quote(sys.executable)} -m pip"
    *options, what = words
    return " ".join([pip, "install", *options, shlex.quote(what)])


def _origin() -> dict[str, Any]:
    """The note of pip on where gensig came from; empty for an index."""
    try:
        text = _distribution().read_text("direct_url.json")
    except PackageNotFoundError:
        return {}
    return json.loads(text or "{}")


def _distribution() -> Distribution:
    return distribution(NAME)
