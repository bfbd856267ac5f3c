"""A made-up measured rig: a wandering mesh with noise, knocks once a turn, and rough teeth."""

from pathlib import Path

import numpy as np

RATE = 6000.0  # Hz
SPEED = 25.0  # Hz, of the driving shaft
TEETH = (20, 40)
YAML = """
name: made up
unit: m/s2
sampling_rate_hz: 6000
speed_rpm: 1500
stages: [[20, 40]]
classes: {healthy: healthy, one_tooth: one_tooth, many_teeth: many_teeth}
files:
- pattern: "{class}_{specimen}_{repeat}.npy"
"""


def signal(kind: str, seed: int, seconds: float = 6.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    time = np.arange(round(RATE * seconds)) / RATE
    wander = 1.0 + 0.002 * np.sin(2.0 * np.pi * 0.3 * time + seed)
    turn = np.cumsum(SPEED * wander) / RATE
    x = 0.3 * rng.standard_normal(time.size)
    for k in (1, 2, 3):
        x += np.cos(2.0 * np.pi * k * TEETH[0] * turn + k * seed) / k
    x += 0.2 * np.cos(2.0 * np.pi * turn) + 0.1 * np.cos(np.pi * turn)
    angles = {
        "healthy": (),
        "one_tooth": (0.0,),
        "many_teeth": np.linspace(0.0, 0.97, 13) ** 1.3,
    }
    for angle in angles[kind]:
        since = np.mod(turn - angle, 1.0) / SPEED
        x += 4.0 * np.exp(-since / 0.001) * rng.standard_normal(time.size)
    return x[None]


def write_rig(
    folder: Path, *, n_specimens: int = 1, n_repeats: int = 2, seconds: float = 6.0
) -> Path:
    """Folder of recordings with its YAML."""
    folder.mkdir(exist_ok=True)
    for number, kind in enumerate(("healthy", "one_tooth", "many_teeth")):
        for specimen in range(n_specimens):
            for repeat in range(n_repeats):
                x = signal(kind, 100 * number + 10 * specimen + repeat, seconds)
                np.save(folder / f"{kind}_{specimen}_{repeat}.npy", x)
    (folder / "measured.yaml").write_text(YAML)
    return folder
