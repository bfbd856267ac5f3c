"""TensorBoard as an option: what it is told is what happened, and it changes nothing."""

import json
import subprocess
import sys

import numpy as np
import pytest
from fake_dataset import FakeDataset

import gensig.dataset.reader
from diagnose.cli import main

accumulator = pytest.importorskip(
    "tensorboard.backend.event_processing.event_accumulator", reason="extra tensorboard"
)

FAST = [
    "window_samples=1200", "stride_samples=1000", "epochs=2", "seeds=[0,1]", "n_bootstrap=20",
    "model.widths=[8,16]", "model.kernels=[32,5]", "model.strides=[8,4]", "protocols=[by_unit]",
    "baselines=[rms_threshold]",
]  # fmt: skip


@pytest.fixture(scope="module")
def studies(tmp_path_factory):
    """The same study with the log, in two processes, and without it, in this one."""
    folder = tmp_path_factory.mktemp("studies")
    data = FakeDataset(n_units=16, records_per_unit=4, duration=0.3)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gensig.dataset.reader, "open_dataset", lambda path: data)
        for name, options in (
            ("with", ["n_threads=2", "tensorboard=true"]),
            ("without", ["n_threads=1"]),
        ):
            assert (
                main(["train", "data=good", f"out={folder / name}", *FAST, *options])
                == 0
            )
    return folder


def scalars(folder):
    """tag -> values."""
    events = accumulator.EventAccumulator(str(folder)).Reload()
    return {
        tag: [event.value for event in events.Scalars(tag)]
        for tag in events.Tags()["scalars"]
    }


def metrics(folder):
    return json.loads((folder / "metrics.json").read_text())


def test_losses_are_those_of_the_study(studies):
    log = studies / "with" / "tensorboard"
    names = sorted(path.name for path in log.iterdir())
    assert names == [
        "by_unit-label_shuffle-seed0",
        "by_unit-seed0",
        "by_unit-seed1",
        "scores",
    ]
    for seed, expected in enumerate(
        metrics(studies / "with")["protocols"]["by_unit"]["validation_loss"]
    ):
        found = scalars(log / f"by_unit-seed{seed}")
        np.testing.assert_allclose(
            found["loss/validation_records"], expected, rtol=1e-6, atol=0
        )
        assert len(found["loss/training_windows"]) == len(expected)
        assert np.isfinite(found["loss/training_windows"]).all()
        assert min(found["loss/training_windows"]) > 0


def test_scores_are_those_of_the_study(studies):
    found = scalars(studies / "with" / "tensorboard" / "scores" / "by_unit")
    methods = metrics(studies / "with")["protocols"]["by_unit"]["methods"]
    for method in ("cnn", "rms_threshold", "label_shuffle"):
        for part in ("mean", "low", "high"):
            (value,) = found[f"balanced_accuracy/{method}/{part}"]
            assert value == pytest.approx(
                methods[method]["balanced_accuracy"][part], rel=1e-6
            )
    assert found["balanced_accuracy/chance/mean"] == [0.25]


def test_nothing_else_depends_on_it(studies):
    assert not (studies / "without" / "tensorboard").exists()
    for seed in (0, 1):
        path = f"models/by_unit-seed{seed}/model.safetensors"
        assert (studies / "with" / path).read_bytes() == (
            studies / "without" / path
        ).read_bytes()
    assert (
        metrics(studies / "with")["protocols"]
        == metrics(studies / "without")["protocols"]
    )


def test_a_value_that_is_no_switch_is_refused(tmp_path, capsys):
    assert main(["train", "data=x", f"out={tmp_path / 'o'}", "tensorboard=2"]) == 2
    assert "tensorboard must be true or false, not 2" in capsys.readouterr().err


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
    assert (
        "tensorboard=true needs the package tensorboard: pip install 'gensig[tensorboard]'"
        in shown.stdout
    )
    assert shown.returncode == 0
