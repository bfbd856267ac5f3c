"""Made-up folders in the layout of each known set: the names and the forms, noise as samples."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy import io

N_SAMPLES = 400


def noise(n_channels: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(N_SAMPLES, n_channels))


def write_phm2009(folder: Path) -> None:
    for case in ("spur 1", "spur 2", "spur 5", "helical 1", "helical 2"):
        for repeat in (1, 2):
            file = folder / "gearset" / "raw" / case / f"{case}_30hz_High_{repeat}.txt"
            file.parent.mkdir(parents=True, exist_ok=True)
            np.savetxt(file, noise(3, repeat))
    (folder / "readme.txt").write_text("About the set.\n")


def write_seu(folder: Path) -> None:
    header = "".join(f"Line {index}\t1\n" for index in range(16))
    for own in ("Health", "Chipped", "Miss", "Root", "Surface"):
        for condition in ("20_0", "30_2"):
            rows = (
                "\t".join(f"{value:.6f}" for value in row) + "\t" for row in noise(8, 0)
            )
            file = folder / "gearset" / f"{own}_{condition}.csv"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(header + "\n".join(rows) + "\n")


def write_mcc5_thu(folder: Path) -> None:
    places = ("motor_vibration", "gearbox_vibration")
    names = [
        "speed",
        "torque",
        *(f"{place}_{axis}" for place in places for axis in "xyz"),
    ]
    settings = ("torque_circulation_1000rpm_10Nm", "speed_circulation_20Nm-3000rpm")
    for own in (
        "health",
        "miss_teeth",
        "gear_wear_H",
        "teeth_break_and_bearing_inner_L",
    ):
        for setting in settings:
            file = folder / f"{own}_{setting}.csv"
            np.savetxt(
                file, noise(8, 1), delimiter=",", header=",".join(names), comments=""
            )
            (folder / f"._{file.name}").write_bytes(b"\0")


def write_hust_gearbox(folder: Path) -> None:
    for own in "HBM":
        file = folder / f"{own}_20_1.txt"
        rows = "\n".join("\t".join(map(str, row)) for row in noise(5, 2))
        file.write_text(f"Made by a program\nTime\tSpeed\tX\tY\tZ\n{rows}\n")
    (folder / "H_VS_0_40_0Hz.txt").write_text("varying\n")


def write_uconn(folder: Path) -> None:
    values = np.random.default_rng(3).normal(size=(1000, 936))
    io.savemat(
        folder / "DataForClassification_TimeDomain.mat", {"AccTimeDomain": values}
    )


MADE: dict[str, Callable[[Path], None]] = {
    "hust_gearbox": write_hust_gearbox,
    "mcc5_thu": write_mcc5_thu,
    "phm2009": write_phm2009,
    "seu": write_seu,
    "uconn": write_uconn,
}
