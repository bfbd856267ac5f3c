"""The verb validate: what the sources print beside what we compute."""

from __future__ import annotations

import sys
from argparse import Namespace

from gensig.commands.console import replaced_file
from gensig.validation.markdown import markdown, shortfalls, summary
from gensig.validation.verdicts import run_validation


def validate(arguments: Namespace) -> int:
    """Compare every row; the exit status is 0 where each has the verdict it declares."""
    results = run_validation()
    if arguments.markdown:
        with replaced_file(arguments.markdown) as path:
            path.write_text(markdown(results), encoding="utf-8")
    for line in shortfalls(results):
        print(line)
    print(summary(results))
    surprises = [result for result in results if not result.as_expected]
    if surprises:
        print(
            f"gensig: {len(surprises)} row(s) differ from what they declare",
            file=sys.stderr,
        )
        return 1
    return 0
