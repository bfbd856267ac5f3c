"""The benchmark's clocks stand on functions that are there, and see the records that are made."""

from benchmarks._stages import CLOCKED, Stages
from gensig.plan.make import make_plan
from gensig.record.simulate import simulate_records


def test_every_stage_has_its_function():
    assert all(callable(getattr(owner, name)) for owner, name, _ in CLOCKED)


def test_runs_are_counted(config_with):
    config = config_with({"plan.n_records": 2, "operating.duration_s": 0.02})
    plan, stages = make_plan(config), Stages()
    with stages.watching(1024):
        simulate_records(
            config,
            [plan.record(0), plan.record(1)],
        )
    assert stages.n_runs >= 2
