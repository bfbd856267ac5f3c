"""Stored records as those of machines drawn anew, with the healthy records of the same machine."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import final

import numpy as np

from diagnose.data.redraws import RedrawnMachine, Redraws, difference
from diagnose.data.teeth import START, teeth_of_records
from diagnose.data.windows import Task
from gensig.errors import ConfigError, DatasetError
from gensig.signals.separation import FloatArray, GearTurns, separate_gears

SOURCE, TWIN = "acceleration_source", "healthy_twin_source"
NEEDED = (
    "re-draws need every record at the bearings with its healthy twin: make the data set with "
    "dataset.store_source=true dataset.store_healthy_twin=true, or give model.redraws=0"
)
# Beside the numbers of unit and re-draw, and of the record: what a generator is for.
MACHINE, RECORD = 1, 2


@final
class RedrawnTurns:
    """Turns of stored records in machines drawn anew.

    Draw k of a record and of the healthy records that it is compared with is in the same machine,
    which all records of the unit share. Same data set, same draws.

    Parameters
    ----------
    task : on a data set that holds its records at the bearings, with twins
    samples_per_tooth : of the turns
    number : of re-draws of each record
    ranges : laws of the draws

    Attributes
    ----------
    sampling_rate : Hz of the records

    Raises
    ------
    ConfigError    for a data set without these signals, or one read at another rate
    """

    def __init__(
        self,
        task: Task,
        samples_per_tooth: int,
        number: int,
        ranges: Redraws | None = None,
    ) -> None:
        dataset = task.dataset
        names = set(getattr(dataset, "signal_names", ()))
        if not {SOURCE, TWIN} <= names or not set(START) <= set(dataset.column_names):
            raise ConfigError(NEEDED)
        self._dataset, self._n_sensors = dataset, len(task.channel_names)
        self._samples_per_tooth, self._number = samples_per_tooth, number
        self._ranges = ranges or Redraws()
        self.sampling_rate = float(dataset.sampling_rate)
        self._speed = np.asarray(dataset.column("speed_rpm"), dtype=float)
        self._teeth = teeth_of_records(dataset)
        units = np.asarray(dataset.column("unit_id"))
        _, self._unit = np.unique(units, return_inverse=True)
        phase = np.asarray(dataset.column(START[0]), dtype=float)
        self._start = [np.asarray(dataset.column(name)) + phase for name in START[1:]]
        self._is_sound = np.asarray(dataset.column("fault_gear")) == ""
        self._parts = functools.lru_cache(maxsize=16)(self._separated)
        self._machine = functools.lru_cache(maxsize=4 * number)(self._drawn)

    def of_record(
        self, record: int, sound: Sequence[int] = ()
    ) -> list[list[tuple[GearTurns, float]]]:
        """Turns and mesh frequency in Hz of each re-draw of a record.

        Those of the healthy records that it is compared with follow in each.
        """
        result = []
        for draw in range(self._number):
            rng = np.random.default_rng([RECORD, record, draw])
            result.append(
                [
                    (self._turns(each, draw, rng), self._mesh_frequency(each))
                    for each in (record, *sound)
                ]
            )
        return result

    def _turns(self, record: int, draw: int, rng: np.random.Generator) -> GearTurns:
        """Turns of a record in a drawn machine."""
        carrier, residual = self._parts(record)
        machine = self._machine(int(self._unit[record]), draw, len(carrier.mesh))
        return machine.record(
            carrier,
            residual,
            mesh_frequency=self._mesh_frequency(record),
            sampling_rate=self.sampling_rate,
            n_samples=int(self._dataset.n_samples),
            teeth=(float(self._start[0][record]), float(self._start[1][record])),
            rng=rng,
        )

    def _drawn(self, unit: int, draw: int, n_sources: int) -> RedrawnMachine:
        rng = np.random.default_rng([MACHINE, unit, draw])
        return self._ranges.machine(n_sources, self._n_sensors, rng)

    def _separated(self, record: int) -> tuple[GearTurns, GearTurns | None]:
        """Turns of the healthy twin, and of what the fault adds; None for a healthy record."""
        twin = self._separate(record, TWIN)
        if self._is_sound[record]:
            return twin, None
        return twin, difference(self._separate(record, SOURCE), twin)

    def _separate(self, record: int, name: str) -> GearTurns:
        signal: FloatArray = np.asarray(self._dataset.trace(record, name), dtype=float)
        if signal.shape[-1] != int(self._dataset.n_samples):
            raise ConfigError(
                "re-draws need the rate of the data set: sampling_rate_hz=null, or model.redraws=0"
            )
        if not np.isfinite(signal).all():
            raise DatasetError(
                f"record {record}: {name} holds values that are not finite"
            )
        driving, driven = self._teeth[record].tolist()
        return separate_gears(
            signal,
            self.sampling_rate,
            self._mesh_frequency(record),
            (driving, driven),
            samples_per_tooth=self._samples_per_tooth,
        )

    def _mesh_frequency(self, record: int) -> float:
        return float(self._speed[record]) / 60 * int(self._teeth[record][0])
