"""``python -m benchmarks.mutants``: what is changed, who judges it, and a sample of verdicts."""

import argparse
import ast
import functools
import itertools
import os
import subprocess
import sys
import textwrap
from collections import Counter
from dataclasses import replace

import pytest

from benchmarks import _stale_cache, mutants
from benchmarks._mutant_draws import BY_HAND, packages
from benchmarks._mutant_tests import Copy, nearest_tests
from benchmarks._mutation import OF_OTHERS, OPERATORS, mutated_source, sites
from benchmarks.mutants import EQUIVALENT, KILLED, Mutant, Result

ROOT = mutants.ROOT
# operator, a function, and what takes the place of its last line
EXAMPLES = [
    ("comparison", "return a < b", "return (a >= b)"),
    ("comparison", "return a in b", "return (a not in b)"),
    ("boundary", "return a < b", "return (a <= b)"),
    ("arithmetic", "return c / (a - b)", "return c / ((a + b))"),
    ("arithmetic", "return c / a**2", "return c / (a * 2)"),
    ("arithmetic", "a -= b", "a += b"),
    ("constant", "return a[0]", "return a[(1)]"),
    ("constant", "return 0.5 * a", "return (1.0) * a"),
    ("constant", "return f(True)", "return f((False))"),
    ("negation", "return not a", "return (a)"),
    ("connective", "return a and b", "return (a or b)"),
    ("sign", "return b - -a", "return b - (a)"),
    ("function", "return np.sin(a)", "return (np.cos(a))"),
    ("function", "return min(a, b)", "return (max(a, b))"),
    ("axis", "return a.sum(axis=0)", "return (a.sum(axis=1))"),
    ("arguments", "return f(a, b)", "return (f(b, a))"),
    ("arguments", "return f(low=a, high=b)", "return (f(low=b, high=a))"),
    ("arguments", "return f(x.a, x.b)", "return (f(x.b, x.a))"),
    ("arguments", "return f(0.0, 1.0)", "return (f(1.0, 0.0))"),
    ("axis", "return a.T @ b", "return (a) @ b"),
    ("axis", "return a.shape[0]", "return (a.shape[1])"),
    ("axis", "return a[:, None]", "return (a[None, :])"),
    ("keyword", "return f(a, side=b)", "return (f(a))"),
    ("slice", "return a[b:c]", "return (a[b:c - 1])"),
    ("slice", "return a[:, b:]", "return (a[:, b + 1:])"),
    ("slice", "return a[:-1]", "return (a[:])"),
    ("slice", "return range(1, c)", "return (range(1, c - 1))"),
    ("unit", "return a * 60.0 / b", "return (a) / b"),
    ("unit", "return 2.0 * math.pi / a", "return (1.0 / a)"),
    ("unit", "return to_si(key, a)", "return (a)"),
    ("order", "return np.abs(np.diff(a))", "return (np.diff(np.abs(a)))"),
    ("order", "f(a)\n    g(b)", "g(b); f(a)"),
    ("cache key", "key = a, b", "key = ((b,))"),
    ("cache key", "digest.update(a)", "pass"),
    ("result", "return f(a)", "return 0 * f(a)"),
]
CACHED = """
@lru_cache(maxsize=4)
def scaled(number: float, factor: float) -> float:
    return number * factor
"""
UNTOUCHED = '''
"""Text of 1 < 2."""
Kind = "a + b"
def f(a: tuple[int, 3]) -> Literal[1]:
    """Not 1 but 2."""
    if TYPE_CHECKING:
        a = 1
    assert a
    raise ValueError(1 + 2)
@cache(maxsize=8)
class A:
    def __repr__(self):
        return 1 + 1
'''


def function_of(line: str) -> str:
    return f"def g(a: float, b: float, c: int) -> float:\n    {line}\n"


