"""Stored networks by what they learned: each answers, is judged and is exported in its own way."""

from __future__ import annotations

from pathlib import Path

from diagnose.recordings.stored_classifier import StoredClassifier
from diagnose.recordings.stored_life import StoredLife
from diagnose.recordings.stored_network import StoredNetwork
from diagnose.training.store import read_description

# Task of the training, see `diagnose.settings.TASKS` -> the network as it is stored.
STORED: dict[str, type[StoredNetwork]] = {
    "classes": StoredClassifier,
    "remaining_life": StoredLife,
}


def open_network(folder: str | Path) -> StoredNetwork:
    """Network of a folder that ``diagnose train`` wrote.

    Raises
    ------
    DatasetError    for a folder without description and weights that belong together
    """
    return STORED[read_description(folder).task].load(folder)
