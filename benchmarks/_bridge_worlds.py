"""Simulated worlds: the set of a training, other worlds to judge in, and a randomised set."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from benchmarks._realism_sets import kept
from gensig.dataset.reader import Dataset

# The plan of quickstart in version 0.9, and two sound records of each machine, which are no
# examples, at conditions of their own.
CROSSED = (
    "plan.n_units=40",
    "plan.machines=crossed",
    "plan.fault_gear=as_given",
    "plan.n_reference=2",
)
BASE = (
    "experiment=quickstart",
    *CROSSED,
    "plan.n_gearboxes=8",
    "operating.duration_s=0.5",
)
STORED = ("dataset.store_source=true", "dataset.store_healthy_twin=true")
HOUSING = (*BASE, "sensing=housing")
SOURCE = (*HOUSING, *STORED)  # re-draws need what is stored; it changes no sample
OTHER_SENSORS = (
    "sensing.path.natural_frequency_hz=[150,6000]",
    "sensing.sensor.mounted_resonance_hz=9000",
)  # assumed
HARD = (
    "sensing=machine",
    "system.supports=bearings",
    "quality.support_damping_ratio_low=0.01",
    "quality.support_damping_ratio_high=0.1",
    "quality.iso1328_grade=7",
)
WORLDS = {
    "paths": (*HOUSING, "seed=1"),
    "sensors": (*HOUSING, "seed=3", *OTHER_SENSORS),
    "machines": (*BASE, *HARD, "seed=2", *OTHER_SENSORS),
}
# The worlds have five sets of gears each. Beside them: every unit with gears and a housing of its
# own, and units at one speed and one load, within 1 and 10 %, as their sound records are.
OWN_GEARS = ("plan.machines=separate", "plan.n_gearboxes=null")
POINT = {
    "operating.speed_rpm": "{distribution: uniform, low: 1782, high: 1818}",
    "operating.torque_nm": "{distribution: uniform, low: 22.5, high: 27.5}",
}
ONE_POINT = (
    "plan.vary={" + ", ".join(f"{key}: {value}" for key, value in POINT.items()) + "}",
)
BESIDE = {
    **{
        f"{name}, own gears": (*words, *OWN_GEARS, "seed=21")
        for name, words in WORLDS.items()
    },
    **{f"{name}, one point": (*words, *ONE_POINT) for name, words in WORLDS.items()},
}
# Machines of which each has gears and a housing of its own; the worlds have five sets of gears.
MANY = (
    "experiment=quickstart",
    "plan.n_units=150",
    "plan.n_records=600",
    "plan.n_reference=2",
    "plan.fault_gear=as_given",
    "operating.duration_s=0.5",
    *STORED,
)
SEPARATE = (*MANY, "sensing=housing", "seed=11")
SEPARATE_MACHINES = (*MANY, *HARD, "seed=12")
# Randomised training set of gears of the worlds' name plate; nothing else of them is in it. The
# module varies by 1 in 200, since accuracy is drawn once a unit only with a size of the gears.
DRAWN = {
    "gear.normal_module_mm": "{distribution: uniform, low: 1.99, high: 2.01}",
    "operating.speed_rpm": "{distribution: uniform, low: 1000, high: 2600}",
    "operating.torque_nm": "{distribution: uniform, low: 8, high: 44}",
    "sensing.fault_gain": "{distribution: log_uniform, low: 1, high: 4}",
}
BRIDGE = (
    "experiment=bridge",
    "gear=xiamen_23_84",
    "gear.pinion.n_teeth=23",
    "gear.wheel.n_teeth=84",
    "plan.vary={" + ", ".join(f"{key}: {value}" for key, value in DRAWN.items()) + "}",
    "operating.duration_s=0.5",
    "plan.n_units=80",
    "plan.n_records=320",
    "seed=7",
    *STORED,
)
PROTOCOL = "by_unit"


def open_world(
    folder: Path, words: Sequence[str], classes: Sequence[str] = ()
) -> Dataset:
    """The data set of these overrides, made where it is not there yet.

    ``classes`` take the place of those of the words, for instance ``surface_damage`` for
    ``pitting``; none leaves them.
    """
    if classes:
        words = (*words, f"plan.classes=[{','.join(classes)}]")
    return kept(folder, list(words))
