"""TensorBoard as an option: its log is that of the study, and it changes nothing."""

import json
import subprocess
import sys

import numpy as np
import pytest
from fake_dataset import FakeDataset
from small_studies import train

from gensig.text.installation import install

accumulator = pytest.importorskip(
    "tensorboard.backend.event_processing.event_accumulator", reason="extra tensorboard"
)


@pytest.fixture(scope="module")
def studies(tmp_path_factory):
    """The same study with the log and without it."""
    folder = tmp_path_factory.mktemp("studies")
    data = FakeDataset(n_units=16, records_per_unit=4, duration=0.2)
    words = ["epochs=2", "seeds=[0,1]", "baselines=[rms_threshold]"]
    train(data, folder / "with", *words, "tensorboard=true")
    train(data, folder / "without", *words)
    return folder


def scalars(folder):
    """tag -> values."""
    events = accumulator.EventAccumulator(str(folder)).Reload()
    tags = events.Tags()["scalars"]
    return {tag: [event.value for event in events.Scalars(tag)] for tag in tags}


def protocols(folder):
    return json.loads((folder / "metrics.json").read_text())["protocols"]


def test_losses_are_those_of_the_study(studies):
    log = studies / "with" / "tensorboard"
    runs = ["by_unit-label_shuffle-seed0", "by_unit-seed0", "by_unit-seed1"]
    assert sorted(path.name for path in log.iterdir()) == [*runs, "scores"]
    losses = protocols(studies / "with")["by_unit"]["validation_loss"]
    for run, expected in zip(runs[1:], losses, strict=True):
        logged = scalars(log / run)
        np.testing.assert_allclose(
            logged["loss/validation_records"], expected, rtol=1e-6
        )
        training = logged["loss/training_windows"]
        assert len(training) == len(expected)
        assert np.isfinite(training).all()
        assert min(training) > 0


def test_scores_are_those_of_the_study(studies):
    logged = scalars(studies / "with" / "tensorboard" / "scores" / "by_unit")
    methods = protocols(studies / "with")["by_unit"]["methods"]
    for method in ("cnn", "rms_threshold", "label_shuffle"):
        score = methods[method]["balanced_accuracy"]
        for part in ("mean", "low", "high"):
            values = logged[f"balanced_accuracy/{method}/{part}"]
            assert values == pytest.approx([score[part]], rel=1e-6)
    assert logged["balanced_accuracy/chance/mean"] == [0.25]


def test_nothing_else_depends_on_it(studies):
    assert not (studies / "without" / "tensorboard").exists()
    one, two = studies / "with", studies / "without"
    for seed in (0, 1):
        path = f"models/by_unit-seed{seed}/model.safetensors"
        assert (one / path).read_bytes() == (two / path).read_bytes()
    assert protocols(one) == protocols(two)


def test_without_the_package_one_line_says_what_to_install():
    code = (
        "import sys; sys.modules['tensorboard'] = None\n"
        "from diagnose.training.tensorboard import need_tensorboard\n"
        "from gensig.errors import ConfigError\n"
        "try: need_tensorboard()\n"
        "except ConfigError as error: print(error)\n"
    )
    shown = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    message = f"needs the package tensorboard: {install('tensorboard')}"
    assert f"tensorboard=true {message}" in shown.stdout
    assert shown.returncode == 0
