"""Default length of a window: the faulty tooth passes in it at any rate and speed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from diagnose.data.teeth import missing_teeth, teeth_of_records
from gensig.dataset.cards.facts import gear_turns
from gensig.errors import DatasetError

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

TURNS = 1.25  # of the slowest gear with faults at the slowest speed: a fault shows once a turn
LEAST = 0.125  # s, in which gears that turn faster pass more often
NO_FAULT = "pinion"  # its turns count if no record names a faulty gear
ROUNDING = 1e-6  # of a sample


def chosen_window(dataset: Dataset) -> tuple[int, str | None]:
    """Length of a window in samples, and a line that explains it if it is not `LEAST`.

    It holds `TURNS` turns of the slowest gear that any record has a fault on, at the slowest
    speed of all, at least `LEAST` and at most a record.

    Parameters
    ----------
    dataset : at the rate that is trained at, see `diagnose.data.at_rate`
    """
    rate, n_record = float(dataset.sampling_rate), int(dataset.n_samples)
    gear, turn = _slowest_turn(dataset)
    seconds = max(LEAST, TURNS * turn)
    wanted = math.ceil(seconds * rate - ROUNDING)
    if wanted > n_record:
        return n_record, (
            f"windows are whole records of {n_record / rate:.3g} s: {seconds:.3g} s "
            f"would hold {TURNS:g} turns of the {gear} at the slowest speed"
        )
    if seconds == LEAST:
        return wanted, None
    return wanted, (
        f"windows of {seconds:.3g} s ({wanted} samples): {TURNS:g} turns of the {gear} "
        "at the slowest speed; window_samples=N takes another length"
    )


def _slowest_turn(dataset: Dataset) -> tuple[str, float]:
    """Gear with faults whose turn takes longest, and the longest time of its turns, s."""
    names = dataset.column_names
    if "speed_rpm" not in names:
        raise DatasetError(
            f"{dataset.folder} does not say speed_rpm, "
            "which the length of windows follows from"
        )
    usable = np.asarray(dataset.usable, dtype=bool)
    turning = usable & (np.asarray(dataset.column("speed_rpm"), dtype=float) > 0)
    if not turning.any():
        return NO_FAULT, 0.0
    turns = 60.0 / np.asarray(dataset.column("speed_rpm"), dtype=float)[turning]
    of_pinion = float(turns.max())
    faulty = set()
    if "fault_gear" in names:
        faulty = {str(name) for name in dataset.column("fault_gear")}
    if missing_teeth(dataset):
        return NO_FAULT, of_pinion
    teeth = teeth_of_records(dataset)[turning]
    of_wheel = float((turns * teeth[:, 1] / teeth[:, 0]).max())
    longest = {"wheel": of_wheel, "pinion": of_pinion}
    longest |= {
        gear: of_pinion * number
        for gear, number in gear_turns(dataset).items()
        if gear not in longest
    }
    slowest = [gear for gear in longest if gear in faulty] or [NO_FAULT]
    gear = max(slowest, key=longest.__getitem__)
    return gear, longest[gear]
