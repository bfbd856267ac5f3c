"""Trained networks on disk.

``model.safetensors`` for the weights, ``model.json`` for what they mean. Never pickle.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from diagnose.data.windows import Task, subset_segments
from diagnose.settings import TrainSettings
from gensig.errors import DatasetError
from gensig.options.configuration import Section

if TYPE_CHECKING:
    from torch import nn

    from diagnose.networks.adaptation import Statistics
    from diagnose.networks.domain import Domain
    from diagnose.networks.network import Network
    from gensig.dataset.reader import Dataset

MODEL_SCHEMA_VERSION = 2
READABLE_VERSIONS = (
    1,
    MODEL_SCHEMA_VERSION,
)  # 1: without out_of_distribution and speed_rpm_range
WEIGHTS, DESCRIPTION = "model.safetensors", "model.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelDescription:
    """What a network was trained on and what it expects; the content of ``model.json``.

    ``out_of_distribution`` is `diagnose.networks.domain.Domain.facts`. It and ``speed_rpm_range``,
    least and greatest speed of the training records in r/min, are None in older models.
    """

    model_schema_version: int
    model: dict[str, Any]
    class_names: tuple[str, ...]
    channel_names: tuple[str, ...]
    sampling_rate_hz: float
    window_samples: int
    stride_samples: int
    normalise: str
    data_schema_version: int | None
    data_fingerprint: str
    protocol: str
    seed: int
    best_epoch: int
    n_bootstrap: int
    speed_rpm_range: tuple[float, float] | None = None
    out_of_distribution: dict[str, Any] | None = None
    n_teeth: tuple[int, int] | None = (
        None  # of the driving and the driven gear; None where not told or not the same
    )
    temperature: float = (
        1.0  # see `diagnose.networks.calibration`; models of before have none
    )
    test_channel_names: tuple[str, ...] | None = None  # of protocol cross_sensor
    adaptation: dict[str, Any] | None = (
        None  # see `diagnose.recordings.machine`; None as trained
    )
    test_score: dict[str, Any] | None = (
        None  # see `diagnose.studies.study.test_score`; models of before have none
    )
    remaining_life: dict[str, Any] | None = (
        None  # see `diagnose.training.life_store`; None for a classifier
    )

    @property
    def network(self) -> Section:
        """Kind and parameters of the network, as `diagnose.networks.registry.build_model` takes
        them.
        """
        return Section("model", self.model)

    @property
    def task(self) -> str:
        """Task of the training, one of `diagnose.settings.TASKS`."""
        return "classes" if self.remaining_life is None else "remaining_life"

    def __post_init__(self) -> None:
        if not 0 < self.temperature < float("inf"):
            raise ValueError(
                f"temperature must be greater than 0, not {self.temperature!r}"
            )


class Trained(Protocol):
    """What a description takes of a trained network."""

    @property
    def protocol(self) -> str:
        """Split that it was trained on."""

    @property
    def seed(self) -> int:
        """Of its training."""

    @property
    def best_epoch(self) -> int:
        """Whose weights were kept."""

    @property
    def domain(self) -> Domain | None:
        """What it takes for known."""

    @property
    def temperature(self) -> float:
        """Of its probabilities."""


def model_description(
    task: Task, settings: TrainSettings, prediction: Trained
) -> ModelDescription:
    """Description of the network behind a prediction."""
    trained_on = subset_segments(task, prediction.protocol, "train").record
    channels, tested = (
        task.part(prediction.protocol, subset).channel_names
        for subset in ("train", "test")
    )
    speed = np.asarray(task.dataset.column("speed_rpm"), dtype=float)[trained_on]
    return ModelDescription(
        model_schema_version=MODEL_SCHEMA_VERSION,
        model=dict(settings.model),
        class_names=task.class_names,
        channel_names=channels,
        sampling_rate_hz=float(task.dataset.sampling_rate),
        window_samples=task.window_samples,
        stride_samples=task.stride_samples,
        normalise=task.normalise,
        data_schema_version=schema_version(task.dataset),
        data_fingerprint=data_fingerprint(task.dataset),
        protocol=prediction.protocol,
        seed=prediction.seed,
        best_epoch=prediction.best_epoch,
        n_bootstrap=settings.n_bootstrap,
        speed_rpm_range=(float(speed.min()), float(speed.max())),
        n_teeth=_n_teeth(task.dataset),
        out_of_distribution=None
        if prediction.domain is None
        else prediction.domain.facts(),
        temperature=prediction.temperature,
        test_channel_names=None if tested == channels else tested,
    )


def _n_teeth(dataset: Dataset) -> tuple[int, int] | None:
    """Teeth of the data set's pinion, which drives, and of its wheel."""
    names = ("n_teeth_pinion", "n_teeth_wheel")
    if any(dataset.attributes.get(name) is None for name in names):
        return None
    return int(dataset.attributes[names[0]]), int(dataset.attributes[names[1]])


def save_model(
    folder: Path, weights: Mapping[str, np.ndarray], description: ModelDescription
) -> None:
    """Write both files into a new folder."""
    from safetensors.numpy import save_file

    folder.mkdir(parents=True, exist_ok=True)
    save_file(
        {key: np.ascontiguousarray(value) for key, value in weights.items()},
        folder / WEIGHTS,
    )
    (folder / DESCRIPTION).write_text(
        json.dumps(asdict(description), indent=2) + "\n", encoding="utf-8"
    )


