"""Mutated data sets against everything that reads: ``python -m benchmarks.fuzz_campaign``.

Each mutant is a small data set with one change (`benchmarks._damaged_folders`): damaged bytes,
forged shards, manifests and tables. None may crash or hang the reader, fill its memory, make it
look outside the folder, or pass in silence. ``--mutants`` is their number, ``--first`` the first
seed, ``--folder`` a data set to mutate instead of a new one, ``--json FILE`` writes the
figures. The exit status is 1 where any mutant did harm.

``--forged`` takes the forgeries of `benchmarks._forged_sets` in place of accidents: every digest is
recomputed, and every verb of both commands that reads a set is called on it with limits of memory
and time (`benchmarks._forged_judge`). ``--verbs`` names some of them; with `GENSIG_FORGED_LINES=1`
in the environment the line of each verb is printed.
"""

from __future__ import annotations

import argparse
import collections
import json
import os
import platform
import sys
import tempfile
import time
from pathlib import Path

import h5py

from benchmarks import _forged_judge
from benchmarks._fuzz_judge import verdicts

OVERRIDES = (
    "fault=crack",
    "plan.n_records=4",
    "dataset.records_per_shard=2",
    "operating.duration_s=0.02",
)
# every verb of both commands takes this one when it is whole
FORGED_OVERRIDES = (
    "plan.classes=[healthy,crack,pitting,missing_tooth]",
    "plan.n_records=24",
    "dataset.records_per_shard=8",
    "operating.duration_s=0.2",
    "sensing.sampling_rate_hz=10000",
)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--mutants", type=int, default=5000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--forged", action="store_true")
    parser.add_argument("--verbs", default="", help="with --forged: names, with commas")
    arguments = parser.parse_args()
    campaign, overrides = None, OVERRIDES
    if arguments.forged:
        campaign, overrides = _forged_judge.FORGERS, FORGED_OVERRIDES
        os.environ[_forged_judge.VERBS] = arguments.verbs
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as scratch:
        template = arguments.folder
        if template is None:
            import gensig

            template = Path(scratch) / "template"
            gensig.generate(*overrides, out=template).close()
        seeds = range(arguments.first, arguments.first + arguments.mutants)
        harmful, noticed = [], collections.Counter[bool]()
        only_verify = collections.Counter[str]()
        for verdict in verdicts(template, Path(scratch), seeds, campaign):
            noticed[verdict.noticed] += 1
            if verdict.noticed and not verdict.refused:
                only_verify[verdict.kind] += 1
            if verdict.fault:
                harmful.append(verdict)
                print(
                    f"mutant {verdict.seed} ({verdict.kind}): {verdict.fault}",
                    flush=True,
                )
            if sum(noticed.values()) % 500 == 0:
                print(
                    f"{sum(noticed.values())} of {len(seeds)}, {time.monotonic() - begin:.0f} s",
                    flush=True,
                )
    figures = {
        "mutants": len(seeds),
        "harmful": len(harmful),
        "noticed": noticed[True],
        "noticed_by_verify_only": only_verify.total(),
        "kinds_noticed_by_verify_only": dict(only_verify.most_common()),
        "harmless": noticed[False] - sum(not verdict.noticed for verdict in harmful),
        "seconds": round(time.monotonic() - begin, 1),
        "versions": {
            "h5py": h5py.version.version,
            "hdf5": h5py.version.hdf5_version,
            "python": platform.python_version(),
        },
    }
    print(json.dumps(figures, indent=1))
    if arguments.json:
        arguments.json.write_text(
            json.dumps(figures, indent=1) + "\n", encoding="utf-8"
        )
    return 1 if harmful else 0


if __name__ == "__main__":
    sys.exit(main())
