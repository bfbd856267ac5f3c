"""Rotation and mesh frequencies of a data set's records, which the page marks."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import FloatArray, Integers
from gensig.dataset.cards.facts import gear_turns
from gensig.dataset.reader import Dataset
from gensig.errors import DatasetError

GEARS = ("pinion", "wheel")
SAME = 1e-3  # relative difference below which two shafts turn alike


@dataclass(frozen=True, slots=True, kw_only=True)
class Rotation:
    """Mean frequencies of all records, Hz; NaN where the data set does not have them.

    Parameters
    ----------
    mesh : (record,)      of the mesh
    drive : (record,)     turns of the driving shaft a second
    n_teeth : (record,) by gear of `GEARS`, those that are known
    further : turns of the driving shaft during one turn of each further gear of a drive line
    gear : (record,)      gear with whose turn a fault repeats; "" without a fault, or where every
                          tooth has it
    """

    mesh: FloatArray
    drive: FloatArray
    n_teeth: dict[str, Integers]
    further: dict[str, float]
    gear: NDArray[np.str_]

    def turns(self, gear: str) -> FloatArray:
        """(record,) turns of a gear a second."""
        if gear in self.further:
            return self.drive / self.further[gear]
        return self.mesh / self.n_teeth[gear]

    def of(self, index: int) -> dict[str, float | None]:
        """Frequencies of a record by name: mesh, drive and gears; None where unknown."""
        values = {"mesh": self.mesh[index], "drive": self.drive[index]}
        gears = (*self.n_teeth, *self.further)
        values |= {gear: self.turns(gear)[index] for gear in gears}
        known = {
            name: float(value)
            for name, value in values.items()
            if np.isfinite(value) and value > 0.0
        }
        return {name: known.get(name) for name in values}

    def fault_gear(self, index: int) -> str:
        """Gear of a record's fault where its frequency is known, else ""."""
        gear = str(self.gear[index])
        return gear * (gear in self.n_teeth or gear in self.further)

    @property
    def references(self) -> list[tuple[str, str]]:
        """Frequencies that orders can be multiples of: (name, words)."""
        drive = ("drive", "turns of the driving shaft")
        if not np.any(np.isfinite(self.mesh) & (self.mesh > 0.0)):
            return [drive] * bool(np.any(self.drive > 0.0))
        gears = (*self.n_teeth, *self.further)
        result = [(gear, f"turns of the {gear}") for gear in gears]
        turning = (self.mesh > 0.0) & (self.drive > 0.0)
        ratios = [
            self.turns(gear)[turning] / self.drive[turning] for gear in self.n_teeth
        ]
        if np.any(turning) and all(
            np.abs(ratio - 1.0).max() > SAME for ratio in ratios
        ):
            result.append(drive)
        return [*result, ("mesh", "meshes of a tooth")]


def read_rotation(data: Dataset) -> Rotation:
    """The frequencies of a data set's records."""
    n_teeth = {}
    for gear in GEARS:
        with suppress(DatasetError):
            number = data.n_teeth(gear)
            if (number > 0).all():
                n_teeth[gear] = number
    names = data.column_names
    mesh, faulty = np.full(data.n_records, np.nan), np.full(data.n_records, "")
    if "mesh_frequency_hz" in names:
        mesh = data.column("mesh_frequency_hz")
    if "fault_gear" in names:
        faulty = data.column("fault_gear")
    if "fault_tooth" in names:
        # -1: a fault of all teeth, such as wear, has no turn of its own
        faulty = np.where(data.column("fault_tooth") == -1, "", faulty)
    return Rotation(
        mesh=mesh,
        drive=data.column("speed_rpm") / 60.0,
        n_teeth=n_teeth,
        further={
            gear: turns
            for gear, turns in gear_turns(data).items()
            if gear not in GEARS and turns > 0.0
        },
        gear=faulty,
    )