def load_model(folder: str | Path) -> tuple[Network, ModelDescription]:
    """Classifier in evaluation mode, and its description.

    Raises
    ------
    DatasetError    for a folder without the two files, another schema, a network that says remaining lives, or weights
        that do not belong to the network
    """
    from diagnose.networks.registry import build_model

    folder = Path(folder)
    description = read_description(folder)
    if description.remaining_life is not None:
        raise DatasetError(
            f"{folder} says remaining lives and is no classifier: for diagnose predict, evaluate, export"
        )
    model = build_model(
        description.network,
        n_channels=len(description.channel_names),
        n_classes=len(description.class_names),
    )
    load_weights(model, folder)
    return model.eval(), description


def load_weights(model: nn.Module, folder: Path) -> None:
    """Fill a network with the weights of a folder.

    Raises
    ------
    DatasetError    for weights that do not belong to the network
    """
    import torch

    from diagnose.networks.adaptation import PREFIX
    from diagnose.networks.domain import TENSOR

    stored = {
        k: v
        for k, v in tensors_of(folder).items()
        if k != TENSOR and not k.startswith(PREFIX)
    }
    try:
        model.load_state_dict(
            {name: torch.from_numpy(value) for name, value in stored.items()}
        )
    except (RuntimeError, TypeError) as error:
        raise DatasetError(
            f"{folder / WEIGHTS} does not fit {DESCRIPTION}: {_one_line(error)}"
        ) from None


def load_domain(folder: str | Path, description: ModelDescription) -> Domain | None:
    """What the network of a folder takes for known; None for a model that does not tell.

    Raises
    ------
    DatasetError    for tensors that are no domain
    """
    from diagnose.networks.domain import domain_from

    if description.out_of_distribution is None:
        return None
    try:
        return domain_from(description.out_of_distribution, tensors_of(Path(folder)))
    except DatasetError as error:
        raise DatasetError(f"{folder}: {error}") from None


def load_statistics(folder: str | Path) -> Statistics | None:
    """What healthy training windows look like inside the network of a folder; None for one that
    does not tell.

    Raises
    ------
    DatasetError    for tensors that are no such statistics
    """
    from diagnose.networks.adaptation import statistics_from

    try:
        return statistics_from(tensors_of(Path(folder)))
    except DatasetError as error:
        raise DatasetError(f"{folder}: {error}") from None


def tensors_of(folder: Path) -> dict[str, np.ndarray]:
    """Everything in the file of weights."""
    from safetensors import SafetensorError
    from safetensors.numpy import load_file

    try:
        return load_file(folder / WEIGHTS)
    except FileNotFoundError:
        raise DatasetError(f"{folder} holds no {WEIGHTS}") from None
    except (SafetensorError, OSError, KeyError) as error:
        raise DatasetError(
            f"{folder / WEIGHTS} is not a safetensors file: {_one_line(error)}"
        ) from None


def schema_version(dataset: Dataset) -> int | None:
    """Version of the data set's format, None where it does not say."""
    version = dataset.attributes.get("schema_version")
    return None if version is None else int(version)


def data_fingerprint(dataset: Dataset) -> str:
    """Hash over identity, label, unit and measured speed of every record.

    The same data set, the same text.
    """
    digest = hashlib.sha256()
    for name in ("record_id", "unit_id", "label"):
        digest.update("\n".join(str(value) for value in dataset.column(name)).encode())
    digest.update(np.asarray(dataset.column("speed_rpm"), dtype="<f8").tobytes())
    return digest.hexdigest()


def read_description(folder: str | Path) -> ModelDescription:
    """What the network of a folder was trained on.

    Raises
    ------
    DatasetError    for a folder without such a file, or another schema
    """
    folder = Path(folder)
    path = folder / DESCRIPTION
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        version = content["model_schema_version"]
        if version not in READABLE_VERSIONS:
            known = " and ".join(map(str, READABLE_VERSIONS))
            raise DatasetError(
                f"{path}: model schema {version!r}, this program reads {known}"
            )
        for name in ("class_names", "channel_names"):
            content[name] = tuple(str(value) for value in content[name])
        if content.get("test_channel_names") is not None:
            content["test_channel_names"] = tuple(
                str(value) for value in content["test_channel_names"]
            )
        content["sampling_rate_hz"] = float(content["sampling_rate_hz"])
        for name in ("window_samples", "stride_samples"):
            if not isinstance(content[name], int) or content[name] < 1:
                raise ValueError(
                    f"{name} {content[name]!r} is no positive whole number"
                )
        if content.get("speed_rpm_range") is not None:
            low, high = content["speed_rpm_range"]
            content["speed_rpm_range"] = (float(low), float(high))
        if content.get("n_teeth") is not None:
            driving, driven = content["n_teeth"]
            content["n_teeth"] = (int(driving), int(driven))
        for name in (
            "out_of_distribution",
            "adaptation",
            "remaining_life",
            "test_score",
        ):
            if content.get(name) is not None:
                content[name] = dict(content[name])
        return ModelDescription(**content)
    except FileNotFoundError:
        inside = sorted(
            child.name
            for child in (folder / "models").glob("*")
            if (child / DESCRIPTION).is_file()
        )
        hint = (
            f"; choose one of its models, for instance {folder / 'models' / inside[0]}"
            if inside
            else ""
        )
        raise DatasetError(f"{folder} holds no {DESCRIPTION}{hint}") from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DatasetError(
            f"{path} does not describe a model: {_one_line(error)}"
        ) from None


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:160]
