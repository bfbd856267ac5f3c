"""``gensig validate``: printed values of the sources and computed ones."""

from __future__ import annotations

from argparse import Namespace

from gensig.commands.console import remark, replaced_file
from gensig.validation.markdown import markdown, shortfalls, summary
from gensig.validation.verdicts import run_validation


def validate(arguments: Namespace) -> int:
    """Compare every row; the exit status is 0 where each has the verdict it declares."""
    results = run_validation()
    if arguments.markdown:
        with replaced_file(arguments.markdown) as path:
            path.write_text(markdown(results), encoding="utf-8")
    print(*shortfalls(results), summary(results), sep="\n")
    n_surprises = sum(not result.as_expected for result in results)
    if n_surprises:
        remark(f"{n_surprises} row(s) differ from what they declare")
    return int(n_surprises > 0)
