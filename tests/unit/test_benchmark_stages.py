"""The benchmarks find what they measure: modules, clocked functions, and records as made."""

import importlib
import pkgutil

import pytest

import benchmarks
from benchmarks._stages import CLOCKED, Stages
from gensig.plan.make import make_plan
from gensig.record.inputs import InputReader
from gensig.record.simulate import simulate_records

WITH_ROSS = ("_ross_values",)


@pytest.mark.parametrize(
    "name", [found.name for found in pkgutil.iter_modules(benchmarks.__path__)]
)
def test_every_benchmark_can_be_imported(name):
    """ROSS is installed apart."""
    if name in WITH_ROSS:
        pytest.importorskip("ross")
    importlib.import_module(f"benchmarks.{name}")


def test_every_stage_has_its_function():
    assert all(callable(getattr(owner, name)) for owner, name, _ in CLOCKED)


def test_runs_are_counted(config_with):
    config = config_with({"plan.n_records": 2, "operating.duration_s": 0.02})
    plan, stages = make_plan(config), Stages()
    with stages.watching(1024):
        simulate_records(InputReader(config), [plan.record(0), plan.record(1)])
    assert stages.n_runs >= 2
