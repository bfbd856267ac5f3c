"""Data sets whose speed and load vary: traces in the file."""

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose
from small_sets import TINY, make

from gensig.cli import main
from gensig.dataset.reader import open_dataset


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return make(
        tmp_path_factory.mktemp("drifting") / "data",
        "operating=drifting",
        "dataset.store_operating=true",
    )


def test_the_traces_are_in_the_file(folder):
    data = open_dataset(folder)
    for name in ("shaft_speed", "torque_set"):
        assert data.trace(0, name).shape == (1024,)
    speed = np.array(
        [data.trace(place, "shaft_speed").mean() for place in range(data.n_records)]
    )
    assert_allclose(speed * 30 / np.pi, data.column("speed_rpm"), rtol=1e-4, atol=0)
    assert len(np.unique(data.column("params/operating.course_seed"))) == 3


def test_the_configuration_has_the_duration_of_turns(tmp_path):
    words = [word for word in TINY if not word.startswith("operating.")]
    out = tmp_path / "data"
    words += ["executor.n_workers=1", "operating.turns=1", f"out={out}"]
    assert main(["generate", "--quiet", *words]) == 0
    config = yaml.safe_load((out / "config.yaml").read_text(encoding="utf-8"))
    assert config["operating"]["turns"] == 1
    duration = config["operating"]["duration_s"]
    assert duration == pytest.approx(1 / 30, abs=1 / 51200)
    assert open_dataset(out).signals(0).shape == (1, 1707)
    assert main(["reproduce", str(out), "--records", "1"]) == 0
