"""Small stored networks of every kind with a recording each, made without training."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from diagnose.baselines.tooth_features import GEAR_FEATURES
from diagnose.networks.domain import METHOD, QUANTILE, TENSOR
from diagnose.networks.registry import build_model
from diagnose.recordings.registry import shipped_network
from diagnose.recordings.tooth_classifier import ARRAYS, TOOTH_KIND
from diagnose.scoring.hours import LifeFacts
from diagnose.training.model_files import MODEL_SCHEMA_VERSION
from diagnose.training.remaining_life import LifeNetwork
from diagnose.training.store import ModelDescription, save_model
from gensig.options.configuration import Section

RATE, SECONDS = (
    51_200,
    0.8,
)  # of the recordings, as in the training of the shipped network
SPEED_RPM, TEETH = 1500.0, (23, 46)
WINDOW = 1024
CLASSES = ("healthy", "crack", "pitting")
CNN: dict[str, Any] = {
    "name": "cnn",
    "kind": "small_cnn",
    "widths": [4, 8],
    "kernels": [32, 5],
    "strides": [8, 4],
    "dropout": 0.2,
    "training": {"epochs": 30, "patience": 0},
}
TOLD = ("speed_rpm", "torque_nm")
RECORDING = "recording.npz"


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """A stored model and the options that ``diagnose predict`` needs for its recording."""

    name: str
    options: tuple[str, ...]

    def words(self, folder: Path) -> list[str]:
        """Words of the command on the models of a folder."""
        model = ["--model", str(folder / self.name)]
        return ["predict", str(folder / RECORDING), *model, *self.options, "--json"]


GEARS = ("--speed-rpm", f"{SPEED_RPM:g}", "--teeth", *map(str, TEETH), "--as-recorded")
ASKED = (
    Asked(name="cnn", options=("--speed-rpm", f"{SPEED_RPM:g}")),
    Asked(name="any_pair", options=GEARS),
    Asked(name="hours", options=("--speed-rpm", f"{SPEED_RPM:g}", "--torque-nm", "20")),
    Asked(name="tooth_logistic", options=GEARS),
)


def make_models(folder: Path) -> None:
    """Write one model of each kind of `ASKED` and the recording into a folder."""
    folder.mkdir(parents=True)
    np.savez(folder / RECORDING, acceleration=_recording()[None], sampling_rate_hz=RATE)
    shutil.copytree(shipped_network(), folder / "any_pair")
    rng = np.random.default_rng(0)
    torch.manual_seed(0)
    network = build_model(Section("model", CNN), n_channels=1, n_classes=len(CLASSES))
    domain = {TENSOR: rng.normal(0.0, 1.0, (50, 12)).astype(np.float32)}
    flag = {
        "method": METHOD,
        "quantile": QUANTILE,
        "threshold": 5.0,
        "n_validation_windows": 100,
    }
    described = _description(model=CNN, out_of_distribution=flag, temperature=1.3)
    save_model(folder / "cnn", _arrays(network) | domain, described)
    zero, one = np.zeros(len(TOLD)), np.ones(len(TOLD))
    life = LifeNetwork(Section("model", CNN), [1.0], zero, one)
    hours = LifeFacts(
        method="cnn",
        early_life_h=100.0,
        half_width_h=20.0,
        coverage=0.8,
        n_calibration_lives=9,
        told=TOLD,
        told_range={"speed_rpm": (1000.0, 2000.0), "torque_nm": (10.0, 30.0)},
    )
    described = _description(model=CNN, out_of_distribution=flag, remaining_life=hours)
    save_model(folder / "hours", _arrays(life) | domain, described)
    n_features, n = 2 * len(GEAR_FEATURES), len(CLASSES)
    shapes = ((n_features,),) * 3 + ((n, n_features), (n,))
    arrays = {
        name: rng.uniform(0.5, 1.5, shape).astype(np.float32)
        for name, shape in zip(ARRAYS, shapes, strict=True)
    }
    kind = {"name": TOOTH_KIND, "kind": TOOTH_KIND, "samples_per_tooth": 16}
    described = _description(model=kind, n_teeth=TEETH)
    save_model(folder / "tooth_logistic", arrays, described)


def _arrays(network: torch.nn.Module) -> dict[str, np.ndarray]:
    return {name: value.numpy() for name, value in network.state_dict().items()}


def _description(**values: Any) -> ModelDescription:
    return ModelDescription(
        model_schema_version=MODEL_SCHEMA_VERSION,
        class_names=CLASSES,
        channel_names=("acceleration",),
        sampling_rate_hz=float(RATE),
        window_samples=WINDOW,
        stride_samples=WINDOW,
        normalise="rms",
        data_schema_version=None,
        data_fingerprint="none",
        protocol="new_machine",
        seed=0,
        best_epoch=1,
        n_bootstrap=100,
        speed_rpm_range=(1000.0, 2000.0),
        **values,
    )


def _recording(orders: Sequence[int] = (1, 2, 3)) -> np.ndarray:
    """(sample,) the mesh of a gear pair with its harmonics and noise, m/s^2."""
    rng = np.random.default_rng(1)
    time = np.arange(int(RATE * SECONDS)) / RATE
    mesh = SPEED_RPM / 60.0 * TEETH[0]
    tones = sum(np.sin(2.0 * np.pi * order * mesh * time) / order for order in orders)
    return (5.0 * tones + rng.standard_normal(time.size)).astype(np.float32)
