"""How long a window is where nobody says.

Long enough for the faulty tooth to pass, whatever the rate and the speed.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from gensig.errors import DatasetError

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

TURNS = 1.25  # of the slowest gear with faults at the slowest speed: a fault shows once a turn
LEAST = 0.125  # s, in which gears that turn faster pass more often
NO_FAULT = "pinion"  # whose turns count where no record tells a faulty gear
ROUNDING = 1e-6  # of a sample


def chosen_window(dataset: Dataset) -> tuple[int, str | None]:
    """Length of a window, in samples, that suits the records of a data set, and in one line why
    if it is not `LEAST`.

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
            f"windows are whole records of {n_record / rate:.3g} s: {seconds:.3g} s would hold {TURNS:g} turns of the "
            f"{gear} at the slowest speed"
        )
    if seconds == LEAST:
        return wanted, None
    return wanted, (
        f"windows of {seconds:.3g} s ({wanted} samples): {TURNS:g} turns of the {gear} at the slowest speed; "
        "window_samples=N takes another length"
    )


def _slowest_turn(dataset: Dataset) -> tuple[str, float]:
    """The gear that a fault passes most seldom on, and the longest time that it takes for a turn,
    s.
    """
    names = dataset.column_names
    if "speed_rpm" not in names:
        raise DatasetError(
            f"{dataset.folder} does not say speed_rpm, which the length of windows follows from"
        )
    speed = np.asarray(dataset.column("speed_rpm"), dtype=float)[
        np.asarray(dataset.usable, dtype=bool)
    ]
    slowest = 60.0 / float(speed.min()) if speed.size and speed.min() > 0 else 0.0
    faulty = (
        {str(name) for name in dataset.column("fault_gear")}
        if "fault_gear" in names
        else set()
    )
    teeth = {
        gear: dataset.attributes.get(f"n_teeth_{gear}") for gear in ("pinion", "wheel")
    }
    if "wheel" not in faulty or not (teeth["pinion"] and teeth["wheel"]):
        return NO_FAULT, slowest
    of_wheel = slowest * float(teeth["wheel"]) / float(teeth["pinion"])
    return (
        ("pinion", slowest)
        if "pinion" in faulty and slowest > of_wheel
        else ("wheel", of_wheel)
    )
