"""Stored networks: weights in ``model.safetensors``, description in ``model.json``, no pickle."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from diagnose.data.teeth import common_teeth, teeth_range
from diagnose.data.windows import Task, subset_segments
from diagnose.settings import TrainSettings
from diagnose.training.carried import Carried, carried_from, carried_in
from gensig.errors import DatasetError
from gensig.options.configuration import Section

if TYPE_CHECKING:
    from torch import nn

    from diagnose.networks.domain import Domain
    from diagnose.networks.network import Network
    from gensig.dataset.reader import Dataset

MODEL_SCHEMA_VERSION = 2
# Version 1 is without out_of_distribution and speed_rpm_range.
READABLE_VERSIONS = (1, MODEL_SCHEMA_VERSION)
SHOWN_MODELS = 12  # in an error message
WEIGHTS, DESCRIPTION = "model.safetensors", "model.json"
UNUSED = "adaptation."  # tensors of models of versions before 0.15


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelDescription:
    """Training and input of a network; the content of ``model.json``.

    Attributes
    ----------
    speed_rpm_range : least and greatest speed of the training records in r/min; None in older
        models
    out_of_distribution : `diagnose.networks.domain.Domain.facts`; None in older models
    n_teeth : of the driving and the driven gear; None if unknown or not the same for all records
    n_teeth_range : fewest and most teeth of the driving and of the driven gears; None where
        `n_teeth` says them
    temperature : see `diagnose.networks.calibration`; 1 in older models
    test_channel_names : of protocol cross_sensor
    adaptation : method and recordings of a model that a version before 0.15 adapted; else None
    test_score : see `diagnose.studies.study.test_score`; None in older models
    remaining_life : see `diagnose.training.life_store`; None for a classifier
    carried : blocks of recordings that carried implants; None for a network of any other data set,
        and in older models
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
    n_teeth: tuple[int, int] | None = None
    n_teeth_range: tuple[tuple[int, int], tuple[int, int]] | None = None
    temperature: float = 1.0
    test_channel_names: tuple[str, ...] | None = None
    adaptation: dict[str, Any] | None = None
    test_score: dict[str, Any] | None = None
    remaining_life: dict[str, Any] | None = None
    carried: Carried | None = None

    @property
    def network(self) -> Section:
        """Kind and parameters of the network, for `diagnose.networks.registry.build_model`."""
        return Section("model", self.model)

    @property
    def takes_each_channel(self) -> bool:
        """True if the network looks at every channel by itself, whatever their number."""
        return bool(self.model.get("each_channel", False))

    @property
    def n_channels(self) -> int:
        """Channels of an input of the network."""
        return 1 if self.takes_each_channel else len(self.channel_names)

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
    """Facts of a trained network for its description."""

    @property
    def protocol(self) -> str:
        """Split of the training."""

    @property
    def seed(self) -> int:
        """Seed of the training."""

    @property
    def best_epoch(self) -> int:
        """Epoch of the stored weights."""

    @property
    def domain(self) -> Domain | None:
        """Domain of the training windows."""

    @property
    def temperature(self) -> float:
        """Temperature of the probabilities."""


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
    facts = None
    if prediction.domain is not None:
        facts = prediction.domain.facts()
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
        n_teeth=common_teeth(task.dataset),
        n_teeth_range=teeth_range(task.dataset),
        out_of_distribution=facts,
        temperature=prediction.temperature,
        test_channel_names=None if tested == channels else tested,
        carried=carried_in(task, prediction.protocol),
    )


def save_model(
    folder: Path, weights: Mapping[str, np.ndarray], description: ModelDescription
) -> None:
    """Write both files into a new folder."""
    from safetensors.numpy import save_file

    folder.mkdir(parents=True, exist_ok=True)
    arrays = {name: np.ascontiguousarray(value) for name, value in weights.items()}
    save_file(arrays, folder / WEIGHTS)
    content = asdict(description)
    if description.carried is not None:
        content["carried"] = description.carried.content()
    text = json.dumps(content, indent=2) + "\n"
    (folder / DESCRIPTION).write_text(text, encoding="utf-8")


