"""Center and spread of healthy features: within recordings, between them, between mountings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnose.detection.block_features import (
    BROADBAND,
    IMPULSES,
    MESH,
    SIDEBANDS,
    Feature,
)

FloatArray = NDArray[np.floating]

NORMAL = 1.4826  # standard deviation of a normal variable over its median magnitude
LEAST_SPREAD = 0.3  # dB, assumed: nothing repeats better than a calibration
# Assumed spreads between sessions, dB, of the order of simulated sessions that differ by 10 % in
# load and 20 dB in noise. They stand where few recordings show their own, and weigh as so many.
SESSION_SPREAD = {BROADBAND: 2.0, MESH: 1.5, SIDEBANDS: 2.0, IMPULSES: 1.5}
NOISE_SPREAD, ORDER_SPREAD, ENVELOPE_SPREAD = 5.0, 6.0, 3.0
TOOTH_SPREAD, KURTOSIS_SPREAD = 1.0, 0.4
# Between mountings, dB, assumed: a band may move by several, the shape of a turn hardly.
MOUNTING_SPREAD, MOUNTING_SHAPE_SPREAD = 4.0, 0.5
PRIOR_WEIGHT = 2.0
TOP_SHARE = 1.0 / 3.0  # of a group's features, those farthest off, that count


@dataclass(frozen=True, slots=True, kw_only=True)
class HealthySpread:
    """Healthy features of a machine.

    Attributes
    ----------
    center : (feature,)
    spread : (feature,) standard deviation, from the center, of a block of another session
    """

    center: FloatArray
    spread: FloatArray

    def deviations(self, values: FloatArray) -> FloatArray:
        """(block, feature) distance from the center in spreads."""
        return (values - self.center) / self.spread


def healthy_spread(
    recordings: Sequence[FloatArray],
    features: Sequence[Feature],
    mountings: Sequence[FloatArray] = (),
    *,
    is_remounted: bool = False,
) -> HealthySpread:
    """Center and spread of recordings (block, feature).

    Parameters
    ----------
    recordings : of the machine as it is mounted
    mountings : after the sensor was taken off and mounted again, one recording each
    is_remounted : True if a recording to judge may have another mounting

    Notes
    -----
    Variances add: of blocks about the median of their recording (by the median magnitude), of
    recordings about their center, of mountings about theirs. The latter two are estimated together
    with a prior of `PRIOR_WEIGHT` recordings: the mean of a scaled inverse chi-square posterior,
    Gelman et al. (2013), "Bayesian data analysis", section 2.6. The variance of the center adds to
    them.
    """
    everything = [*recordings, *mountings]
    within = np.concatenate([v - np.median(v, axis=0) for v in everything])
    total = np.square(NORMAL * np.median(np.abs(within), axis=0)) + LEAST_SPREAD**2
    medians = np.stack([np.median(values, axis=0) for values in recordings])
    center = medians.mean(axis=0)
    session = np.array([session_spread(feature) for feature in features])
    total = total + _variance(medians, center, session)
    if is_remounted:
        of_mountings = np.stack(
            [center, *(np.median(values, axis=0) for values in mountings)]
        )
        center = of_mountings.mean(axis=0)
        prior = np.where(
            [feature.is_level for feature in features],
            MOUNTING_SPREAD,
            MOUNTING_SHAPE_SPREAD,
        )
        total = total + _variance(of_mountings, center, prior)
    return HealthySpread(center=center, spread=np.sqrt(total))


def session_spread(feature: Feature) -> float:
    """Assumed spread of a feature between sessions, dB."""
    by_name = {
        "of the rest": NOISE_SPREAD,
        "order": ORDER_SPREAD,
        "envelope": ENVELOPE_SPREAD,
        "kurtosis": KURTOSIS_SPREAD,
    }
    if feature.group == IMPULSES:
        return SESSION_SPREAD[IMPULSES]
    for word, spread in by_name.items():
        if word in feature.name:
            return spread
    return SESSION_SPREAD.get(feature.group, TOOTH_SPREAD)


def group_distance(deviations: FloatArray) -> FloatArray:
    """(block,) root mean square of the largest third of a group's deviations (block, feature)."""
    squared = np.sort(np.square(deviations), axis=-1)[..., ::-1]
    n_top = max(int(np.ceil(TOP_SHARE * squared.shape[-1])), 1)
    return np.sqrt(squared[..., :n_top].mean(axis=-1))


def _variance(values: FloatArray, center: FloatArray, prior: FloatArray) -> FloatArray:
    """(feature,) variance of a further value from the center of values (recording, feature)."""
    n_known = len(values) - 1
    sums = np.square(values - center).sum(axis=0)
    variance = (PRIOR_WEIGHT * np.square(prior) + sums) / (PRIOR_WEIGHT + n_known)
    return variance * (1.0 + 1.0 / len(values))
