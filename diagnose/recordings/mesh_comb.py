"""Harmonics of the mesh of a recording, near a stated mesh frequency and elsewhere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gensig.signals.resampling import PASS_SHARE

FloatArray = NDArray[np.floating]

# of the slower gear, in a segment of the spectrum: its sidebands are resolved from the mesh
TURNS_A_SEGMENT = 4
FINER_SPECTRUM = 4  # bins of the padded spectrum for one of a segment
FLOOR_WIDTH = 4  # orders of the slower gear, whose median is the floor of a line
MOST_HARMONICS = 10  # of the stated mesh frequency
FINE = 0.25  # candidates lie this share of a bin apart at the highest harmonic
NEAR = 0.03  # share of the stated mesh frequency that counts as stated
SEARCH = (0.45, 2.2)  # multiples of the stated mesh frequency that are looked at


@dataclass(frozen=True, slots=True, kw_only=True)
class MeshComb:
    """Harmonics near a stated mesh frequency, and those of the best other one.

    Attributes
    ----------
    near, elsewhere : decades by which all harmonics together stand above their surroundings, over
        what a line of the same spectrum has in the mean and one standard deviation
    near_frequency, elsewhere_frequency : Hz, the mesh frequencies of these harmonics
    """

    near: float
    near_frequency: float
    elsewhere: float
    elsewhere_frequency: float


def mesh_comb(
    signal: ArrayLike, sampling_rate: float, mesh_frequency: float, n_teeth: int
) -> MeshComb:
    """Compare the harmonics of a stated mesh frequency with those of all others nearby.

    Parameters
    ----------
    signal : (channel, sample)    a line counts at the channel where it stands out most
    sampling_rate : Hz
    mesh_frequency : Hz    as stated
    n_teeth : of the gear with more teeth

    Notes
    -----
    Every harmonic up to a common frequency counts, less what any line has. A half of the true mesh
    frequency therefore gains nothing by the lines between, and twice of it loses half.
    """
    x = np.asarray(signal, dtype=float)
    highest = min(PASS_SHARE * sampling_rate, MOST_HARMONICS * mesh_frequency)
    frequency, decades = line_decades(
        x, sampling_rate, n_teeth / mesh_frequency, highest
    )
    step = FINE / (MOST_HARMONICS * TURNS_A_SEGMENT * n_teeth)
    share = np.arange(SEARCH[0], SEARCH[1], step)
    candidates = share * mesh_frequency
    total = np.zeros(candidates.size)
    for harmonic in range(1, int(highest / candidates[0]) + 1):
        at = harmonic * candidates
        inside = at <= highest
        total[inside] += np.interp(at[inside], frequency, decades)
    is_near = np.abs(share - 1.0) <= NEAR
    near = int(np.where(is_near, total, -np.inf).argmax())
    elsewhere = int(np.where(is_near, -np.inf, total).argmax())
    return MeshComb(
        near=float(total[near]),
        near_frequency=float(candidates[near]),
        elsewhere=float(total[elsewhere]),
        elsewhere_frequency=float(candidates[elsewhere]),
    )


def line_decades(
    x: FloatArray, sampling_rate: float, slow_turn: float, highest: float
) -> tuple[FloatArray, FloatArray]:
    """Frequencies up to the highest, Hz, and decades of each line over a usual one.

    ``slow_turn`` is the duration of a turn of the slower gear, s.
    """
    from scipy.ndimage import median_filter
    from scipy.signal import welch

    n_samples = x.shape[-1]
    length = min(n_samples, round(TURNS_A_SEGMENT * slow_turn * sampling_rate))
    frequency, density = welch(
        x,
        sampling_rate,
        nperseg=length,
        noverlap=length // 2,
        nfft=FINER_SPECTRUM * length,
        axis=-1,
    )
    inside = (frequency > 0.0) & (frequency <= highest)
    frequency, density = frequency[inside], density[:, inside]
    width = FLOOR_WIDTH * TURNS_A_SEGMENT * FINER_SPECTRUM + 1
    floor = median_filter(density, size=(1, width), mode="nearest")
    tiny = np.finfo(float).tiny
    standing = np.max(density / np.maximum(floor, tiny), axis=0)
    decades = np.log10(np.maximum(standing, 1.0))
    return frequency, decades - decades.mean() - decades.std()
