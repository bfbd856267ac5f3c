"""``gensig validate``: printed values of the sources and computed ones."""

from __future__ import annotations

import importlib
import sys
from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gensig.commands.console import remark, replaced_file
from gensig.errors import ConfigError
from gensig.terminal.printing import show

ROWS = Path(__file__).resolve().parents[2] / "tests" / "literature"


def validate(arguments: Namespace) -> int:
    """Compare every row; the exit status is 0 where each has the verdict it declares.

    Raises
    ------
    ConfigError    in an installed package, which has no rows
    """
    verdicts, page = _of_checkout("verdicts"), _of_checkout("markdown")
    results = verdicts.run_validation()
    if arguments.markdown:
        _write_pages(page.markdown(results), Path(arguments.markdown).parent)
    show(*page.shortfalls(results), *page.summary(results).splitlines())
    n_surprises = sum(not result.as_expected for result in results)
    if n_surprises:
        remark(f"{n_surprises} row(s) differ from what they declare")
    return int(n_surprises > 0)


def _write_pages(texts: Mapping[str, str], docs: Path) -> None:
    """Write the index, a page and a CSV for each paper, and the page on realism."""
    for name, text in texts.items():
        target = docs / name
        target.parent.mkdir(parents=True, exist_ok=True)
        with replaced_file(target) as path:
            path.write_text(text, encoding="utf-8")


def _of_checkout(module: str) -> Any:
    """A module of the validation rows, which live with the tests of the literature."""
    if not (ROWS / "validation").is_dir():
        raise ConfigError(
            "gensig validate compares rows that are kept with the tests: "
            "run it in a checkout of gensig, after 'pip install --editable .'"
        )
    if str(ROWS) not in sys.path:
        sys.path.insert(0, str(ROWS))
    return importlib.import_module(f"validation.{module}")
