"""Share of detected faults against their size: a fitted curve, and its 50 and 90 % points."""

from __future__ import annotations

import numpy as np

from diagnose.data.windows import FloatArray

SHARES = (0.5, 0.9)
LEAST_RECORDS = 10  # of a class, below which no curve is drawn
LEAST_SIZES = 3
PRIOR_SCALE = (
    5.0  # of both coefficients, per standard deviation of log size; assumed, weak
)
N_STEPS = 30


def fit_curves(
    size: FloatArray, detected: FloatArray, weight: FloatArray
) -> FloatArray:
    """Logistic curves of the share found over log size, (resample, 2) intercept and slope.

    The log size is standardised to mean 0 and standard deviation 1. A normal prior of standard
    deviation 5 on both coefficients keeps curves finite if the sizes separate hits from misses. A
    falling curve is replaced by a level one: a fault does not become harder to find as it grows.

    Parameters
    ----------
    size : (record,) > 0, of at least two values
    detected : (resample, record) share of the trainings that find each record, 0 to 1
    weight : (resample, record) number of times that each record was drawn

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
        excess = weight * (detected - share)
        gradient = np.stack([excess.sum(axis=1), excess @ scaled], axis=1)
        gradient -= coefficients / PRIOR_SCALE**2
        spread = weight * share * (1 - share)
        cross = spread @ scaled
        entries = [spread.sum(axis=1), cross, cross, spread @ scaled**2]
        curvature = np.stack(entries, axis=1).reshape(-1, 2, 2)
        curvature += np.eye(2) / PRIOR_SCALE**2
        step = np.linalg.solve(curvature, gradient[..., None])[..., 0]
        coefficients += np.clip(step, -2.0, 2.0)
    falling = coefficients[:, 1] < 0
    total = np.maximum(weight.sum(axis=1), 1e-12)
    level = np.clip((weight * detected).sum(axis=1) / total, 1e-6, 1 - 1e-6)
    coefficients[falling, 0] = np.log(level / (1 - level))[falling]
    coefficients[falling, 1] = 0.0
    return coefficients


def curve_at(coefficients: FloatArray, at: FloatArray, size: FloatArray) -> FloatArray:
    """(resample, point) share found at sizes `at`, of curves fitted to the sizes `size`."""
    from scipy.special import expit

    return expit(coefficients[:, :1] + coefficients[:, 1:] * _scaled(at, size))


def limits(coefficients: FloatArray, size: FloatArray, share: float) -> FloatArray:
    """(resample,) smallest tested size from which a share is found.

    It is the smallest of all sizes if every size is found as often, and infinite if none is. The
    curve is not extrapolated to sizes that were not tested.
    """
    ends = curve_at(coefficients, np.array([size.min(), size.max()]), size)
    rising = np.maximum(coefficients[:, 1], 1e-12)
    log_size = np.log(size)
    scaled = (np.log(share / (1 - share)) - coefficients[:, 0]) / rising
    crossing = np.exp(np.clip(scaled, -50, 50) * log_size.std() + log_size.mean())
    limit = np.clip(crossing, size.min(), size.max())
    limit[ends[:, 0] >= share] = size.min()
    limit[ends[:, 1] < share] = np.inf
    return limit


def _scaled(values: FloatArray, size: FloatArray) -> FloatArray:
    log_size = np.log(size)
    return (np.log(values) - log_size.mean()) / log_size.std()
