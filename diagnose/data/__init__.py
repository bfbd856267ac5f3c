"""Data of a training: windows, turns, targets, protocols, and data sets for torch."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from diagnose.data.loading.data_module import VibrationDataModule
    from diagnose.data.loading.replay import ReplayStream
    from diagnose.data.loading.stored import VibrationDataset
    from diagnose.data.loading.streamed import StreamingDataset
    from diagnose.data.loading.transforms import (
        AddNoise,
        ChooseChannels,
        Compose,
        DropChannels,
        Gain,
        Resample,
        Shift,
    )

__all__ = [
    "AddNoise",
    "ChooseChannels",
    "Compose",
    "DropChannels",
    "Gain",
    "ReplayStream",
    "Resample",
    "Shift",
    "StreamingDataset",
    "VibrationDataModule",
    "VibrationDataset",
]

# Modules of the names that are not transforms.
_MODULES = {
    "ReplayStream": "diagnose.data.loading.replay",
    "StreamingDataset": "diagnose.data.loading.streamed",
    "VibrationDataModule": "diagnose.data.loading.data_module",
    "VibrationDataset": "diagnose.data.loading.stored",
}


def __getattr__(name: str) -> Any:
    """The data sets for torch, which is imported on their first use."""
    if name in __all__:
        module = _MODULES.get(name, "diagnose.data.loading.transforms")
        return getattr(import_module(module), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
