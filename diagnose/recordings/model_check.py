"""Verification that a stored network is whole and unaltered; nothing is repaired."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from diagnose.recordings.registry import open_network
from diagnose.training.model_files import (
    DESCRIPTION,
    DIGEST,
    NOT_SIGNED,
    WEIGHTS,
    altered_text,
    facts_of,
)
from diagnose.training.store import ModelDescription, load_domain, read_description
from diagnose.training.study_folder import refuse_unfinished
from gensig.errors import DatasetError, GensigError

MOST_MODELS = 10_000


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelCheck:
    """Result of `check_model`.

    Attributes
    ----------
    folder : of the model
    problems : one line each; empty exactly for a model that may answer
    notes : one line each, on what could not be checked
    n_files : files whose sha256 was compared, that of the description included
    n_weights : numbers of the network
    """

    folder: Path
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    n_files: int = 0
    n_weights: int = 0

    def content(self) -> dict[str, Any]:
        """Plain values for ``diagnose verify --json``."""
        return {
            "model": str(self.folder),
            "complete": not self.problems,
            "problems": list(self.problems),
            "notes": list(self.notes),
            "n_files": self.n_files,
            "n_weights": self.n_weights,
        }


def models_in(folder: Path) -> list[Path]:
    """The model of a folder, or the models of a study below it.

    Raises
    ------
    DatasetError    for a folder without any, and for a study that is not finished
    """
    if os.path.lexists(folder / DESCRIPTION):
        return [folder]
    refuse_unfinished(folder)
    below = folder / "models"
    parent = below if below.is_dir() else folder
    models = []
    if parent.is_dir():
        models = [path for path in sorted(parent.iterdir()) if _is_model(path)]
    if not models:
        read_description(folder)  # says which folders to give
    if len(models) > MOST_MODELS:
        raise DatasetError(
            f"{folder} holds {len(models)} models, at most {MOST_MODELS} are verified at once"
        )
    return models


def _is_model(path: Path) -> bool:
    return any(os.path.lexists(path / name) for name in (DESCRIPTION, WEIGHTS))


def check_model(folder: Path) -> ModelCheck:
    """Check sha256 of every file, types, shapes and finiteness, and an answer to silence."""
    if folder.is_symlink():
        return ModelCheck(
            folder=folder,
            problems=(f"{folder} is a symbolic link; put the folder in its place",),
        )
    try:
        description = read_description(folder)
    except GensigError as error:
        return ModelCheck(folder=folder, problems=(str(error),))
    problems = list(_altered(folder, description))
    n_weights = 0
    if not problems:
        try:
            network = open_network(folder)
            load_domain(folder, description)
            n_weights = sum(value.numel() for value in network.model.parameters())
        except GensigError as error:
            problems.append(str(error))
    notes: tuple[str, ...] = ()
    n_files = 1 + len(description.files or ())
    if not description.is_signed:
        notes, n_files = (f"{folder} {NOT_SIGNED}",), 0
    return ModelCheck(
        folder=folder,
        problems=tuple(problems),
        notes=notes,
        n_files=n_files,
        n_weights=n_weights,
    )


def _altered(folder: Path, description: ModelDescription) -> Iterator[str]:
    """A line for each file that is not as listed, and for each that no one listed."""
    if description.files is None:
        return
    for name, recorded in description.files.items():
        try:
            found = facts_of(folder / name)
        except GensigError as error:
            yield str(error)
            continue
        if found["bytes"] != recorded["bytes"]:
            yield (
                f"{folder / name} was altered: it has {found['bytes']} bytes, {DESCRIPTION} says "
                f"{recorded['bytes']}"
            )
        elif found[DIGEST] != recorded[DIGEST]:
            yield altered_text(folder / name)
    listed = {DESCRIPTION, *description.files}
    for path in sorted(folder.iterdir()):
        if path.name not in listed and not path.name.startswith("."):
            yield f"{path} is not listed in {DESCRIPTION}; move it out of the folder"
