"""Machines that are known, "measured" by simulating them."""

from dataclasses import dataclass

import numpy as np

from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader
from gensig.record.simulate import simulate_record

RATE = 25600.0
TEETH = (23, 37)
SPEED = 2411.0
GRADE = 5.0
SNR = 12.0


@dataclass(frozen=True)
class Known:
    """A recording (sensor, sample) of a machine, and what is true of it."""

    signal: np.ndarray
    speed_rpm: float
    shaft_angle: np.ndarray
    snr_db: float


def drifting(scatter, correlation_time, duration, seed):
    """A random walk of the speed as [time_s, factor] pairs."""
    rng, step = np.random.default_rng(seed), correlation_time / 4.0
    walk, keep = [rng.standard_normal()], np.exp(-0.25)
    while len(walk) * step < duration:
        walk.append(keep * walk[-1] + np.sqrt(1.0 - keep**2) * rng.standard_normal())
    return [
        [round(place * step, 6), 1.0 + scatter * float(value)]
        for place, value in enumerate(walk)
    ]


def measured(*, duration=2.4, seed=5, profile=None, snr=SNR, grade=GRADE, path=True):
    """A healthy machine of known speed, grade, path and noise."""
    words = [
        f"gear.wheel.n_teeth={TEETH[1]}",
        "gear.wheel.bore_radius_mm=10",
        "gear.wheel.mass_kg=null",
        "gear.wheel.inertia_kg_m2=null",
        f"operating.speed_rpm={SPEED}",
        f"operating.duration_s={duration}",
        f"sensing.sampling_rate_hz={RATE}",
        "sensing.channels=[pinion_y,wheel_y]",
        "sensing.gain_scatter=0",
        "solver.oversampling=10",
        "solver.max_error=null",
        f"quality.iso1328_grade={grade}",
        f"seed={seed}",
        "quality.used_share_low=0.6",
        "quality.used_share_high=0.6",
        f"sensing.snr_db={'null' if snr is None else snr}",
        "dataset.store_shaft_angle=true",
        "plan.n_records=1",
        "plan.n_units=1",
    ]
    config = read_request(words).config
    config = config.with_keys("operating", speed_profile=profile)
    if path:
        modal = {
            "kind": "modal",
            "n_modes": [6, 6],
            "natural_frequency_hz": [600.0, 8000.0],
            "damping_ratio": [0.05, 0.1],
            "transmissibility": 0.5,
        }
        config = config.with_keys("sensing", path=modal, sensors=["case", "lid"])
    record = simulate_record(InputReader(config), make_plan(config).record(0))
    assert record.values.get("status") != "failed"
    angle = record.signals["shaft_angle"]
    speed = (angle[-1] - angle[0]) * RATE / (len(angle) - 1) * 60.0 / (2.0 * np.pi)
    snr_db = float(
        10.0
        * np.log10(
            record.signals["signal_power"]
            / np.maximum(record.signals["noise_power"], 1e-300)
        ).mean()
    )
    return Known(
        signal=record.signals["acceleration"].astype(float),
        speed_rpm=float(speed),
        shaft_angle=angle,
        snr_db=snr_db,
    )