def load_model(folder: str | Path) -> tuple[Network, ModelDescription]:
    """Classifier in evaluation mode, and its description.

    Raises
    ------
    DatasetError    for a folder without the two files, another schema, a network of remaining
        lives, or weights that do not belong to the network
    """
    from diagnose.networks.registry import build_model

    folder = Path(folder)
    description = read_description(folder)
    if description.remaining_life is not None:
        raise DatasetError(
            f"{folder} says remaining lives and is no classifier: "
            "for diagnose predict, evaluate, export"
        )
    model = build_model(
        description.network,
        n_channels=description.n_channels,
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

    from diagnose.networks.domain import TENSOR

    weights = {
        name: torch.from_numpy(value)
        for name, value in tensors_of(folder).items()
        if name != TENSOR and not name.startswith(UNUSED)
    }
    try:
        model.load_state_dict(weights)
    except (RuntimeError, TypeError) as error:
        raise DatasetError(
            f"{folder / WEIGHTS} does not fit {DESCRIPTION}: {one_line(error)}"
        ) from None


def load_domain(folder: str | Path, description: ModelDescription) -> Domain | None:
    """Domain of the network of a folder; None for a model without one.

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


def tensors_of(folder: Path) -> dict[str, np.ndarray]:
    """All arrays of the file of weights, by their names."""
    from safetensors import SafetensorError
    from safetensors.numpy import load_file

    try:
        return load_file(folder / WEIGHTS)
    except FileNotFoundError:
        raise DatasetError(f"{folder} holds no {WEIGHTS}") from None
    except (SafetensorError, OSError, KeyError) as error:
        raise DatasetError(
            f"{folder / WEIGHTS} is not a safetensors file: {one_line(error)}"
        ) from None


def schema_version(dataset: Dataset) -> int | None:
    """Version of the data set's format; None if it has none."""
    version = dataset.attributes.get("schema_version")
    if version is None:
        return None
    return int(version)


def data_fingerprint(dataset: Dataset) -> str:
    """Hash over identity, label, unit and measured speed of every record."""
    digest = hashlib.sha256()
    for name in ("record_id", "unit_id", "label"):
        digest.update("\n".join(str(value) for value in dataset.column(name)).encode())
    digest.update(np.asarray(dataset.column("speed_rpm"), dtype="<f8").tobytes())
    return digest.hexdigest()


def read_description(folder: str | Path) -> ModelDescription:
    """Description of the network of a folder.

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
        return ModelDescription(**_typed(content))
    except FileNotFoundError:
        raise DatasetError(_no_model(folder)) from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DatasetError(
            f"{path} does not describe a model: {one_line(error)}"
        ) from None


def _no_model(folder: Path) -> str:
    """Message for a folder without a model, with the models below it."""
    if not folder.exists():
        return f"{folder} does not exist; give a folder that diagnose train wrote below models/"
    below = [*folder.glob(f"*/{DESCRIPTION}"), *folder.glob(f"models/*/{DESCRIPTION}")]
    models = sorted(str(file.parent) for file in below)
    text = f"{folder} holds no {DESCRIPTION}"
    if not models:
        return text
    listed = ", ".join(models[:SHOWN_MODELS])
    if len(models) > SHOWN_MODELS:
        listed += f" and {len(models) - SHOWN_MODELS} more"
    return f"{text}; choose one of its models: {listed}"


def _typed(content: Mapping[str, Any]) -> dict[str, Any]:
    """Values of ``model.json`` in the types of `ModelDescription`."""
    values = dict(content)
    values["sampling_rate_hz"] = float(values["sampling_rate_hz"])
    for name in ("window_samples", "stride_samples"):
        if not isinstance(values[name], int) or values[name] < 1:
            raise ValueError(f"{name} {values[name]!r} is no positive whole number")
    for name in ("class_names", "channel_names"):
        values[name] = tuple(map(str, values[name]))
    for name, convert in _OPTIONAL.items():
        if values.get(name) is not None:
            values[name] = convert(values[name])
    return values


def _range(values: Sequence[Any]) -> tuple[float, float]:
    low, high = values
    return float(low), float(high)


def _teeth(values: Sequence[Any]) -> tuple[int, int]:
    driving, driven = values
    return int(driving), int(driven)


def _teeth_range(values: Sequence[Any]) -> tuple[tuple[int, int], tuple[int, int]]:
    driving, driven = values
    return _teeth(driving), _teeth(driven)


_OPTIONAL: dict[str, Callable[[Any], Any]] = {
    "test_channel_names": lambda names: tuple(map(str, names)),
    "speed_rpm_range": _range,
    "n_teeth": _teeth,
    "n_teeth_range": _teeth_range,
    "out_of_distribution": dict,
    "adaptation": dict,
    "remaining_life": dict,
    "test_score": dict,
    "carried": carried_from,
}


def one_line(error: Exception) -> str:
    """Text of an error on one line, cut to 160 characters."""
    return " ".join(str(error).split())[:160]