class TestChanges:
    @pytest.mark.parametrize(("operator", "line", "mutated"), EXAMPLES)
    def test_an_operator_changes_one_thing(self, operator, line, mutated):
        source = function_of(line)
        results = {
            mutated_source(source, site)
            for site in sites(source)
            if site.operator == operator
        }
        assert function_of(mutated) in results

    def test_every_operator_has_an_example(self):
        assert {operator for operator, _, _ in EXAMPLES} == set(OPERATORS)

    @pytest.mark.parametrize(
        ("blind", "later"), [("number", [5.0, 2.0]), ("factor", [2.0, 12.0])]
    )
    def test_a_cache_may_be_blind_for_a_parameter(self, blind, later, monkeypatch):
        monkeypatch.setitem(sys.modules, "_stale_cache", _stale_cache)
        (site,) = [site for site in sites(CACHED) if f"blind('{blind}'" in site.mutated]
        space = {"lru_cache": functools.lru_cache}
        exec(mutated_source(CACHED, site), space)
        scaled = space["scaled"]
        assert [scaled(1.0, 2.0), scaled(3.0, factor=4.0)] == [2.0, 12.0]
        assert [scaled(1.0, 5.0), scaled(3.0, 2.0)] == later
        assert scaled.cache_info().hits > 0

    def test_texts_types_and_errors_stay(self):
        assert sites(UNTOUCHED) == []

    @pytest.mark.parametrize(
        ("operator", "line"),
        [
            ("arguments", "return f(a, c)"),
            ("arguments", "return max(a, b)"),
            ("arguments", "return f('a', 'b')"),
            ("keyword", "return zip(a, b, strict=True)"),
            ("order", "return float(np.abs(a))"),
            ("unit", "return 3.0 * a"),
        ],
    )
    def test_what_would_change_nothing_or_fail_at_once_stays(self, operator, line):
        source = function_of(line)
        assert operator not in {site.operator for site in sites(source)}

    def test_a_change_is_where_other_letters_precede_it(self):
        source = 'x = ("ä", "ö", 1 < a)\n'
        (site,) = [site for site in sites(source) if site.operator == "comparison"]
        assert mutated_source(source, site) == 'x = ("ä", "ö", (1 >= a))\n'

    def test_a_change_that_changes_nothing_is_refused(self):
        source = function_of("return a < b")
        (site,) = [site for site in sites(source) if site.operator == "boundary"]
        with pytest.raises(ValueError, match="changes nothing"):
            mutated_source(source.replace("a < b", "a<=b"), site)


class TestDraws:
    def test_a_seed_is_a_list_of_different_mutants_of_all_packages(self):
        n = 2 * len(packages(ROOT))
        first, again, other = (
            list(itertools.islice(mutants.drawn_mutants(ROOT, seed), n_drawn))
            for seed, n_drawn in ((0, n), (0, n), (1, 8))
        )
        assert first == again
        assert first[:8] != other
        assert len({mutant.key for mutant in first}) == len(first)
        assert {mutant.package for mutant in first} == set(packages(ROOT))
        kinds = Counter(mutant.operator for mutant in first)
        assert sum(kinds[kind] for kind in OF_OTHERS) >= len(first) / 2
        assert min(kinds[kind] for kind in OF_OTHERS) >= 4

    def test_every_mutant_is_a_program_that_differs(self):
        drawn = itertools.islice(mutants.drawn_mutants(ROOT, 0), 60)
        fixed = mutants.fixed_mutants(ROOT)
        assert len(fixed) == 9
        for mutant in (*fixed, *drawn):
            text = (ROOT / mutant.file).read_text(encoding="utf-8")
            tree = ast.parse(mutant.source(ROOT))
            assert ast.dump(tree) != ast.dump(ast.parse(text)), mutant


