"""Runs of the command ``diagnose`` on data sets in memory."""

import csv
import json

import pytest

import gensig.dataset.reader
from diagnose.cli import main
from diagnose.settings import settings_from
from gensig.errors import DatasetError
from gensig.options.compose import compose

SMALL_CNN = (
    "model=cnn",
    "model.widths=[8,16]",
    "model.kernels=[32,5]",
    "model.strides=[8,4]",
)
PROTOCOLS = "protocols=[by_unit,cross_specimen,random_window_leaky]"
QUICK = (
    PROTOCOLS,
    "window_samples=1200",
    "stride_samples=1000",
    "n_threads=1",
    "epochs=2",
    "seeds=[0]",
    "n_bootstrap=100",
)
FAST = (*QUICK, *SMALL_CNN)
LIFE = (
    "task=remaining_life",
    PROTOCOLS,
    "window_samples=1600",
    "stride_samples=1600",
    "epochs=5",
    "seeds=[0]",
    "n_bootstrap=200",
    "n_threads=1",
    "epoch_fraction=1",
    "learning_rate=0.01",
    *SMALL_CNN,
)
NETWORK_ONLY = (
    "protocols=[by_unit]",
    "shuffle_control=false",
    "baselines=false",
    "metadata_probe=false",
)


def serve(patch, datasets):
    """Open data sets of a dictionary in place of folders."""

    def open_dataset(path, **_):
        if str(path) not in datasets:
            raise DatasetError(f"{path} is no data set: it has no manifest.json")
        return datasets[str(path)]

    patch.setattr(gensig.dataset.reader, "open_dataset", open_dataset)


def train(out, dataset, *words):
    """Train on a data set, or on several by their names, into a folder and return it."""
    datasets = dataset if isinstance(dataset, dict) else {"good": dataset}
    with pytest.MonkeyPatch.context() as patch:
        serve(patch, datasets)
        assert main(["train", "data=good", f"out={out}", *words]) == 0
    return out


def model_of(out, name="by_unit-seed0"):
    return str(out / "models" / name)


def metrics_of(out):
    return json.loads((out / "metrics.json").read_text())


def by_unit(out):
    """Results of by_unit of a study."""
    return metrics_of(out)["protocols"]["by_unit"]


def rows_of(path):
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def settings_of(*words):
    return settings_from(compose("train", ["data=x", "out=y", *words]))


def says(capsys, *words, status=0):
    """Lines that the command prints."""
    capsys.readouterr()
    assert main([str(word) for word in words]) == status
    return capsys.readouterr().out


def refuses(capsys, words, *messages):
    """The command exits with 2 and one line on stderr, which holds the messages."""
    capsys.readouterr()
    assert main([str(word) for word in words]) == 2
    captured = capsys.readouterr()
    (line,) = captured.err.strip().splitlines()
    assert captured.out == ""
    assert line.startswith("diagnose: ")
    for message in messages:
        assert message in line
