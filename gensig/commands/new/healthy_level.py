"""Vibration level of a new gearbox without faults, in the units of machine monitoring."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gensig.commands.console import remark, step
from gensig.errors import GensigError, SimulationError
from gensig.plan.request import read_request
from gensig.production.streaming import open_stream
from gensig.report.levels import (
    LOUD_ACCELERATION,
    velocity_rms,
    vibration_zone,
    zone_limits,
)
from gensig.signals.recording import STANDARD_GRAVITY
from gensig.units import to_si

N_MACHINES = 8
LONGEST = 0.5  # s of a record
LEAST_TURNS = 10  # of the driving gear in a record


@dataclass(frozen=True, slots=True, kw_only=True)
class HealthyLevel:
    """Levels of healthy machines at the rated speed and torque, without noise.

    ``acceleration`` RMS in m/s2 and ``velocity`` RMS from 10 to 1000 Hz in m/s, (machine,) of each
    channel; ``on_housing`` is False for accelerations of the gears and their shafts.
    """

    acceleration: dict[str, np.ndarray]
    velocity: dict[str, np.ndarray]
    on_housing: bool
    power_kw: float

    @property
    def loudest(self) -> str:
        """Channel of the largest median acceleration."""
        return max(
            self.acceleration, key=lambda name: np.median(self.acceleration[name])
        )

    @property
    def zone(self) -> str:
        """Zone of ISO 20816-3 of the largest median velocity on the housing."""
        fastest = max(float(np.median(values)) for values in self.velocity.values())
        return vibration_zone(fastest, self.power_kw)

    def content(self) -> dict[str, Any]:
        """Medians over the machines, for JSON."""
        return {
            "machines": len(self.acceleration[self.loudest]),
            "at": "housing" if self.on_housing else "bearings",
            "rms_g": {
                name: float(np.median(values) / STANDARD_GRAVITY)
                for name, values in self.acceleration.items()
            },
            "velocity_rms_mm_per_s": {
                name: float(1e3 * np.median(values))
                for name, values in self.velocity.items()
            },
            "iso_20816_3_zone": self.zone if self.on_housing else None,
        }

    def lines(self) -> list[str]:
        """The levels in sentences."""
        place = "at the bearings"
        if self.on_housing:
            place = "on the housing"
        shown = [f"healthy level {place} at the rated speed and torque:"]
        for name in self.acceleration:
            low, middle, high = np.percentile(self.acceleration[name], [0, 50, 100])
            levels = f"{_in_g(middle)} g ({_in_g(low)} to {_in_g(high)})"
            velocity = 1e3 * float(np.median(self.velocity[name]))
            shown.append(
                f"  {name:<32}{levels}, {velocity:.2g} mm/s from 10 to 1000 Hz"
            )
        return [*shown, *self._remarks()]

    def _remarks(self) -> list[str]:
        if not self.on_housing:
            return [
                "  gears shake more than a housing, for which published levels hold; "
                "--experiment realistic has one"
            ]
        remarks = [f"  zone {self.zone} of ISO 20816-3, {zone_limits(self.power_kw)}"]
        if np.median(self.acceleration[self.loudest]) > LOUD_ACCELERATION:
            remarks.append(
                f"  above {LOUD_ACCELERATION / STANDARD_GRAVITY:g} g, louder than published "
                "housings: see docs/howto/your_gearbox.md"
            )
        return remarks


def read_level(arguments: Namespace, folder: Path) -> HealthyLevel | None:
    """The level of a gearbox that was written; None where it is not asked for, or has none."""
    if arguments.no_level:
        return None
    speed, torque = arguments.speed, arguments.torque
    try:
        return healthy_level(folder, arguments.name, speed_rpm=speed, torque_nm=torque)
    except GensigError as error:
        remark(f"no healthy level: {error}")
        return None


def healthy_level(
    folder: Path, name: str, *, speed_rpm: float, torque_nm: float
) -> HealthyLevel:
    """Simulate healthy machines of the experiment ``name`` in a folder of options.

    Parameters
    ----------
    speed_rpm, torque_nm : rated values of the driving shaft

    Raises
    ------
    GensigError    for a machine that makes no records
    """
    words = [f"experiment={name}"]
    config = read_request(words, config_dir=folder).config
    turns = LEAST_TURNS * 60.0 / speed_rpm
    duration = min(config["operating"]["duration_s"], max(LONGEST, turns))
    words += [
        "plan.classes=[healthy]",
        f"plan.n_records={N_MACHINES}",
        f"plan.n_units={N_MACHINES}",
        f"plan.n_gearboxes={N_MACHINES}",
        f"operating.speed_rpm={speed_rpm!r}",
        f"operating.torque_nm={torque_nm!r}",
        f"operating.duration_s={duration!r}",
        "sensing.snr_db=null",
    ]
    stream = open_stream(read_request(words, config_dir=folder).config)
    step(
        f"simulating {N_MACHINES} healthy machines to tell their level (--no-level skips it)"
    )
    signals = []
    for record in stream:
        if record.values["status"] != "ok":
            raise SimulationError(str(record.values["status_reason"]))
        signals.append(np.asarray(record.signals["acceleration"], dtype=np.float64))
    rate, channels = stream.sampling_rate_hz, stream.channels
    rms = np.array([signal.std(axis=-1) for signal in signals])
    velocity = np.array([velocity_rms(signal, rate) for signal in signals])
    return HealthyLevel(
        acceleration=dict(zip(channels, rms.T, strict=True)),
        velocity=dict(zip(channels, velocity.T, strict=True)),
        on_housing=config["sensing"]["sensors"] is not None,
        power_kw=1e-3 * to_si("speed_rpm", speed_rpm) * torque_nm,
    )


def _in_g(acceleration: float) -> str:
    return f"{acceleration / STANDARD_GRAVITY:.2g}"
