"""Stored networks by what they learned: each answers, is judged and is exported in its own way.

One comes with gensig: that for any pair of gears.
"""

from __future__ import annotations

from importlib.resources import files
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


def shipped_network() -> Path:
    """Folder of the network for any pair of gears, which comes with gensig."""
    return Path(str(files("diagnose"))) / "shipped" / "any_pair"


def open_network(folder: str | Path) -> StoredNetwork:
    """Network of a folder that ``diagnose train`` wrote.

    Raises
    ------
    DatasetError    for a folder without description and weights that belong together
    """
    return STORED[read_description(folder).task].load(folder)
