"""How fast what turns: the frequencies that the page marks, as far as a data set tells them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.dataset.reader import Dataset

GEARS = ("pinion", "wheel")
SAME = 1e-3  # relative: shafts that are told apart turn less alike than this


@dataclass(frozen=True, slots=True, kw_only=True)
class Rotation:
    """Mean frequencies of all records, Hz; NaN where the data set does not tell them.

    Parameters
    ----------
    mesh : (record,)      of the mesh
    drive : (record,)     turns of the driving shaft a second
    n_teeth : by gear of `GEARS`, those that are known
    gear : (record,)      whose turn a fault repeats with, "" where there is none or every tooth has it
    """

    mesh: NDArray[np.floating]
    drive: NDArray[np.floating]
    n_teeth: dict[str, int]
    gear: NDArray[np.str_]

    def turns(self, gear: str) -> NDArray[np.floating]:
        """(record,) turns of a gear a second."""
        return self.mesh / self.n_teeth[gear]

    def of(self, index: int) -> dict[str, float | None]:
        """Frequencies of a record by name: mesh, drive and gears; None where unknown."""
        values = {"mesh": self.mesh[index], "drive": self.drive[index]}
        values |= {gear: self.mesh[index] / self.n_teeth[gear] for gear in self.n_teeth}
        return {
            name: float(value) if np.isfinite(value) and value > 0.0 else None
            for name, value in values.items()
        }

    def fault_gear(self, index: int) -> str:
        """The gear once a turn of which the fault meshes, where its frequency is known; else ""."""
        gear = str(self.gear[index])
        return gear if gear in self.n_teeth else ""

    @property
    def references(self) -> list[tuple[str, str]]:
        """What orders can be counted in: (name of the frequency, words)."""
        if not np.any(np.isfinite(self.mesh) & (self.mesh > 0.0)):
            return (
                [("drive", "turns of the driving shaft")]
                if np.any(self.drive > 0.0)
                else []
            )
        found = [(gear, f"turns of the {gear}") for gear in self.n_teeth]
        turning = (self.mesh > 0.0) & (self.drive > 0.0)
        ratios = [
            self.turns(gear)[turning] / self.drive[turning] for gear in self.n_teeth
        ]
        if np.any(turning) and all(
            np.abs(ratio - 1.0).max() > SAME for ratio in ratios
        ):
            found.append(("drive", "turns of the driving shaft"))
        return [*found, ("mesh", "meshes of a tooth")]


def read_rotation(data: Dataset) -> Rotation:
    """The frequencies of a data set's records."""
    unknown = np.full(data.n_records, np.nan)
    n_teeth = {}
    for gear in GEARS:
        number = data.attributes.get(f"n_teeth_{gear}")
        if isinstance(number, (int, np.integer)) and number > 0:
            n_teeth[gear] = int(number)
    names = data.column_names
    faulty = (
        data.column("fault_gear")
        if "fault_gear" in names
        else np.full(data.n_records, "")
    )
    if (
        "fault_tooth" in names
    ):  # -1: a fault of all teeth, such as wear, has no turn of its own
        faulty = np.where(data.column("fault_tooth") == -1, "", faulty)
    return Rotation(
        mesh=data.column("mesh_frequency_hz")
        if "mesh_frequency_hz" in names
        else unknown,
        drive=data.column("speed_rpm") / 60.0,
        n_teeth=n_teeth,
        gear=faulty,
    )
