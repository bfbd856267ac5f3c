"""Stored networks: weights in ``model.safetensors``, description in ``model.json``, no pickle."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from diagnose.data.teeth import common_teeth, teeth_range
from diagnose.data.windows import Task, subset_segments
from diagnose.scoring.hours import LifeFacts
from diagnose.scoring.predictions import Prediction
from diagnose.settings import TrainSettings
from diagnose.training.carried import Carried, carried_from, carried_in
from diagnose.training.description_checks import OPTIONAL, REQUIRED, SCHEDULE
from diagnose.training.model_files import (
    DESCRIPTION,
    DIGEST,
    MODEL_SCHEMA_VERSION,
    one_line,
    read_content,
    tensors_of,
    write_files,
)
from diagnose.training.study_folder import refuse_unfinished
from gensig.errors import DatasetError
from gensig.options.configuration import Section

if TYPE_CHECKING:
    from torch import nn

    from diagnose.data.inputs import NetworkInput
    from diagnose.networks.domain import Domain
    from diagnose.networks.network import Network
    from gensig.dataset.reader import Dataset

Built = TypeVar("Built", bound="nn.Module")
# Task -> words on a network of another one.
OF_ANOTHER_TASK = {
    "classes": "says remaining lives and is no classifier: "
    "for diagnose predict, evaluate, export",
    "remaining_life": "is a classifier and says no remaining life: "
    "train with task=remaining_life",
}
SHOWN_MODELS = 12  # in an error message
MOST_VALUES = 2**26  # numbers of a layer for one input; 256 MiB


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
    test_score : see `diagnose.studies.protocol_results.test_score`; None in older models
    remaining_life : None for a classifier
    carried : blocks of recordings that carried implants; None for a network of any other data set,
        and in older models
    files : name -> size and sha256 of the files beside ``model.json``; None in older models
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
    remaining_life: LifeFacts | None = None
    carried: Carried | None = None
    files: dict[str, dict[str, Any]] | None = None

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

    @property
    def is_signed(self) -> bool:
        """True if the folder can be told from a damaged one by its digests."""
        return self.files is not None


def model_description(
    task: Task, settings: TrainSettings, run: Prediction
) -> ModelDescription:
    """Description of the network behind answers."""
    trained_on = subset_segments(task, run.protocol, "train").record
    channels, tested = (
        task.part(run.protocol, subset).channel_names for subset in ("train", "test")
    )
    speed = np.asarray(task.dataset.column("speed_rpm"), dtype=float)[trained_on]
    facts = None
    if run.domain is not None:
        facts = run.domain.facts()
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
        protocol=run.protocol,
        seed=run.seed,
        best_epoch=run.best_epoch,
        n_bootstrap=settings.n_bootstrap,
        speed_rpm_range=(float(speed.min()), float(speed.max())),
        n_teeth=common_teeth(task.dataset),
        n_teeth_range=teeth_range(task.dataset),
        out_of_distribution=facts,
        temperature=run.temperature,
        test_channel_names=None if tested == channels else tested,
        remaining_life=run.hours,
        carried=carried_in(task, run.protocol),
    )


def save_model(
    folder: Path,
    weights: Mapping[str, np.ndarray],
    description: ModelDescription,
    beside: Mapping[str, str] = MappingProxyType({}),
) -> None:
    """Write both files into a folder, with their digests, and texts ``beside`` by their names."""
    content = asdict(description)
    if description.carried is not None:
        content["carried"] = description.carried.content()
    write_files(folder, weights, content, beside)


def load_model(folder: str | Path) -> tuple[Network, ModelDescription]:
    """Classifier in evaluation mode, and its description; errors as `load_network`."""
    from diagnose.networks.registry import build_model

    def build(description: ModelDescription) -> Network:
        return build_model(
            description.network,
            n_channels=description.n_channels,
            n_classes=len(description.class_names),
        )

    return load_network(folder, "classes", build)


def load_network(
    folder: str | Path, task: str, build: Callable[[ModelDescription], Built]
) -> tuple[Built, ModelDescription]:
    """Network in evaluation mode, and its description.

    It is built without memory first, so that absurd sizes are refused before they are allocated.

    Parameters
    ----------
    task : of the training, one of `diagnose.settings.TASKS`
    build : network of a description, whose weights do not matter

    Raises
    ------
    DatasetError    for a folder without the two files, another schema, a network of another task,
        or weights that are damaged or do not belong to the network
    ConfigError     for parameters that no network takes
    """
    import torch

    from diagnose.networks.registry import input_of

    folder = Path(folder)
    description = read_description(folder)
    if description.task != task:
        raise DatasetError(f"{folder} {OF_ANOTHER_TASK[task]}")
    with torch.device("meta"):
        planned = build(description).state_dict()
    expected = {
        name: (str(value.dtype).removeprefix("torch."), tuple(value.shape))
        for name, value in planned.items()
    }
    tensors = tensors_of(folder, expected)
    model = build(description)
    model.load_state_dict({name: torch.from_numpy(tensors[name]) for name in expected})
    check_answers(model.eval(), input_of, description, folder)
    return model, description


def check_answers(
    model: nn.Module,
    read_input: Callable[[Section], NetworkInput],
    description: ModelDescription,
    folder: Path,
) -> None:
    """Try a network on a silent input, whose values it must take.

    Parameters
    ----------
    read_input : kind of input of the parameters of a network

    Raises
    ------
    DatasetError    for a network that takes no such input, of too much memory, or whose answers
        are not finite
    """
    import torch

    try:
        inputs = read_input(description.network)
        single = inputs.example(1, description.window_samples)
        largest = max([1, *_whole_numbers(description.model)])
        if single.size * max(description.n_channels, largest) > MOST_VALUES:
            raise ValueError(f"a window takes more than {MOST_VALUES} numbers")
        example = inputs.example(description.n_channels, description.window_samples)
        given = [torch.from_numpy(example)]
        if description.remaining_life is not None:
            given.append(torch.zeros(1, len(description.remaining_life.told)))
        with torch.inference_mode():
            answer = model(*given)
        is_usable = len(answer) == 1 and bool(torch.isfinite(answer).all())
    except Exception as error:  # torch raises whatever stopped it
        raise DatasetError(
            f"{folder / DESCRIPTION} describes a network that takes no input: {one_line(error)}"
        ) from None
    if not is_usable:
        raise DatasetError(
            f"{folder} answers numbers that are not finite to a silent input; the model is "
            "damaged: restore it or train it again"
        )


def _whole_numbers(parameters: Mapping[str, Any]) -> Iterator[int]:
    """Whole numbers of a network's parameters, but for its schedule."""
    for key, value in parameters.items():
        if key == SCHEDULE:
            continue
        for entry in value if isinstance(value, list) else (value,):
            if type(entry) is int:
                yield entry


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
    DatasetError    for a folder without such a file, also where it is that of a study which is not
        finished, or another schema
    """
    folder = Path(folder)
    path = folder / DESCRIPTION
    if not os.path.lexists(path):
        for study in (folder, *folder.parents[:2]):
            refuse_unfinished(study)
        raise DatasetError(_no_model(folder))
    content = read_content(folder)
    content.pop(DIGEST, None)
    try:
        return ModelDescription(**_typed(content))
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        kind = " of remaining lives" if content.get("remaining_life") else ""
        raise DatasetError(
            f"{path} does not describe a model{kind}: {one_line(error)}"
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
    for name, reader in REQUIRED.items():
        values[name] = reader(name, values[name])
    for name, reader in OPTIONAL.items():
        if values.get(name) is not None:
            values[name] = reader(name, values[name])
    if values.get("temperature", 1.0) is None:
        raise ValueError("temperature is null")
    if values.get("carried") is not None:
        values["carried"] = carried_from(values["carried"])
    return values
