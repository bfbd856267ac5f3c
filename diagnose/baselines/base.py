"""Interface of baselines: fit, probabilities, input, and texts of the page."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.features import Cache, FeatureTable
from diagnose.data.windows import (
    SUBSETS,
    FloatArray,
    Segments,
    Task,
    WindowSet,
    subset_segments,
    subsets_of,
)


class Role(Enum):
    """Purpose of a baseline; it decides when it runs and in which table of the page it is.

    A rival runs if the key `baselines` names it, AT_CHANCE and FOLLOWER with
    ``metadata_probe=true``, BOUND with ``oracle=auto``.
    """

    RIVAL = "the network must beat it"
    AT_CHANCE = "it must be at chance, else something leaks"
    FOLLOWER = "it is at chance unless faults change its input"
    BOUND = "its input tells more than the network's"


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodText:
    """Name and words of a method.

    Attributes
    ----------
    name : key in ``metrics.json`` and in the setting `baselines`
    label : short name on the page
    meaning : sentence of the report
    card_label : short name on the cards of the page; None for a method that they do not mention
    """

    name: str
    label: str
    meaning: str
    card_label: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """Data of one protocol, from which inputs are made.

    Attributes
    ----------
    task, protocol : records, labels and split
    features : key of `diagnose.baselines.features.FEATURES`
    windows : returns the windows of each subset
    caches : by name of the input, filled and used, so that protocols share common values
    """

    task: Task
    protocol: str
    features: str
    windows: Callable[[], Mapping[str, WindowSet]]
    caches: dict[str, Cache]

    @property
    def subsets(self) -> tuple[str, ...]:
        """Subsets of the protocol, and the references of its validation machines if any."""
        return subsets_of(self.task, self.protocol)

    def part(self, subset: str) -> Task:
        """The task with the channels of a subset."""
        return self.task.part(self.protocol, subset)

    def segments(self, subset: str) -> Segments:
        """Stretches of records of a subset."""
        return subset_segments(self.task, self.protocol, subset)

    def tables(
        self,
        name: str,
        table: Callable[[Task, Segments, Cache], FeatureTable],
        subsets: Iterable[str] = SUBSETS,
    ) -> Parts:
        """Tables of the stretches of subsets, with the cache of a name."""
        cache = self.caches.setdefault(name, {})
        return Parts.of(
            lambda subset: table(self.part(subset), self.segments(subset), cache),
            subsets,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """Tables of the three subsets, with the same columns.

    ``references`` are those of the validation machines, None without any or where a baseline cannot
    judge them.
    """

    train: FeatureTable
    validation: FeatureTable
    test: FeatureTable
    references: FeatureTable | None = None

    @classmethod
    def of(
        cls, table: Callable[[str], FeatureTable], subsets: Iterable[str] = SUBSETS
    ) -> Parts:
        """Tables that a function makes for each subset."""
        return cls(**{subset: table(subset) for subset in subsets})

    def judged(self) -> FeatureTable:
        """Validation, reference and test rows.

        Test rows alone if a record is in validation too, as in a leaky split.
        """
        if np.isin(self.validation.record, self.test.record).any():
            return self.test
        parts = (self.validation, self.references, self.test)
        judged = [table for table in parts if table is not None]
        return FeatureTable(
            values=np.concatenate([table.values for table in judged]),
            names=self.test.names,
            label=np.concatenate([table.label for table in judged]),
            record=np.concatenate([table.record for table in judged]),
        )


def always_made(task: Task, protocol: str) -> str | None:
    """None: an input that every data set has."""
    return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Input:
    """Kind of tables that baselines read; a study makes each once a protocol.

    Attributes
    ----------
    name : for the caches
    make : returns the tables of a protocol
    why_not : returns the reason in one line why a task has no such tables of a protocol, or None;
        a study leaves the baseline out there
    """

    name: str
    make: Callable[[Source], Parts]
    why_not: Callable[[Task, str], str | None] = always_made


class Baseline(ABC):
    """Method that is fitted to a table: stretches of signal or records in rows.

    Every subclass is one entry of `diagnose.baselines.registry.BASELINES`. An object is fitted
    once. No estimate may depend on the order of the rows, nor on anything random but a fixed seed.
    """

    text: ClassVar[MethodText]
    role: ClassVar[Role]
    reads: ClassVar[Input]

    @abstractmethod
    def fit(self, train: FeatureTable, validation: FeatureTable, n_classes: int) -> str:
        """Fit to the training rows; choices are made on the validation rows.

        Returns
        -------
        description of the fit
        """

    @abstractmethod
    def predict_proba(self, table: FeatureTable) -> FloatArray:
        """Probabilities (row, class), each row with sum 1."""


class StorableBaseline(Baseline):
    """Baseline that is stored as arrays, which `diagnose.recordings` reads."""

    @abstractmethod
    def tensors(self) -> dict[str, NDArray[np.float32]]:
        """Name -> array of the fit."""

    @classmethod
    @abstractmethod
    def description(cls, task: Task) -> dict[str, Any]:
        """Kind and parameters, `model` of ``model.json``."""
