"""CPU time of a record of ``gensig generate`` by stage: ``python -m benchmarks.stages``.

Quickstart records of 1 s and four channels, made in one process, in 160 records of five shards.
The precisions take turns in one run; compare ratios only.
"""

from __future__ import annotations

import time

from benchmarks import _end_to_end, _rates
from benchmarks._measure import begin, write_json
from gensig.dynamics._vector import PRECISIONS

RK45 = "solve_ivp RK45, right-hand side compiled"


def main() -> None:
    """Measure and print one column for each precision."""
    arguments, named, begun = begin("benchmarks.stages", __doc__ or "")
    size = _end_to_end.WHOLE
    if arguments.quick:
        size = _end_to_end.QUICK
    columns = {
        precision: _end_to_end.by_stage(precision, arguments.runs, size=size)
        for precision in PRECISIONS
    }
    print("\n" + " " * 62 + "".join(f"{name:>22}" for name in columns))
    for row in next(iter(columns.values())):
        values = "".join(f"{column[row]:>22.4g}" for column in columns.values())
        print(f"  {row:<60}{values}")
    machine = _rates.machines()[0]
    works = {RK45: _rates.scipy_works(machine)[RK45]}
    spent = 1e3 / _rates.rates(works, arguments.runs)[RK45]
    print(f"  {RK45 + ', ms a simulated s':<60}{spent:>22.4g}")
    print(f"\n{time.perf_counter() - begun:.0f} s")
    write_json(arguments.json, named, {**columns, "reference": {RK45: spent}})


if __name__ == "__main__":
    main()
