"""Data of a training: windows, turns, targets, protocols, and data sets for torch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from diagnose.data.torch_sets import StreamingDataset, VibrationDataset

__all__ = ["StreamingDataset", "VibrationDataset"]


def __getattr__(name: str) -> Any:
    """The data sets for torch, which is imported on their first use."""
    if name in __all__:
        from diagnose.data import torch_sets

        return getattr(torch_sets, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
