"""Share of faults found against their size.

A curve through hits and misses, and where it passes 50 and 90 %.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.floating]
SHARES = (0.5, 0.9)
LEAST_RECORDS = 10  # of a class, below which no curve is drawn
LEAST_SIZES = 3
PRIOR_SCALE = (
    5.0  # of both coefficients, per standard deviation of the log size; assumed, weak
)
N_STEPS = 30


def fit_curves(size: FloatArray, found: FloatArray, weight: FloatArray) -> FloatArray:
    """Logistic curves of the share found over the logarithm of the size, (resample, 2) intercept
    and slope.

    The log size is taken less its mean and over its standard deviation. A normal prior of
    standard deviation 5 on both coefficients keeps curves finite where sizes part what is found
    from what is not. A falling curve is replaced by a level one: a fault does not become harder
    to find as it grows.

    Parameters
    ----------
    size : (record,) > 0, of at least two values
    found : (resample, record) share of the trainings that find each record, 0 to 1
    weight : (resample, record) how often each record was drawn

    Source: hit/miss model with logit link over log size of MIL-HDBK-1823A (2009), "Nondestructive
    evaluation system reliability assessment", appendix G; Newton steps as for any logistic
    regression. The prior is ours. Written here, not taken from scikit-learn, because thousands of
    resamples are fitted at once.
    """
    from scipy.special import expit

    scaled = _scaled(size, size)
    coefficients = np.zeros((len(weight), 2))
    for _ in range(N_STEPS):
        share = expit(coefficients[:, :1] + coefficients[:, 1:] * scaled)
        excess = weight * (found - share)
        gradient = (
            np.stack([excess.sum(axis=1), excess @ scaled], axis=1)
            - coefficients / PRIOR_SCALE**2
        )
        spread = weight * share * (1 - share)
        cross = spread @ scaled
        curvature = np.stack(
            [
                np.stack([spread.sum(axis=1), cross], axis=1),
                np.stack([cross, spread @ scaled**2], axis=1),
            ],
            axis=1,
        )
        curvature += np.eye(2) / PRIOR_SCALE**2
        coefficients += np.clip(
            np.linalg.solve(curvature, gradient[..., None])[..., 0], -2.0, 2.0
        )
    falling = coefficients[:, 1] < 0
    total = np.maximum(weight.sum(axis=1), 1e-12)
    level = np.clip((weight * found).sum(axis=1) / total, 1e-6, 1 - 1e-6)
    coefficients[falling, 0] = np.log(level / (1 - level))[falling]
    coefficients[falling, 1] = 0.0
    return coefficients


def curve_at(coefficients: FloatArray, at: FloatArray, size: FloatArray) -> FloatArray:
    """(resample, point) share found at sizes `at`, of curves fitted to the sizes `size`."""
    from scipy.special import expit

    return expit(coefficients[:, :1] + coefficients[:, 1:] * _scaled(at, size))


def limits(coefficients: FloatArray, size: FloatArray, share: float) -> FloatArray:
    """(resample,) smallest size within those tested from which a share is found.

    The smallest size tested where all of them are found as often, infinite where none of them is:
    nothing is said of sizes that were not tested.
    """
    ends = curve_at(coefficients, np.array([size.min(), size.max()]), size)
    rising = np.maximum(coefficients[:, 1], 1e-12)
    log_size = np.log(size)
    crossing = np.exp(
        np.clip((np.log(share / (1 - share)) - coefficients[:, 0]) / rising, -50, 50)
        * log_size.std()
        + log_size.mean()
    )
    inside = np.clip(crossing, size.min(), size.max())
    return np.where(
        ends[:, 1] < share, np.inf, np.where(ends[:, 0] >= share, size.min(), inside)
    )


def _scaled(values: FloatArray, size: FloatArray) -> FloatArray:
    log_size = np.log(size)
    return (np.log(values) - log_size.mean()) / log_size.std()
