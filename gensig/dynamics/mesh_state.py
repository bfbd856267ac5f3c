"""Which teeth carry what at every output sample.

The ground truth of where a vibration comes from.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics._layout import N_SEEN, SEEN_FORCE, SEEN_NEWEST, SEEN_PAIRS
from gensig.dynamics.helical import half_lag, pitches
from gensig.dynamics.pair import PairDynamics

Array = NDArray[np.float64]

NO_TOOTH = -1


@dataclass(frozen=True, slots=True, kw_only=True)
class MeshState:
    """The gear mesh at every output sample.

    A pair of teeth keeps its place along the pair axis as long as it is followed.

    Parameters
    ----------
    pinion_tooth, wheel_tooth : (pair, sample) int16    the teeth that carry load, from 0; -1 where the pair has none
    load_share : (pair, sample)     normal force of the pair over that of all
    force : (sample,) N             normal force of all pairs; negative where the teeth touch on their back flanks, of
                                    which nothing else is told
    contact_lost : (sample,) bool   no tooth touches another
    fault_engaged : (sample,) bool  a faulty tooth carries load or stands on the path of contact
    """

    pinion_tooth: NDArray[np.int16]
    wheel_tooth: NDArray[np.int16]
    load_share: Array
    force: Array
    contact_lost: NDArray[np.bool_]
    fault_engaged: NDArray[np.bool_]


def mesh_state(
    dynamics: PairDynamics,
    seen: Array,
    angle: Array,
    faulty: Collection[tuple[str, int]] = (),
) -> MeshState:
    """Read what the compiled core tells of the mesh of one machine.

    Parameters
    ----------
    seen : (row, sample)    rows of ``_layout``
    angle : (sample,) rad   of the pinion since time 0
    faulty : teeth that are not sound, by (gear, tooth)
    """
    pair = dynamics.table.pair
    assert len(seen) == N_SEEN
    first_pitch, last_pitch = pitches(dynamics.table)
    n_pairs = last_pitch - first_pitch
    index = seen[SEEN_NEWEST].astype(np.int64) - np.arange(n_pairs)[:, None]
    roll = dynamics.start_roll + pair.pinion.base_radius * angle
    position = roll - index * pair.base_pitch
    force, forces = seen[SEEN_FORCE], seen[SEEN_PAIRS : SEEN_PAIRS + n_pairs]
    total = forces.sum(axis=0)
    share = np.divide(forces, total, out=np.zeros_like(forces), where=total > 0.0)
    teeth = {
        "pinion": (index + dynamics.start_tooth_pinion) % pair.pinion.n_teeth,
        "wheel": (index + dynamics.start_tooth_wheel) % pair.wheel.n_teeth,
    }
    last_place = pair.path_of_contact + 2.0 * half_lag(dynamics.table)
    near = (forces > 0.0) | ((position >= 0.0) & (position <= last_place))
    odd = np.zeros(near.shape, dtype=bool)
    for gear, tooth in teeth.items():
        odd |= np.isin(tooth, [number for name, number in faulty if name == gear])
    # a pair keeps its place while others come and go: by its number, not by its age
    order = np.argsort(index % n_pairs, axis=0)

    def placed(rows: NDArray[np.generic]) -> NDArray[np.generic]:
        return np.take_along_axis(rows, order, axis=0)

    loaded = {
        gear: placed(np.where(forces > 0.0, tooth, NO_TOOTH)).astype(np.int16)
        for gear, tooth in teeth.items()
    }
    return MeshState(
        pinion_tooth=loaded["pinion"],
        wheel_tooth=loaded["wheel"],
        load_share=np.asarray(placed(share), dtype=np.float64),
        force=force.copy(),
        contact_lost=force == 0.0,
        fault_engaged=np.asarray((near & odd).any(axis=0)),
    )
