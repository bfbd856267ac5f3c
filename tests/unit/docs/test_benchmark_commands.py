"""Every ``python -m benchmarks...`` that a page names runs, or its parts do in other tests."""

import argparse
import runpy
import sys
from typing import Any

import pytest
from benchmark_commands import IN_PARTS, QUICK, named
from docs_pages import ROOT

# each compiles kernels of its own, or begins processes
SLOW = {
    "benchmarks",
    "benchmarks.shaft_line",
    "benchmarks.stages",
}


class _Parsed(Exception):
    """Stops a command whose words were understood."""


@pytest.fixture
def stopped_after_parsing(monkeypatch: pytest.MonkeyPatch) -> None:
    known = argparse.ArgumentParser.parse_known_args

    def parse(
        parser: argparse.ArgumentParser, words: Any = None, _space: Any = None
    ) -> Any:
        left = known(parser, words)[1]
        if left:
            parser.error(f"unrecognized arguments: {left}")
        raise _Parsed

    monkeypatch.setattr(argparse.ArgumentParser, "parse_args", parse)


def run(monkeypatch: pytest.MonkeyPatch, module: str, words: list[str]) -> None:
    """Run a module as the command does, in this process; an exit status of 0 is none."""
    monkeypatch.setattr(sys, "argv", [module, *words])
    monkeypatch.setattr(sys, "stdin", None)
    status: Any = None
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    except SystemExit as end:
        status = end.code
    assert not status


def test_every_named_benchmark_has_its_least_run() -> None:
    commands = {module for _, module, _ in named()}
    assert len(commands) > 12
    assert commands - QUICK.keys() - IN_PARTS.keys() == set()
    assert QUICK.keys() & IN_PARTS.keys() == set()
    assert all((ROOT / test).is_file() for test in IN_PARTS.values())


@pytest.mark.parametrize(
    ("page", "module", "words"), list(named()), ids=lambda value: str(value)[:40]
)
def test_a_benchmark_of_a_page_can_be_typed(
    page: str,
    module: str,
    words: list[str],
    monkeypatch: pytest.MonkeyPatch,
    stopped_after_parsing: None,
) -> None:
    with pytest.raises(_Parsed):
        run(monkeypatch, module, words)


def test_a_flag_that_is_none_is_found(
    monkeypatch: pytest.MonkeyPatch, stopped_after_parsing: None
) -> None:
    with pytest.raises(AssertionError):
        run(monkeypatch, "benchmarks.stages", ["--rnus", "3"])


@pytest.mark.parametrize(
    "module",
    [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in QUICK],
)
def test_the_least_of_a_benchmark_runs(
    module: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    if module == "benchmarks.stiffness_time":
        pytest.importorskip("skfem")
    run(monkeypatch, module, list(QUICK[module]))
    assert capsys.readouterr().out
