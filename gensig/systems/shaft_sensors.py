"""Signals of sensors on the gears' shafts."""

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

SWITCHES = {
    "store_tacho": "tacho",
    "store_encoder": "encoder_angle",
    "store_shaft_angle": "shaft_angle",
}


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
    gearbox_rng : for the angles of mark and disc, and the disc's errors
    record_rng : for the jitter
    """
    sensing = system.sensing
    if record is None or not names:
        return {
            name: np.full(system.n_samples, np.nan).astype(_type(name))
            for name in names
        }
    # drawn in any case: the choice of stored signals must not change other draws
    mark = draw_mark(gearbox_rng)
    signals = {"shaft_angle": record.shaft_angle}
    if "tacho" in names:
        angle = system.gear_angle(sensing.tacho.shaft, start, record.shaft_angle)
        rate = sensing.sampling_rate
        signals["tacho"] = pulse_train(sensing.tacho, mark, angle, rate, record_rng)
    if "encoder_angle" in names:
        angle = system.gear_angle(sensing.encoder.shaft, start, record.shaft_angle)
        disc = draw_disc(gearbox_rng, sensing.encoder)
        # whole turns before the record are not counted
        n_turns = math.floor((angle[0] - disc.index) / (2.0 * math.pi))
        angle = angle - 2.0 * math.pi * n_turns
        quantised = sensing.encoder.quantised
        signals["encoder_angle"] = disc.read(angle, quantised=quantised)
    return {name: signals[name].astype(_type(name)) for name in names}


def _type(name: str) -> type[np.floating[Any]]:
    return np.float32 if name == "tacho" else np.float64
