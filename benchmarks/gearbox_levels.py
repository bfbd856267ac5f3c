"""Causes of the vibration level of a healthy small gearbox.

    python -m benchmarks.gearbox_levels

A reducer of 8.5 kW is made by ``gensig new gearbox --experiment realistic``. Then one assumption at
a time is changed. The level is the RMS acceleration of three sensors on the housings of 32
machines, over the speeds and torques of the experiment, without noise.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

import gensig
from benchmarks._measure import add_quick
from gensig.cli import main
from gensig.report.levels import velocity_rms
from gensig.signals.recording import STANDARD_GRAVITY

NEW = "new gearbox reducer --teeth 21 53 --module 2.5 --speed 1470 --torque 55"
REALISTIC = "--experiment realistic --no-level"
N_MACHINES = 32
SUPPORTS = (
    "quality.support_damping_ratio_low=0.05 quality.support_damping_ratio_high=0.15"
)
# changed assumption -> overrides
CHANGES = {
    "as written": "",
    "without tip relief": "modification=none",
    "no friction": "mesh.friction_coefficient=0",
    "friction 0.03 instead of 0.05": "mesh.friction_coefficient=0.03",
    "supports damped 0.05 to 0.15, not 0.01 to 0.1": SUPPORTS,
    "grade 5 instead of 7": "quality.iso1328_grade=5 quality.misalignment_um=4",
    "perfect gears": "quality.iso1328_grade=null quality.misalignment_um=0",
    "mesh damping 0.14 instead of 0.07": "mesh.damping_ratio=0.14",
    "gears 40 % and 10 % heavier, by shafts": "gear.pinion.mass_kg=0.5 gear.wheel.mass_kg=2.84",
    "housing gain 0.05 instead of 0.1": "sensing.path.transmissibility=0.05",
    "housing modes from 630 Hz": "sensing.path.natural_frequency_hz=[630,12000]",
    "no vibration of other sources": "sensing.nuisances=[]",
}


def levels(
    folder: Path, words: str, n_machines: int, duration: float
) -> tuple[np.ndarray, np.ndarray]:
    """Acceleration in g and velocity in mm/s of every machine and sensor."""
    stream = gensig.stream(
        "experiment=reducer",
        "plan.classes=[healthy]",
        f"plan.n_records={n_machines}",
        f"plan.n_units={n_machines}",
        f"plan.n_gearboxes={n_machines}",
        "sensing.snr_db=null",
        f"operating.duration_s={duration}",
        *words.split(),
        config_dir=folder,
    )
    signals = [record.signals["acceleration"].astype(float) for record in stream]
    acceleration = [signal.std(axis=1) / STANDARD_GRAVITY for signal in signals]
    velocity = [
        1e3 * velocity_rms(signal, stream.sampling_rate_hz) for signal in signals
    ]
    return np.ravel(acceleration), np.ravel(velocity)


def run() -> None:
    """Print one line a changed assumption."""
    parser = argparse.ArgumentParser(description=__doc__)
    add_quick(parser)
    changes, n_machines, duration = CHANGES, N_MACHINES, 0.5
    if parser.parse_args().quick:
        changes, n_machines, duration = {"as written": ""}, 2, 0.05
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if main([*NEW.split(), *REALISTIC.split(), "--dir", name]):
            raise SystemExit("the gearbox was not written")
        print("| changed | g, median (10 to 90 %) | mm/s, median (10 to 90 %) |")
        print("|---|---|---|")
        for change, words in changes.items():
            cells = []
            for values in levels(folder, words, n_machines, duration):
                low, middle, high = np.percentile(values, [10, 50, 90])
                cells.append(f"{middle:.2g} ({low:.2g} to {high:.2g})")
            print(f"| {change} | {cells[0]} | {cells[1]} |", flush=True)


if __name__ == "__main__":
    run()
