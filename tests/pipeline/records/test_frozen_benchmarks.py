"""The frozen benchmarks are still made as they were, by their own methods of integration."""

import numpy as np
import pytest

from diagnose.studies.benchmark import RTOL, frozen_benchmarks
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader
from gensig.record.simulate import simulate_records

N_RECORDS = 3


@pytest.mark.parametrize("benchmark", frozen_benchmarks(), ids=lambda each: each.name)
def test_signals_are_those_that_were_frozen(benchmark):
    config = read_request([f"experiment={benchmark.name}"]).config
    plan = make_plan(config)
    names = list(benchmark.signal_rms)[:N_RECORDS]
    rows = [plan.record(int(name.removeprefix("r"))) for name in names]
    for name, record in zip(
        names, simulate_records(InputReader(config), rows), strict=True
    ):
        signals = np.square(record.signals["acceleration"], dtype=float)
        rms = np.sqrt(signals.mean(axis=-1))
        assert record.values["record_id"] == name
        np.testing.assert_allclose(rms, benchmark.signal_rms[name], rtol=RTOL)
