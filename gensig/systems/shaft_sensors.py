"""What sensors on the gears' shafts see: the gears' angles, counted from their own tooth 0."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.sensing.encoder import draw_disc
from gensig.sensing.tachometer import draw_mark, pulse_train
from gensig.systems.base import Machine
from gensig.systems.run import CleanRecord, Start

Array = NDArray[np.float64]
SWITCHES = {
    "store_tacho": "tacho",
    "store_encoder": "encoder_angle",
    "store_shaft_angle": "shaft_angle",
}


def gear_angle(system: Machine, shaft: str, start: Start, shaft_angle: Array) -> Array:
    """Angle of a gear in its own sense of rotation, 0 where its tooth 0 enters contact, (sample,)
    rad.

    The wheel's is that of the pinion over the ratio: its lag under load and its own vibration are
    left out.

    Parameters
    ----------
    shaft_angle : (sample,) rad    of the pinion since the record's start, as ``CleanRecord`` has it
    """
    pair, first = system.pair, start.teeth[shaft]
    turned = shaft_angle * pair.pinion.n_teeth + 2.0 * math.pi * (first + start.phase)
    return turned / pair.gears[shaft].n_teeth


def shaft_signals(
    names: Sequence[str],
    system: Machine,
    start: Start,
    record: CleanRecord | None,
    gearbox_rng: np.random.Generator,
    record_rng: np.random.Generator,
) -> dict[str, NDArray[Any]]:
    """Signals of tachometer, encoder and shaft angle; NaN for a record that failed.

    Parameters
    ----------
    names : signals that are stored, of the values of ``SWITCHES``
    gearbox_rng : where mark and disc sit, and the disc's errors
    record_rng : the jitter
    """
    sensing = system.sensing
    n_samples = round(system.operating.duration * sensing.sampling_rate)
    if record is None or not names:
        return {name: np.full(n_samples, np.nan).astype(_type(name)) for name in names}
    mark = draw_mark(
        gearbox_rng
    )  # also where it is not asked for: what is stored moves nothing
    found = {"shaft_angle": record.shaft_angle}
    if "tacho" in names:
        angle = gear_angle(system, sensing.tacho.shaft, start, record.shaft_angle)
        found["tacho"] = pulse_train(
            sensing.tacho, mark, angle, sensing.sampling_rate, record_rng
        )
    if "encoder_angle" in names:
        angle = gear_angle(system, sensing.encoder.shaft, start, record.shaft_angle)
        disc = draw_disc(gearbox_rng, sensing.encoder)
        before = (
            2.0 * math.pi * math.floor((angle[0] - disc.index) / (2.0 * math.pi))
        )  # turns that nobody counted
        found["encoder_angle"] = disc.read(
            angle - before, quantised=sensing.encoder.quantised
        )
    return {name: found[name].astype(_type(name)) for name in names}


def _type(name: str) -> type[np.floating[Any]]:
    return np.float32 if name == "tacho" else np.float64