PROJECT = {
    "gensig/__init__.py": "",
    "diagnose/__init__.py": "",
    "gensig/ratios.py": """
        def ratio(a: float, b: float) -> float:
            if a < b:
                return b / a
            return a / b


        def until(limit: int) -> int:
            n = 0
            while n < limit:
                n += 1
            return n
        """,
    "gensig/other.py": "",
    "gensig/parent.py": "CODE = 'from gensig.child import main; main()'\n",
    "gensig/child.py": "def main() -> None: ...\n",
    "tests/unit/test_parent.py": "from gensig import parent\n",
    "gensig/command.py": "from gensig import verbs\n",
    "gensig/verbs.py": "from gensig import verb\n",
    "gensig/verb.py": "from gensig import page\n",
    "gensig/page.py": "RUNS = 'gensig.far_away:draw'\n",
    "gensig/far_away.py": "",
    "tests/unit/test_command.py": "from gensig import command\n",
    "tests/unit/test_ratios.py": """
        from gensig.ratios import ratio, until

        def test_a_ratio_is_never_below_one():
            assert ratio(1.0, 2.0) == ratio(2.0, 1.0) == 2.0

        def test_steps():
            assert until(4) == 4
        """,
    "tests/unit/test_other.py": """
        import gensig.other

        def test_nothing():
            pass
        """,
}


@pytest.fixture
def copy(tmp_path):
    """Copy of a small project."""
    root = tmp_path / "project"
    for name, text in PROJECT.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(textwrap.dedent(text).lstrip())
    subprocess.run(["git", "init", "--quiet"], cwd=root, check=True)
    result = Copy(root=root, folder=tmp_path / "copy")
    result.refresh()
    return result


@pytest.fixture
def mutant_of(copy):
    def make(original: str, mutated: str) -> Mutant:
        return Mutant(
            file="gensig/ratios.py",
            line=1,
            function="",
            operator=BY_HAND,
            text="",
            original=original,
            mutated=mutated,
        )

    return make


