"""Loads of the teeth at every output sample: the ground truth of a vibration's origin."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Array, Flags
from gensig.dynamics._layout import N_SEEN, SEEN_FORCE, SEEN_NEWEST, SEEN_PAIRS
from gensig.dynamics.helical import pitches
from gensig.dynamics.mesh_teeth import MeshTeeth

NO_TOOTH = -1


@dataclass(frozen=True, slots=True, kw_only=True)
class MeshState:
    """The gear mesh at every output sample.

    A pair of teeth keeps its row of the pair axis as long as it is followed.

    Parameters
    ----------
    pinion_tooth, wheel_tooth : (pair, sample) int16    the teeth that carry load, from 0; -1 where
        the pair has none
    load_share : (pair, sample)     normal force of the pair over that of all
    force : (sample,) N             normal force of all pairs; negative where the teeth touch on
        their back flanks, whose pairs are not listed
    contact_lost : (sample,) bool   no tooth touches another
    fault_engaged : (sample,) bool  a faulty tooth carries load or is on the path of contact
    """

    pinion_tooth: NDArray[np.int16]
    wheel_tooth: NDArray[np.int16]
    load_share: Array
    force: Array
    contact_lost: Flags
    fault_engaged: Flags

    def since(self, sample: int) -> MeshState:
        """The state from a sample on."""
        later = {
            field.name: getattr(self, field.name)[..., sample:]
            for field in fields(MeshState)
        }
        return MeshState(**later)


def mesh_state(
    teeth: MeshTeeth,
    seen: Array,
    angle: Array,
    faulty: Collection[tuple[str, int]] = (),
) -> MeshState:
    """State of one mesh, from the rows of the compiled core.

    Parameters
    ----------
    seen : (row, sample)    rows of ``_layout``
    angle : (sample,) rad   of the pinion since time 0
    faulty : teeth that are not sound, by (gear, tooth)
    """
    pair = teeth.pair
    assert len(seen) == N_SEEN
    first_pitch, last_pitch = pitches(teeth.table)
    n_pairs = last_pitch - first_pitch
    index = seen[SEEN_NEWEST].astype(np.int64) - np.arange(n_pairs)[:, None]
    roll = teeth.start_roll + pair.pinion.base_radius * angle
    position = roll - index * pair.base_pitch
    force, forces = seen[SEEN_FORCE], seen[SEEN_PAIRS : SEEN_PAIRS + n_pairs]
    total = forces.sum(axis=0)
    share = np.divide(forces, total, out=np.zeros_like(forces), where=total > 0.0)
    pinion = (index + teeth.start_teeth[0]) % pair.pinion.n_teeth
    wheel = (index + teeth.start_teeth[1]) % pair.wheel.n_teeth
    path_end = pair.path_of_contact + 2.0 * teeth.table.half_lag
    loaded = forces > 0.0
    near = loaded | ((position >= 0.0) & (position <= path_end))
    odd = np.zeros(near.shape, dtype=bool)
    for gear, tooth in faulty:
        odd |= (pinion if gear == "pinion" else wheel) == tooth
    # a pair keeps its row while others come and go: by its number, not by its age
    order = np.argsort(index % n_pairs, axis=0)
    loaded_teeth = np.where(loaded, [pinion, wheel], NO_TOOTH).astype(np.int16)
    return MeshState(
        pinion_tooth=np.take_along_axis(loaded_teeth[0], order, axis=0),
        wheel_tooth=np.take_along_axis(loaded_teeth[1], order, axis=0),
        load_share=np.take_along_axis(share, order, axis=0),
        force=force.copy(),
        contact_lost=force == 0.0,
        fault_engaged=np.asarray((near & odd).any(axis=0)),
    )


def mesh_signals(
    mesh: MeshState | None, n_samples: int, n_pairs: int, of_mesh: str = ""
) -> dict[str, NDArray[Any]]:
    """Signals of a mesh state with ``n_pairs`` rows of pairs; without values for a failed record.

    ``of_mesh`` is what the name of a mesh that records do not follow puts before the names.
    """
    if mesh is None:
        teeth = np.full((n_pairs, n_samples), NO_TOOTH, dtype=np.int16)
        unknown, no = np.full(n_samples, np.nan), np.zeros(n_samples, dtype=np.bool_)
        mesh = MeshState(
            pinion_tooth=teeth,
            wheel_tooth=teeth,
            load_share=np.full((n_pairs, n_samples), np.nan),
            force=unknown,
            contact_lost=no,
            fault_engaged=no,
        )
    free = ((0, n_pairs - len(mesh.load_share)), (0, 0))
    signals: dict[str, NDArray[Any]] = {
        "mesh_pinion_tooth": np.pad(mesh.pinion_tooth, free, constant_values=NO_TOOTH),
        "mesh_wheel_tooth": np.pad(mesh.wheel_tooth, free, constant_values=NO_TOOTH),
        "mesh_load_share": np.pad(mesh.load_share.astype(np.float32), free),
        "mesh_force": mesh.force.astype(np.float32),
        "contact_lost": mesh.contact_lost.astype(np.int8),
        "fault_engaged": mesh.fault_engaged.astype(np.int8),
    }
    return {f"{of_mesh}{name}": values for name, values in signals.items()}
