"""Made-up recordings of a two-stage gearbox: teeth, faults and paths are known."""

from dataclasses import dataclass, field

import numpy as np

from diagnose.detection.gear_stages import stages_of
from gensig.signals.recording import Recording

STAGES = stages_of((32, 80, 48, 64))
RATE = 5000.0
SPEED = 1746.0
SECONDS = 2.5


@dataclass(frozen=True, kw_only=True)
class Fault:
    """Impulses once a turn of a shaft, at a tooth of one of its gears."""

    shaft: int
    n_teeth: int
    tooth: int
    size: float = 6.0


@dataclass(frozen=True, kw_only=True)
class Box:
    """A machine: the same seed has the same teeth and the same housing."""

    seed: int = 0
    stages: object = STAGES
    path: np.ndarray = field(default_factory=lambda: housing(0))

    def record(
        self,
        session=0,
        *,
        seconds=SECONDS,
        speed_rpm=SPEED,
        rate=RATE,
        fault=None,
        gain=1.0,
        path=None,
        wander=0.0,
    ):
        """A recording that begins at angles of its own; (recording, turns of shafts at start)."""
        rng = np.random.default_rng([self.seed, session, 99])
        time = np.arange(round(seconds * rate)) / rate
        course = 1.0 + wander * np.sin(2.0 * np.pi * 0.7 * time)
        turned = (
            np.concatenate([[0.0], np.cumsum(course)[:-1]]) * speed_rpm / 60.0 / rate
        )
        teeth = np.random.default_rng(self.seed)
        signal = np.zeros_like(time)
        begin = rng.uniform(
            0.0, 500.0
        )  # turns of the input since the teeth were numbered
        for shaft, order in enumerate(self.stages.shaft_orders):
            angle = (begin + turned) * order
            for gear in self.stages.gears(shaft):
                errors = 0.3 * teeth.standard_normal(gear.n_teeth)
                place = angle * gear.n_teeth
                signal += errors[place.astype(int) % gear.n_teeth] * np.sin(
                    np.pi * (place % 1.0)
                )
        for order in self.stages.mesh_orders:
            for harmonic in (1, 2, 3):
                phase = 2.0 * np.pi * order * harmonic * (begin + turned)
                signal += teeth.uniform(0.4, 1.0) * np.cos(phase)
        if fault is not None:
            angle = (begin + turned) * self.stages.shaft_orders[fault.shaft]
            passed = np.floor(angle - fault.tooth / fault.n_teeth)
            signal[1:] += fault.size * (np.diff(passed) > 0)
        heard = np.convolve(signal, self.path if path is None else path)[: time.size]
        heard += 0.1 * rng.standard_normal(time.size)
        return Recording(
            sensors=("case",),
            acceleration=gain * (heard - heard.mean())[None],
            sampling_rate=rate,
        )

    def first_tooth(self, session, shaft, n_teeth):
        """Tooth of a gear in mesh when a session's recording begins."""
        rng = np.random.default_rng([self.seed, session, 99])
        begin = rng.uniform(0.0, 500.0) * self.stages.shaft_orders[shaft]
        return int(begin * n_teeth) % n_teeth


def housing(seed):
    """Impulse response of a few modes."""
    rng = np.random.default_rng(1000 + seed)
    time = np.arange(60) / RATE
    modes = [
        rng.uniform(0.5, 1.0)
        * np.exp(-rng.uniform(200.0, 500.0) * time)
        * np.sin(2.0 * np.pi * rng.uniform(300.0, 1900.0) * time + rng.uniform(0, 6))
        for _ in range(4)
    ]
    return np.sum(modes, axis=0)
