"""Parts of the teeth of a gear that the other teeth do not explain.

Errors of healthy teeth differ in size and little in shape: pitch and profile errors excite a
machine in few ways. A damaged tooth excites it in another way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gensig.arrays import FloatArray

NEAREST = 1  # teeth on either side that do not count as sisters: they share the contact
# Of the mean square of a sample; 0.01 to 0.1 score alike in cross-validation.
RIDGE = 0.03
TINY = 1e-300


@dataclass(frozen=True, slots=True, kw_only=True)
class UnexplainedTeeth:
    """Deviations of the teeth of one gear from the mean passage, against those of their sisters.

    Attributes
    ----------
    turn : (channel, tooth, sample) deviations
    rest : (channel, tooth, sample) the part that the sisters' shapes do not explain
    distance : (tooth,) squared Mahalanobis distance from the sisters, at least 0
    """

    turn: FloatArray
    rest: FloatArray
    distance: FloatArray


def unexplained_teeth(
    driving: FloatArray, driven: FloatArray
) -> tuple[UnexplainedTeeth, UnexplainedTeeth]:
    """Teeth of both gears, each against all others but itself and its neighbors.

    The sisters of a tooth span its model: normal, with the sisters' second moments and `RIDGE` of
    their mean square beside. The rest is the error of that model's prediction of the tooth. All
    channels count alike, however loud they are.

    Parameters
    ----------
    driving, driven : (channel, tooth, sample) deviations from the mean passage, of
        `gensig.signals.separation.separate_gears`

    Notes
    -----
    With G the ridged Gram matrix of all teeth, the errors of a left-out group S are
    (G^-1)_SS^-1 (G^-1 X)_S: one inverse serves all teeth. Rasmussen & Williams (2006), "Gaussian
    processes for machine learning", section 5.4.2, for groups.
    """
    power = np.square(np.concatenate([driving, driven], axis=1)).mean(axis=(1, 2))
    level = np.sqrt(power)[:, None, None] + TINY
    teeth = np.concatenate([_rows(turn / level) for turn in (driving, driven)])
    gram = teeth @ teeth.T
    ridge = RIDGE * float(np.trace(gram)) / teeth.shape[1] + TINY
    inverse = np.linalg.inv(gram + ridge * np.eye(len(teeth)))
    weighted = inverse @ teeth
    parts, first = [], 0
    for turn in (driving, driven):
        n_channels, n_teeth, n_samples = turn.shape
        tooth = np.arange(n_teeth)[:, None]
        group = first + (tooth + np.arange(-NEAREST, NEAREST + 1)) % n_teeth
        within = inverse[group[:, :, None], group[:, None, :]]
        covariance = np.linalg.inv(within)[:, NEAREST]  # (tooth, tooth of its group)
        rest = np.einsum("tg,tgs->ts", covariance, weighted[group])
        of_channels = rest.reshape(n_teeth, n_channels, n_samples).swapaxes(0, 1)
        distance = np.maximum(covariance[:, NEAREST] / ridge - 1.0, 0.0)
        parts.append(
            UnexplainedTeeth(turn=turn, rest=level * of_channels, distance=distance)
        )
        first += n_teeth
    return parts[0], parts[1]


def _rows(turn: FloatArray) -> FloatArray:
    """(tooth, value) of a turn (channel, tooth, sample), the channels one after the other."""
    return turn.swapaxes(0, 1).reshape(turn.shape[1], -1)
