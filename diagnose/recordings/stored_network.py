"""A trained network of a folder, as prediction, evaluation and export use it: the interface."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from diagnose.networks.registry import input_of
from gensig.errors import DatasetError

if TYPE_CHECKING:
    import torch
    from torch import nn

    from diagnose.data.inputs import NetworkInput
    from diagnose.data.windows import Segments, Task
    from diagnose.recordings.prepared import PreparedRecording
    from diagnose.recordings.source import Source
    from diagnose.training.store import ModelDescription
    from gensig.dataset.reader import Dataset


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """Answer for a recording, as parts of what ``diagnose predict --json`` prints.

    Attributes
    ----------
    record : of the whole recording
    windows : of each window
    conditions : speed and others at which it was made
    training : what the network was trained on
    reasons : why the recording is unlike the training data, beside its spectrum, speed and teeth
    """

    record: Mapping[str, Any]
    windows: list[dict[str, Any]]
    conditions: Mapping[str, Any]
    training: Mapping[str, Any]
    reasons: list[str] = field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scores:
    """Scores of a network, as parts of ``metrics.json`` of an evaluation.

    Attributes
    ----------
    counts : records and machines judged
    method : of a study whose methods differ
    values : scores with their intervals
    write : writes what stands beside ``metrics.json`` into a folder, given that file's content
    """

    counts: Mapping[str, int]
    method: Mapping[str, str]
    values: Mapping[str, Any]
    write: Callable[[Path, dict[str, Any]], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Graph:
    """A network as a graph from m/s^2 to its answer.

    Attributes
    ----------
    answer : answer of a network for normalised windows and further inputs
    further : name -> (window, ...) examples of inputs beside the windows
    output : name of the output
    unit : that the answer is multiplied by in the graph
    unit_text : the same in words
    agreement : of the file with torch, in words with a place for the difference
    facts : metadata of the file
    """

    answer: Callable[..., torch.Tensor]
    further: Mapping[str, NDArray[np.float32]]
    output: str
    unit: float
    unit_text: str
    agreement: str
    facts: Mapping[str, Any]


class StoredNetwork(ABC):
    """A trained network with its description.

    Attributes
    ----------
    model : in evaluation mode
    description : of its training
    """

    model: nn.Module
    description: ModelDescription

    @classmethod
    @abstractmethod
    def load(cls, folder: str | Path) -> Self:
        """Network of a folder that ``diagnose train`` wrote.

        Raises
        ------
        DatasetError    for a folder that holds no such network
        """

    def inputs(self) -> NetworkInput:
        """Kind of input that the network reads."""
        return input_of(self.description.network)

    @abstractmethod
    def check(self, source: Source) -> None:
        """Refuse a recording of which too little is known, or more than the network takes.

        Raises
        ------
        ConfigError    with the option to give or to leave out
        """

    @abstractmethod
    def answer(self, source: Source, prepared: PreparedRecording) -> Answer:
        """Answer for a recording and its windows."""

    @abstractmethod
    def line(self, result: Mapping[str, Any]) -> str:
        """Line for people of what ``diagnose predict --json`` prints."""

    @abstractmethod
    def classes_of(self, dataset: Dataset) -> tuple[str, ...]:
        """Classes of a data set that the network is judged on.

        Raises
        ------
        DatasetError    if they do not fit the network
        """

    @abstractmethod
    def scores(self, task: Task, segments: Segments, part: str) -> Scores:
        """Scores on stretches of a data set, the ``part`` in words."""

    @abstractmethod
    def lines(self, result: Mapping[str, Any]) -> list[str]:
        """Lines for people of an evaluation's ``metrics.json``."""

    @abstractmethod
    def graph(self) -> Graph:
        """The network as a graph, for other programs."""


def reliance(result: Mapping[str, Any], answer: str) -> str:
    """Words on how far an answer of `StoredNetwork.line` can be relied on."""
    if result["out_of_distribution"]:
        reasons = "; ".join(result["reasons"])
        return f"OUT OF DISTRIBUTION, do not rely on {answer}: {reasons}"
    beyond, n_windows = result["n_windows_beyond"], result["n_windows"]
    return f"like the training data ({beyond} of {n_windows} windows beyond it)"


def require_finite(**answers: NDArray[np.floating]) -> None:
    """Refuse answers of a network that are not finite, which no one may be told.

    Raises
    ------
    DatasetError    naming the answer
    """
    for name, values in answers.items():
        n_wrong = int(np.size(values) - np.isfinite(values).sum())
        if n_wrong:
            raise DatasetError(
                f"the model gives no answer: {n_wrong} of {np.size(values)} values of its "
                f"{name} are not finite; look at it with diagnose verify MODEL, and at the "
                "recording"
            )
