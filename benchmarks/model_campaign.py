"""Mutated and forged models against ``diagnose``: ``python -m benchmarks.model_campaign``.

Each mutant is a model folder with one change (`benchmarks._damaged_models`): damaged, cut, swapped
and missing files, pipes, devices and links, forged values and absurd sizes with digests that fit,
other numbers, types and shapes of tensors. ``diagnose predict`` must refuse it in one line with
status 2, or answer finite numbers; where no stranger signed it anew, those of the untouched model.
``--mutants`` is their number, ``--first`` the first seed, ``--json FILE`` writes the figures. The
exit status is 1 where any mutant did harm.
"""

from __future__ import annotations

import argparse
import collections
import json
import sys
import tempfile
import time
from pathlib import Path

from benchmarks._damaged_models import SIGNED_ANEW
from benchmarks._fuzz_judge import verdicts
from benchmarks._model_judge import CAMPAIGN
from benchmarks._stored_models import make_models


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--mutants", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    begin = time.monotonic()
    figures = collections.Counter[str]()
    seeds = range(arguments.first, arguments.first + arguments.mutants)
    with tempfile.TemporaryDirectory() as scratch:
        template = Path(scratch) / "template"
        make_models(template)
        for verdict in verdicts(template, Path(scratch), seeds, CAMPAIGN):
            outcome = "answered as the untouched model"
            if verdict.kind.endswith(SIGNED_ANEW):
                outcome = "signed anew, finite answer"
            if verdict.noticed:
                outcome = "noticed by verify only"
            if verdict.refused:
                outcome = "refused in one line"
            if verdict.fault:
                outcome = "harmful"
                line = f"mutant {verdict.seed} ({verdict.kind}): {verdict.fault}"
                print(line, flush=True)
            figures[outcome] += 1
            if figures.total() % 50 == 0:
                seconds = time.monotonic() - begin
                print(f"{figures.total()} of {len(seeds)}, {seconds:.0f} s", flush=True)
    result = {"mutants": len(seeds), **dict(figures.most_common())}
    print(json.dumps(result, indent=1))
    if arguments.json:
        arguments.json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    return int(figures["harmful"] > 0)


if __name__ == "__main__":
    sys.exit(main())
