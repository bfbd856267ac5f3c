"""Check of a fitted machine against measurements that nothing was fitted to.

It compares levels by band and indicators, by sensor.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gensig.arrays import Array, Flags
from gensig.errors import SimulationError
from gensig.options.configuration import Configuration
from gensig.plan.make import make_plan
from gensig.record.inputs import InputReader
from gensig.record.simulate import simulate_records
from gensig.sensing.agreement import third_octave_bands, third_octave_power
from gensig.signals.indicators import crest_factor, kurtosis, rms
from gensig.signals.mesh_motion import Motion, Teeth
from gensig.signals.recording import Recording
from gensig.signals.transfer.order_lines import find_lines
from gensig.twin.grade import median_of_finite, sideband_ratios

N_RECORDS = 12  # healthy, each of a different set of gears
PLAN: Mapping[str, Any] = {
    "n_records": N_RECORDS,
    "n_units": N_RECORDS,
    "n_gearboxes": 1,
    "conditions_per_unit": None,
    "n_repeats": 1,
    "classes": ["healthy"],
    "design": "latin_hypercube",
    "vary": {},
    "sham": False,
}
CLASSES = {"healthy": {"kind": "healthy", "vary": {}}}
STORED = {
    "store_mesh_state": False,
    "store_detectability": False,
    "store_healthy_twin": False,
    "store_shaft_angle": True,
}
# share of equals that lies between the least and the greatest of them
EXPECTED = (N_RECORDS - 1) / (N_RECORDS + 1)
LONGEST = 2.0  # s of the held-out recording that are compared
INDICATORS = ("level", "kurtosis", "crest factor", "sideband ratio")
INDICATOR_UNITS = ("dB", "", "", "dB")


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """Held-out measurement and healthy records of the fitted machine.

    ``band`` (band,) Hz mid-bands. ``measured_db`` (sensor, band) and ``twin_db`` (record, sensor,
    band) are third-octave levels over 1 m/s2; ``fitted_db`` (sensor, band) are those of the
    recording of the fit. ``measured`` (sensor, indicator) and ``twin`` (record, sensor,
    indicator) as ``INDICATORS``; the level is the RMS over 1 m/s2.
    """

    sensors: tuple[str, ...]
    band: Array
    measured_db: Array
    fitted_db: Array
    twin_db: Array
    measured: Array
    twin: Array
    duration: float

    @property
    def difference_db(self) -> Array:
        """Twin, median over its records, less measurement, (sensor, band) dB."""
        return np.asarray(np.median(self.twin_db, axis=0) - self.measured_db)

    @property
    def share_within(self) -> Array:
        """Share of bands with the measurement between the twin's least and greatest, (sensor,)."""
        return np.asarray(_within(self.measured_db, self.twin_db).mean(axis=1))

    @property
    def agrees(self) -> Flags:
        """True where the measured indicator lies between the twin's least and greatest.

        (sensor, indicator).
        """
        return _within(self.measured, self.twin)


def _within(measured: Array, records: Array) -> Flags:
    low, high = records.min(axis=0), records.max(axis=0)
    return np.asarray((measured >= low) & (measured <= high))


def held_out_duration(held_out: Recording, fitted: Recording) -> float:
    """Length that is compared, s."""
    return min(LONGEST, held_out.duration, fitted.duration)


def check(
    config: Configuration,
    held_out: Recording,
    motion: Motion,
    fitted: Recording,
    teeth: Teeth,
) -> Check:
    """Simulate healthy records of the twin and compare.

    Parameters
    ----------
    config : the configuration of the twin, with ``operating.duration_s`` of ``held_out_duration``
    motion : the mesh in ``held_out``

    Raises
    ------
    SimulationError    where a healthy record of the twin does not stay finite
    """
    rate, duration = held_out.sampling_rate, float(config["operating"]["duration_s"])
    n_samples = round(duration * rate)
    measured, before = (
        recording.acceleration[:, :n_samples] for recording in (held_out, fitted)
    )
    healthy = config.with_entries(plan=PLAN, classes=CLASSES)
    records = _recorded(InputReader(healthy.with_keys("dataset", **STORED)))
    lower, upper = third_octave_bands(n_samples, rate)
    n_driving = teeth.driving
    return Check(
        sensors=held_out.sensors,
        band=np.sqrt(lower * upper),
        measured_db=_levels(measured, rate),
        fitted_db=_levels(before, rate),
        twin_db=np.stack([_levels(signal, rate) for signal, _ in records]),
        measured=_indicators(measured, motion.cycles[:n_samples], rate, teeth),
        twin=np.stack(
            [
                _indicators(signal, angle * n_driving / (2.0 * np.pi), rate, teeth)
                for signal, angle in records
            ]
        ),
        duration=duration,
    )


def _recorded(reader: InputReader) -> list[tuple[Array, Array]]:
    """Accelerations (sensor, sample) and shaft angles (sample,) of all records of a plan."""
    drawn = make_plan(reader.config)
    rows = [drawn.record(index) for index in range(drawn.n_records)]
    records = []
    for record in simulate_records(reader, rows):
        if record.values.get("status") == "failed":
            reason = record.values["status_reason"]
            raise SimulationError(f"a healthy record of the twin failed: {reason}")
        signals = record.signals
        acceleration = signals["acceleration"].astype(np.float64)
        records.append((acceleration, signals["shaft_angle"]))
    return records


def _indicators(signal: Array, cycles: Array, rate: float, teeth: Teeth) -> Array:
    """(sensor, indicator) as ``INDICATORS``."""
    centred = signal - signal.mean(axis=1, keepdims=True)
    ratios = sideband_ratios(find_lines(centred, cycles, rate, teeth), teeth)
    columns = [
        20.0 * np.log10(rms(centred)),
        kurtosis(centred),
        crest_factor(centred),
        np.array([median_of_finite(row) for row in ratios]),
    ]
    return np.stack(columns, axis=1)


def _levels(signal: Array, rate: float) -> Array:
    """Third-octave levels over 1 m/s2, (sensor, band) dB."""
    power = third_octave_power(signal, rate)
    return np.asarray(10.0 * np.log10(np.maximum(power, 1e-300)))