class TestVerdicts:
    def test_a_bug_is_killed_by_the_test_that_sees_it(self, copy, mutant_of):
        result = mutants.judge(copy, mutant_of("a < b", "a >= b"), "")
        test = "tests/unit/test_ratios.py::test_a_ratio_is_never_below_one"
        assert (result.verdict, result.by, result.n_files) == (KILLED, test, 1)
        assert mutants.failing_without_a_bug(copy, [result]) == []

    def test_the_nearest_tests_come_first_whatever_a_conftest_sorts(
        self, copy, mutant_of
    ):
        (copy.tree / "conftest.py").write_text(
            "def pytest_collection_modifyitems(items):\n    items.reverse()\n"
        )
        with copy.changed("gensig/ratios.py", "def ratio(a, b): ...\nuntil = ratio\n"):
            outcome = copy.judge(["tests/unit/test_ratios.py"])
        assert outcome.test.endswith("::test_a_ratio_is_never_below_one")

    def test_a_change_of_no_consequence_survives(self, copy, mutant_of):
        result = mutants.judge(copy, mutant_of("a < b", "a <= b"), "")
        assert (result.verdict, result.by) == ("survived", "")

    def test_a_bug_that_never_ends_is_killed(self, copy, mutant_of):
        hasty = replace(copy, seconds_a_test=1.0)
        result = mutants.judge(hasty, mutant_of("n += 1", "n -= 1"), "")
        assert (result.verdict, result.by) == (KILLED, "hung")

    def test_no_verdict_in_time_is_no_kill(self, copy, mutant_of):
        hasty = replace(copy, seconds=2.0)
        result = mutants.judge(hasty, mutant_of("n += 1", "n -= 1"), "")
        assert result.verdict == "unfinished"

    def test_a_stored_survivor_is_judged_again_though_no_longer_drawn(
        self, copy, mutant_of, monkeypatch
    ):
        monkeypatch.setattr(mutants, "drawn_mutants", lambda *_: iter(()))
        monkeypatch.setattr(mutants, "fixed_mutants", lambda _: [])
        monkeypatch.setattr(mutants, "_commit", lambda _: "")
        stored = [
            replace(result_with("survived"), mutant=mutant_of("a < b", "a >= b")),
            replace(result_with("survived"), mutant=mutant_of("a line that went", "")),
            replace(result_with(KILLED), mutant=mutant_of("n += 1", "n -= 1")),
        ]
        for again, verdicts in ((True, [KILLED]), (False, [])):
            arguments = argparse.Namespace(again=again, count=0, seed=0)
            results = mutants.campaign(copy, arguments, stored)
            assert [result.verdict for result in results] == verdicts

    def test_a_test_that_fails_anyway_is_found_out(self, copy, mutant_of):
        result = mutants.judge(copy, mutant_of("a < b", "a >= b"), "")
        broken = copy.tree / "gensig/ratios.py"
        broken.write_text(broken.read_text().replace("a < b", "a > b"))
        assert mutants.failing_without_a_bug(copy, [result]) == [result.by]

    def test_the_copy_is_the_project_again_and_the_project_never_changes(
        self, copy, mutant_of
    ):
        file = mutant_of("", "").file
        before = os.stat(copy.tree / file)
        with copy.changed(file, "x = 1\n"):
            assert (copy.tree / file).read_text() == "x = 1\n"
            assert "ratio" in (copy.root / file).read_text()
        assert (copy.tree / file).read_bytes() == (copy.root / file).read_bytes()
        assert os.stat(copy.tree / file).st_mtime_ns == before.st_mtime_ns

    def test_only_tests_that_reach_a_module_judge_it(self, copy):
        tests = nearest_tests(copy.tree, "gensig/ratios.py")
        assert tests == ["tests/unit/test_ratios.py"]

    def test_a_module_of_a_child_process_is_judged_by_who_starts_it(self, copy):
        tests = nearest_tests(copy.tree, "gensig/child.py")
        assert tests == ["tests/unit/test_parent.py"]

    def test_without_a_near_test_the_nearest_far_one_judges(self, copy):
        tests = nearest_tests(copy.tree, "gensig/far_away.py")
        assert tests == ["tests/unit/test_command.py"]

    def test_no_test_is_no_kill(self, copy, mutant_of):
        (copy.tree / "gensig/alone.py").write_text("x = 1 + 1\n")
        alone = replace(mutant_of("1 + 1", "1 - 1"), file="gensig/alone.py")
        result = mutants.judge(copy, alone, "")
        assert (result.verdict, result.n_files) == ("survived", 0)


@pytest.mark.parametrize(
    ("module", "test"),
    [
        ("gensig/signals/reading/reader_child.py", "signals/test_hostile_recordings"),
        ("gensig/commands/figures/wear_figure.py", "commands/test_wear_command"),
        ("gensig/commands/sets/running.py", "commands/test_set_commands"),
        ("gensig/commands/gears/modify.py", "commands/test_gear_commands"),
        ("diagnose/commands/predict.py", "recordings/test_healthy_recordings"),
    ],
)
def test_modules_that_no_import_statement_reaches_have_tests(module, test):
    assert any(test in name for name in nearest_tests(ROOT, module, "run"))


def result_with(verdict: str, text: str = "") -> Result:
    mutant = Mutant(
        file="gensig/a/b.py",
        line=1,
        function="",
        operator="sign",
        text=text,
        original="-a",
        mutated="a",
    )
    return Result(
        mutant=mutant, verdict=verdict, by="", n_files=1, seconds=1.0, commit=""
    )


