"""Does the twin agree with measurements that nothing was fitted to? Levels by band and
indicators, by sensor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.errors import SimulationError
from gensig.options.configuration import Configuration
from gensig.plan.make import make_plan
from gensig.record.simulate import simulate_records
from gensig.sensing.agreement import third_octave_bands, third_octave_power
from gensig.signals.indicators import crest_factor, kurtosis, rms
from gensig.signals.mesh_motion import Motion, Teeth
from gensig.signals.recording import Recording
from gensig.twin.grade import sideband_ratios
from gensig.twin.lines import find_lines

Array = NDArray[np.float64]

N_RECORDS = 12
EXPECTED = (N_RECORDS - 1) / (
    N_RECORDS + 1
)  # share of equals that lies between the least and the greatest of them
LONGEST = 2.0  # s of the held-out recording that are compared
INDICATORS = ("level", "kurtosis", "crest factor", "sideband ratio")
INDICATOR_UNITS = ("dB", "", "", "dB")


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """Held-out measurement beside healthy records of the twin.

    ``band`` (band,) Hz mid-bands; ``measured_db`` (sensor, band) and ``twin_db`` (record, sensor,
    band) third-octave levels over 1 m/s2; ``fitted_db`` (sensor, band) those of what was fitted
    to. ``measured`` (sensor, indicator) and ``twin`` (record, sensor, indicator) as
    ``INDICATORS``; the level is the RMS over 1 m/s2.
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
        """Share of bands in which the measurement lies between the twin's least and greatest,
        (sensor,).
        """
        within = (self.measured_db >= self.twin_db.min(axis=0)) & (
            self.measured_db <= self.twin_db.max(axis=0)
        )
        return np.asarray(within.mean(axis=1))

    @property
    def agrees(self) -> NDArray[np.bool_]:
        """Whether the measured indicator lies between the twin's least and greatest, (sensor,
        indicator).
        """
        return np.asarray(
            (self.measured >= self.twin.min(axis=0))
            & (self.measured <= self.twin.max(axis=0))
        )


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
    config : the configuration of the twin, with ``operating.duration_s`` as ``held_out_duration``
        says
    motion : the mesh in ``held_out``

    Raises
    ------
    SimulationError    where a healthy record of the twin does not stay finite
    """
    rate, duration = held_out.sampling_rate, float(config["operating"]["duration_s"])
    n_samples = round(duration * rate)
    stretches = [one.acceleration[:, :n_samples] for one in (held_out, fitted)]
    cycles = motion.cycles[:n_samples]
    signals, angles = _healthy_records(config)
    lower, upper = third_octave_bands(n_samples, rate)
    measured_db, fitted_db = (
        _decibel(third_octave_power(stretch, rate)) for stretch in stretches
    )
    return Check(
        sensors=held_out.sensors,
        band=np.sqrt(lower * upper),
        measured_db=measured_db,
        fitted_db=fitted_db,
        twin_db=np.stack(
            [_decibel(third_octave_power(signal, rate)) for signal in signals]
        ),
        measured=_indicators(stretches[0], cycles, rate, teeth),
        twin=np.stack(
            [
                _indicators(signal, angle * teeth.driving / (2.0 * np.pi), rate, teeth)
                for signal, angle in zip(signals, angles, strict=True)
            ]
        ),
        duration=duration,
    )


def _healthy_records(config: Configuration) -> tuple[Sequence[Array], Sequence[Array]]:
    """Accelerations (sensor, sample) and shaft angles (sample,) of healthy records, each of
    another set of gears.
    """
    plan: dict[str, Any] = {
        "n_records": N_RECORDS, "n_units": N_RECORDS, "n_gearboxes": 1, "conditions_per_unit": None, "n_repeats": 1,
        "classes": ["healthy"], "design": "latin_hypercube", "vary": {}, "sham": False,
    }  # fmt: skip
    unused = dict.fromkeys(
        ("store_mesh_state", "store_detectability", "store_healthy_twin"), False
    )
    whole = config.with_entries(
        plan=plan, classes={"healthy": {"kind": "healthy", "vary": {}}}
    )
    whole = whole.with_keys("dataset", **unused, store_shaft_angle=True)
    drawn = make_plan(whole)
    records = simulate_records(
        whole, [drawn.record(place) for place in range(N_RECORDS)]
    )
    failed = [
        record.values["status_reason"]
        for record in records
        if record.values.get("status") == "failed"
    ]
    if failed:
        raise SimulationError(f"a healthy record of the twin failed: {failed[0]}")
    signals = [record.signals["acceleration"].astype(np.float64) for record in records]
    return signals, [record.signals["shaft_angle"] for record in records]


def _indicators(signal: Array, cycles: Array, rate: float, teeth: Teeth) -> Array:
    """(sensor, indicator) as ``INDICATORS``."""
    centred = signal - signal.mean(axis=1, keepdims=True)
    ratios = sideband_ratios(find_lines(centred, cycles, rate, teeth), teeth)
    middle = np.array(
        [
            np.median(row[np.isfinite(row)]) if np.isfinite(row).any() else np.nan
            for row in ratios
        ]
    )
    columns = [
        20.0 * np.log10(rms(centred)),
        kurtosis(centred),
        crest_factor(centred),
        middle,
    ]
    return np.stack(columns, axis=1)


def _decibel(power: Array) -> Array:
    return np.asarray(10.0 * np.log10(np.maximum(power, 1e-300)))
