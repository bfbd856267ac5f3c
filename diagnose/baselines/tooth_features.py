"""Teeth that their sisters do not explain, as features of a stretch of signal.

Errors of healthy teeth differ in size and little in shape: pitch and profile errors excite a
machine in few ways. A damaged tooth excites it in another way.
"""

from __future__ import annotations

import itertools

import numpy as np

from diagnose.data.windows import FloatArray
from gensig.signals.unexplained_teeth import UnexplainedTeeth, unexplained_teeth

# Orders of the mesh between the bands; the turns hold 32.
EDGES = (0.25, 1.5, 3.0, 6.0, 11.0, 18.0, 32.0)
N_PLACES = 4  # parts of a passage
NEIGHBORS = (-1, 0, 1, 2)  # a fault shows from before its tooth is in mesh until after
FLOOR = 1e-12  # of the mean square, so that silence has a finite level
TINY = 1e-300

LEVELS = (
    *(f"band_{index}" for index in range(len(EDGES) - 1)),
    *(f"place_{index}" for index in range(N_PLACES)),
)
SUMMARY = ("first", "second", "third", "spread", "median")


def _names() -> tuple[str, ...]:
    """Names of the features of one gear, in the order of `_gear_features`."""
    at_teeth = [f"tooth{offset:+d}" for offset in NEIGHBORS]
    of_levels = ["/".join(pair) for pair in itertools.product(LEVELS, at_teeth)]
    return (
        *(f"distance/{tooth}" for tooth in at_teeth),
        *(f"distance/{name}" for name in SUMMARY),
        *(f"rest/{name}" for name in of_levels),
        *(f"rest/{name}/above_median" for name in LEVELS),
        *(f"rest/{name}/largest" for name in LEVELS),
        *(f"tooth/{name}" for name in of_levels),
        *(f"share/{name}" for name in LEVELS),
    )


GEAR_FEATURES = _names()


def tooth_features(driving: FloatArray, driven: FloatArray) -> FloatArray:
    """Features of both gears, `GEAR_FEATURES` of the driving one first.

    They do not depend on the level of any channel, nor on the tooth that passes first.

    Parameters
    ----------
    driving, driven : see `unexplained_teeth`; teeth that never passed are 0

    Returns
    -------
    (feature,) NaN for a gear with fewer teeth that passed than `GEAR_FEATURES` need
    """
    driven = driven[:, np.any(driven != 0, axis=(0, 2))]
    if driving.shape[1] <= len(NEIGHBORS) or driven.shape[1] <= len(NEIGHBORS):
        return np.full(2 * len(GEAR_FEATURES), np.nan)
    level = np.sqrt(
        np.mean(np.square(np.concatenate([driving, driven], axis=1)), axis=(1, 2))
    )
    factor = np.divide(1, level, out=np.zeros_like(level), where=level > 0)[
        :, None, None
    ]
    gears = unexplained_teeth(driving * factor, driven * factor)
    return np.concatenate([_gear_features(gear) for gear in gears])


def _gear_features(gear: UnexplainedTeeth) -> FloatArray:
    """(feature,) of the tooth that is farthest from its sisters, and of the gear."""
    distance = np.log(gear.distance + FLOOR * gear.distance.mean() + TINY)
    farthest = int(distance.argmax())
    near = (farthest + np.array(NEIGHBORS)) % distance.size
    median = float(np.median(distance))
    third, second, first = np.sort(distance)[-3:] - median
    rest, turn = levels_of_teeth(gear.rest), levels_of_teeth(gear.turn)
    of_rest = _standardised(rest)
    above = rest[:, farthest] - np.median(rest, axis=-1)
    return np.concatenate(
        [
            _standardised(distance)[near],
            [first, second, third, distance.std(), median],
            of_rest[:, near].ravel(),
            above,
            of_rest.max(axis=-1),
            _standardised(turn)[:, near].ravel(),
            (rest - turn)[:, farthest],
        ]
    )


def levels_of_teeth(turn: FloatArray) -> FloatArray:
    """(level, tooth) of `LEVELS`: log mean squares, mean over the channels."""
    n_channels, n_teeth, n_samples = turn.shape
    whole = turn.reshape(n_channels, -1)
    spectrum = np.fft.rfft(whole, axis=-1)
    order = np.arange(spectrum.shape[-1]) / n_teeth
    powers = []
    for low, high in itertools.pairwise(EDGES):
        passed = spectrum * ((order >= low) & (order < high))
        band = np.fft.irfft(passed, n=whole.shape[-1], axis=-1).reshape(turn.shape)
        powers.append(np.square(band).mean(axis=-1))
    parts = turn.reshape(n_channels, n_teeth, N_PLACES, n_samples // N_PLACES)
    powers += [*np.moveaxis(np.square(parts).mean(axis=-1), -1, 0)]
    power = np.stack(powers)
    least = FLOOR * power.mean(axis=-1, keepdims=True) + TINY
    return np.log(power + least).mean(axis=1)


def _standardised(levels: FloatArray) -> FloatArray:
    """(..., tooth) less the mean of the teeth, over their standard deviation; 0 without any."""
    centered = levels - levels.mean(axis=-1, keepdims=True)
    spread = levels.std(axis=-1, keepdims=True)
    return np.divide(centered, spread, out=np.zeros_like(centered), where=spread > 0)
