"""Means of features of windows over each stretch of signal."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from diagnose.baselines.features import FeatureTable
from diagnose.data.windows import FloatArray, WindowSet

BLOCK = 16  # windows at once, so that they stay in the cache of a processor


def over_stretches(
    windows: WindowSet,
    features: Callable[[NDArray[np.float32]], FloatArray],
    name: str,
) -> FeatureTable:
    """Table with one row a stretch.

    Parameters
    ----------
    windows : of one subset
    features : returns (window, feature) of windows (window, channel, sample)
    name : of the columns, before their number
    """
    stretch, first, position = np.unique(
        windows.segment, return_index=True, return_inverse=True
    )
    total = np.zeros((stretch.size, 0))
    for block in windows.blocks(BLOCK):
        values = features(windows.cut(block))
        if not total.size:
            total = np.zeros((stretch.size, values.shape[1]))
        np.add.at(total, position[block], values)
    return FeatureTable(
        values=total / np.bincount(position)[:, None],
        names=tuple(f"{name}_{index}" for index in range(total.shape[1])),
        label=windows.label[first],
        record=windows.record[first],
    )