class TestReport:
    def test_results_come_back_from_their_file(self, tmp_path):
        results = [result_with(KILLED), result_with("survived", "ä")]
        mutants.write_results(tmp_path / "a.json", results, 0)
        assert mutants.read_results(tmp_path / "a.json") == results

    @pytest.mark.parametrize(
        ("n_killed", "n_survived", "reached"), [(95, 5, True), (94, 6, False)]
    )
    def test_the_goal_counts_all_but_the_equivalent_ones(
        self, n_killed, n_survived, reached, monkeypatch
    ):
        reasons = {result_with("survived").mutant.key: ("gap", "known")}
        monkeypatch.setattr(mutants, "read_reasons", lambda _: reasons)
        results = [result_with(KILLED)] * n_killed
        results += [result_with("survived")] * n_survived
        results += [result_with(EQUIVALENT)] * 100
        assert mutants.report(results) is reached

    @pytest.mark.parametrize(
        ("of", "group"), [("package", "gensig/a"), ("operator", "sign")]
    )
    def test_the_table_has_the_killed_share_of_each_group(self, of, group):
        results = [
            result_with(KILLED),
            result_with("survived"),
            result_with(EQUIVALENT),
        ]
        rows = [line.split() for line in mutants.table(results, of).splitlines()]
        assert rows[0][0] == of
        assert rows[1:] == [[name, "1", "2", "50.0%", "1"] for name in (group, "all")]

    def test_a_survivor_without_a_reason_is_a_failure(self, monkeypatch):
        monkeypatch.setattr(mutants, "read_reasons", lambda _: {})
        results = [result_with(KILLED)] * 99 + [result_with("survived")]
        assert not mutants.report(results)

    def test_an_equivalent_mutant_is_no_survivor_and_never_killed(self, monkeypatch):
        reasons = {result_with("survived").mutant.key: (EQUIVALENT, "the same")}
        monkeypatch.setattr(mutants, "read_reasons", lambda _: reasons)
        others = [result_with("survived", "b"), result_with(KILLED, "c")]
        results = mutants.with_equivalents([result_with("survived"), *others])
        assert results == [result_with(EQUIVALENT), *others]
        with pytest.raises(ValueError, match="kills"):
            mutants.with_equivalents([result_with(KILLED)])

    def test_every_stored_survivor_has_a_reason(self):
        reasons = mutants.read_reasons(mutants.REASONS)
        left = [
            result.mutant
            for result in mutants.with_equivalents(
                mutants.read_results(mutants.RESULTS)
            )
            if result.verdict in ("survived", "unfinished")
        ]
        assert [mutant for mutant in left if mutant.key not in reasons] == []


@pytest.fixture(scope="module")
def real_copy(tmp_path_factory):
    """Copy of this project."""
    result = Copy(root=ROOT, folder=tmp_path_factory.mktemp("mutants"))
    result.refresh()
    return result


def sample(verdict: str, n: int) -> list[Mutant]:
    """The first stored drawn mutants of a verdict whose code is still there, quick ones first."""
    results = mutants.with_equivalents(mutants.read_results(mutants.RESULTS))
    results.sort(key=lambda result: result.seconds)
    return [
        result.mutant
        for result in results
        if result.verdict == verdict
        and result.mutant.operator != BY_HAND
        and result.mutant.fits(ROOT)
    ][:n]


@pytest.mark.slow
def test_stored_kills_are_kills(real_copy):
    chosen = sample(KILLED, 4)
    assert chosen
    results = [mutants.judge(real_copy, mutant, "") for mutant in chosen]
    assert {result.verdict for result in results} == {KILLED}
    assert mutants.failing_without_a_bug(real_copy, results) == []


@pytest.mark.slow
def test_equivalent_mutants_survive(real_copy):
    chosen = sample(EQUIVALENT, 2)
    assert chosen
    verdicts = {mutants.judge(real_copy, mutant, "").verdict for mutant in chosen}
    assert verdicts == {"survived"}


def test_two_draws_are_not_mixed(tmp_path):
    path = tmp_path / "results.json"
    assert mutants.other_draw(path, 48) == ""
    mutants.write_results(path, [], 48)
    assert mutants.other_draw(path, 48) == ""
    assert "has the draw of seed 48, not 47" in mutants.other_draw(path, 47)
