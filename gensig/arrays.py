"""Types of arrays, by their numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]
FloatArray = NDArray[np.floating]
Integers = NDArray[np.int64]
