"""Small bugs in the code against its tests: ``python -m benchmarks.mutants [--count 200]``.

A mutant is the code with one bug: nine fixed ones (`benchmarks._fixed_mutants`), and others drawn
by a seed (`benchmarks._mutant_draws`) from all of gensig and diagnose. Half of these are of the
kinds of bugs that others found in our tests: exchanged arguments, dropped keywords, bounds of
slices, order of calls, units, axes, stale keys of caches. Kernels are left out, as every change
compiles them all. Each mutant lives in a copy of the tree, where the nearest test files run until
one fails (`benchmarks._mutant_tests`).

Verdicts: ``killed`` (a test failed, or hung), ``survived``, ``unfinished`` (no test failed in the
time of a mutant), ``equivalent`` (no test can tell it from the code, by
``mutant_reasons.csv``). That table also has the reason of every survivor. The share of killed
mutants counts all but the equivalent ones. Tests that killed must pass in the copy without a bug;
this is checked at the end of every call.

Results are appended to ``--json``, and a further call goes on where the last one ended, even one
that was killed. A verdict is of the code and the tests of the commit that it names: a mutant whose
module has changed since is drawn no longer, or again, and ``--stored`` prints it as it was.
``--again`` judges survivors once more. ``--folder`` keeps the copy. The exit status is 1 below the
goal, for a survivor without a reason, and for a killing test that fails without a bug.

Own code instead of mutmut or cosmic-ray: those try all mutants of a package against one command,
while here a few are drawn across two packages and each meets other test files.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import json
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path

from benchmarks._fixed_mutants import FIXED
from benchmarks._mutant_draws import Mutant, drawn_mutants, fixed_mutants
from benchmarks._mutant_tests import SECONDS_A_TEST, Copy, Outcome, nearest_tests

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "mutants.json"
REASONS = ROOT / "benchmarks" / "mutant_reasons.csv"
SEED = 48  # of the stored results
GOAL = 0.95  # share of the mutants that tests must kill
FIRST_FILES = 2  # run alone at first, as collecting all takes longer than most verdicts
LAWS = {bug.name: bug.law for bug in FIXED}
KILLED, SURVIVED, EQUIVALENT = "killed", "survived", "equivalent"
UNFINISHED, GAP = "unfinished", "gap"


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """Verdict on a mutant.

    Attributes
    ----------
    verdict : ``killed``, ``survived``, ``unfinished`` or ``equivalent``
    by : the test that killed it; ``hung`` if a test took too long; else ''
    n_files : test files that were run, or begun
    seconds : wall time of the tests
    commit : of the code and the tests
    """

    mutant: Mutant
    verdict: str
    by: str
    n_files: int
    seconds: float
    commit: str


def read_reasons(path: Path) -> dict[tuple[str, ...], tuple[str, str]]:
    """Key of a mutant -> (``equivalent`` or ``gap``, reason)."""
    with path.open(encoding="utf-8", newline="") as file:
        return {
            tuple(
                row[name]
                for name in ("file", "function", "text", "original", "mutated")
            ): (
                row["verdict"],
                row["reason"],
            )
            for row in csv.DictReader(file)
        }


def judge(copy: Copy, mutant: Mutant, commit: str) -> Result:
    """Verdict of the nearest tests on a mutant, in a refreshed copy."""
    tests = nearest_tests(copy.tree, mutant.file, mutant.function)
    law = LAWS.get(mutant.function, "")
    if law and (copy.tree / law).exists():
        tests = list(dict.fromkeys([law, *tests]))
    outcome = Outcome(status="no test", test="", seconds=0.0)
    with copy.changed(mutant.file, mutant.source(copy.tree)):
        for some in (tests[:FIRST_FILES], tests[FIRST_FILES:]):
            if some and outcome.status in ("no test", "passed"):
                before = outcome.seconds
                outcome = copy.judge(some)
                outcome = replace(outcome, seconds=before + outcome.seconds)
    verdict, by = SURVIVED, ""
    if outcome.status in ("failed", "hung"):
        verdict, by = KILLED, outcome.test or outcome.status
    if outcome.status == UNFINISHED:
        verdict = UNFINISHED
    n_files = len(tests)
    if outcome.test:
        n_files = tests.index(outcome.test.split("::")[0]) + 1
    return Result(
        mutant=mutant,
        verdict=verdict,
        by=by,
        n_files=n_files,
        seconds=round(outcome.seconds, 1),
        commit=commit,
    )


def failing_without_a_bug(copy: Copy, results: Sequence[Result]) -> list[str]:
    """Tests that killed and fail in the copy as it is too."""
    tests = sorted({result.by for result in results if "::" in result.by})
    failing = []
    if tests and copy.judge(tests, all_of_them=True).status != "passed":
        failing = [test for test in tests if copy.judge([test]).status != "passed"]
    return failing


def read_results(path: Path) -> list[Result]:
    """Results of a file; none if there is no file."""
    if not path.exists():
        return []
    results = []
    for row in json.loads(path.read_text(encoding="utf-8"))["mutants"]:
        mutant = Mutant(**{field.name: row.pop(field.name) for field in fields(Mutant)})
        results.append(Result(mutant=mutant, **row))
    return results


def other_draw(path: Path, seed: int) -> str:
    """A line for a file whose results are of another seed, '' where a draw may go on."""
    if not path.exists():
        return ""
    stored = json.loads(path.read_text(encoding="utf-8"))["seed"]
    if stored == seed:
        return ""
    return (
        f"{path} has the draw of seed {stored}, not {seed}; give --seed {stored}, or another "
        "--json FILE, that becomes the stored one when it is whole"
    )


def write_results(path: Path, results: Sequence[Result], seed: int) -> None:
    """A JSON file with one mutant a line."""
    rows = []
    for result in results:
        row = asdict(result)
        rows.append(json.dumps({**row.pop("mutant"), **row}))
    body = ",\n".join(rows)
    part = path.with_suffix(".part")  # a call may be ended at any time
    part.write_text(f'{{"seed": {seed}, "mutants": [\n{body}\n]}}\n', encoding="utf-8")
    part.replace(path)


def with_equivalents(results: Sequence[Result]) -> list[Result]:
    """Results with survivors as equivalent that the table of reasons calls so.

    Raises
    ------
    ValueError    for an equivalent mutant that a test has killed
    """
    reasons = read_reasons(REASONS)
    classified = []
    for result in results:
        mutant = result.mutant
        if reasons.get(mutant.key, ("", ""))[0] == EQUIVALENT:
            if result.verdict == KILLED:
                raise ValueError(f"{REASONS.name}: {result.by} kills {mutant}")
            result = replace(result, verdict=EQUIVALENT)
        classified.append(result)
    return classified


def table(results: Sequence[Result], of: str = "package") -> str:
    """Killed share by ``package`` or ``operator`` of the mutants, as text."""
    groups: dict[str, Counter[str]] = defaultdict(Counter)
    for result in results:
        groups[getattr(result.mutant, of)][result.verdict] += 1
        groups["all"][result.verdict] += 1
    lines = [f"{of:<22}{'killed':>8}{'of':>6}{'share':>8}{'equivalent':>12}"]
    for name in (*sorted(groups.keys() - {"all"}), "all"):
        counts = groups[name]
        judged = sum(counts.values()) - counts[EQUIVALENT]
        share = counts[KILLED] / max(judged, 1)
        lines.append(
            f"{name:<22}{counts[KILLED]:>8}{judged:>6}{share:>8.1%}{counts[EQUIVALENT]:>12}"
        )
    return "\n".join(lines)


def campaign(
    copy: Copy, arguments: argparse.Namespace, earlier: Sequence[Result]
) -> Iterator[Result]:
    """Results of the mutants that have none yet, or are to be judged again."""
    reasons = read_reasons(REASONS)
    done = {result.mutant.key for result in earlier}
    commit = _commit(copy.root)
    drawn = drawn_mutants(copy.tree, arguments.seed)
    chosen = list(itertools.islice(drawn, arguments.count))
    chosen += fixed_mutants(copy.tree)
    if arguments.again:  # those too that changed modules draw no longer
        settled = (KILLED, EQUIVALENT)
        left = [result.mutant for result in earlier if result.verdict not in settled]
        done -= {mutant.key for mutant in left}
        known = {mutant.key for mutant in chosen}
        chosen += [mutant for mutant in left if mutant.key not in known]
    for mutant in chosen:
        if mutant.key in done or not mutant.fits(copy.tree):
            continue
        if reasons.get(mutant.key, ("", ""))[0] == EQUIVALENT:
            yield Result(
                mutant=mutant,
                verdict=EQUIVALENT,
                by="",
                n_files=0,
                seconds=0.0,
                commit=commit,
            )
            continue
        yield judge(copy, mutant, commit)


def _commit(root: Path) -> str:
    command = ["git", "rev-parse", "--short=12", "HEAD"]
    return subprocess.run(
        command, cwd=root, capture_output=True, text=True, check=True
    ).stdout.strip()


def report(results: Sequence[Result]) -> bool:
    """Print survivors with their reasons and the table; True if the goal is reached."""
    reasons = read_reasons(REASONS)
    unexplained = False
    for result in results:
        if result.verdict in (KILLED, EQUIVALENT):
            continue
        mutant = result.mutant
        reason = reasons.get(mutant.key, ("", "NO REASON GIVEN"))[1]
        unexplained |= mutant.key not in reasons
        print(f"{result.verdict}: {mutant.file}:{mutant.line} in {mutant.function}")
        print(f"    {mutant.original}  ->  {mutant.mutated}\n    {reason}")
    print(table(results), table(results, "operator"), sep="\n\n")
    counts = Counter(result.verdict for result in results)
    judged = len(results) - counts[EQUIVALENT]
    return counts[KILLED] >= GOAL * judged and not unexplained


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=200, help="drawn mutants")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--again", action="store_true", help="judge survivors again")
    parser.add_argument("--stored", action="store_true", help="print stored results")
    parser.add_argument("--folder", type=Path, help="keeps the copy of the tree")
    parser.add_argument(
        "--patience", type=float, default=1.0, help="with a test, on a busy machine"
    )
    parser.add_argument("--json", type=Path, default=RESULTS)
    arguments = parser.parse_args()
    stored = with_equivalents(read_results(arguments.json))
    results = {result.mutant.key: result for result in stored}
    failing: list[str] = []
    if not arguments.stored and (line := other_draw(arguments.json, arguments.seed)):
        parser.error(line)
    if not arguments.stored:
        with tempfile.TemporaryDirectory(prefix="gensig-mutants-") as name:
            copy = Copy(
                root=ROOT,
                folder=(arguments.folder or Path(name)).resolve(),
                seconds_a_test=arguments.patience * SECONDS_A_TEST,
            )
            copy.refresh()
            for result in campaign(copy, arguments, list(results.values())):
                results[result.mutant.key] = result
                write_results(arguments.json, list(results.values()), arguments.seed)
                mutant = result.mutant
                print(
                    f"{len(results)}: {result.verdict} in {result.seconds:g} s, "
                    f"{mutant.file}:{mutant.line}: {mutant.original} -> {mutant.mutated}"
                    f" {result.by}",
                    flush=True,
                )
            failing = failing_without_a_bug(copy, list(results.values()))
    for test in failing:
        print(f"fails without a bug: {test}")
    reached = report(list(results.values()))
    return int(not reached or bool(failing))


if __name__ == "__main__":
    sys.exit(main())
