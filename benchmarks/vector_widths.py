"""The compiled cores at narrower vectors: ``python -m benchmarks.vector_widths``.

The same source is compiled for processors with less: each in a process of its own, which is told
(``NUMBA_CPU_NAME``) that it runs on one. Rates are simulated seconds per CPU second, ratios are to
scalar Numba of the same law in the same process. The digest is that of nine clean records.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence

import gensig
from benchmarks import _rates
from benchmarks._measure import begin, write_json
from gensig.dynamics._vector import LANES, PRECISIONS, n_lanes
from gensig.dynamics.backends.nystroem.machine_lanes import group_kind
from gensig.dynamics.backends.nystroem.method import THREE_PAIRS, core_of

# name of a processor, as LLVM knows it; what is empty is this one
TARGETS = {
    "this processor": "",
    "256 bits with FMA (haswell: AVX2)": "haswell",
    "128 bits without FMA (x86-64: SSE2)": "x86-64",
}
CHILD = "--child"
SCALAR = "scalar Numba RK4 x5"


def rates(runs: int, precisions: Sequence[str] = PRECISIONS) -> dict[str, float]:
    """Rates of the cores and of scalar Numba in this process."""
    pairs, boxes = _rates.machines(), _rates.two_stage_boxes()
    box_core = core_of(group_kind(boxes[0].equations))
    works = {SCALAR: _rates.scalar(pairs[:LANES], 5)}
    for precision in precisions:
        n = n_lanes(precision)
        works[f"pair {precision} x5"] = _rates.kernel(
            [pair.dynamics for pair in pairs[:n]], 5, precision, THREE_PAIRS
        )
        works[f"two-stage box {precision} x5"] = _rates.kernel(
            boxes[:n], 5, precision, box_core
        )
    return _rates.rates(works, 4 * runs)


def digest() -> str:
    """SHA-256 of the signals of nine quickstart records of 0.2 s."""
    records = gensig.stream("operating.duration_s=0.2", "plan.n_records=9")
    result = hashlib.sha256()
    for number in range(9):
        result.update(records[number].signals["acceleration"].tobytes())
    return result.hexdigest()


def on(target: str, runs: int) -> tuple[dict[str, float], str]:
    """Rates and digest of a process that is told what processor it has."""
    variables = dict(os.environ)
    if target:
        variables |= {"NUMBA_CPU_NAME": target, "NUMBA_CPU_FEATURES": ""}
    with tempfile.TemporaryDirectory() as cache:
        variables["NUMBA_CACHE_DIR"] = cache
        made = subprocess.run(
            [sys.executable, "-m", "benchmarks.vector_widths", CHILD, str(runs)],
            env=variables,
            check=True,
            capture_output=True,
            text=True,
        )
    measured, bits = json.loads(made.stdout.splitlines()[-1])
    return measured, bits


def main() -> None:
    """Measure every target and print its rates, ratios, and whether the bits are the same."""
    if sys.argv[1:2] == [CHILD]:
        print(json.dumps([rates(int(sys.argv[2])), digest()]))
        return
    arguments, named, begun = begin("benchmarks.vector_widths", __doc__ or "")
    figures, first = {}, ""
    targets = TARGETS
    if arguments.quick:
        targets = {"this process": ""}
    for name, target in targets.items():
        if arguments.quick:
            measured, bits = rates(arguments.runs, ("float64",)), digest()
        else:
            measured, bits = on(target, arguments.runs)
        first = first or bits
        figures[name] = measured
        same = "the same bits" if bits == first else "OTHER BITS"
        print(f"\n{name}: {same} ({bits[:16]})")
        for row, value in measured.items():
            ratio = value / measured[SCALAR]
            print(f"  {row:<32}{value:>10.1f} s/s{ratio:>10.1f} x scalar")
    print(f"\n{time.perf_counter() - begun:.0f} s")
    write_json(arguments.json, named, figures)


if __name__ == "__main__":
    main()
