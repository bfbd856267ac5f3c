"""A simulated set whose residuals are known, and a machine that carries them."""

import json
import math

import numpy as np

from gensig.dataset.folder.beginning import create_folder
from gensig.dataset.folder.closing import finalize
from gensig.dataset.folder.layout import shard_path
from gensig.dataset.folder.manifest import identity_hash, record_shards
from gensig.dataset.plan import Plan, record_ids, shard_rows
from gensig.dataset.reader import open_dataset
from gensig.dataset.storage.shard import ShardWriter
from gensig.signals.recording import Recording
from gensig.version import __version__

RATE = 10240.0  # Hz, of the simulated set
SPEED = 1200.0  # r/min
TEETH = (23, 46)
N_SAMPLES = 6144  # 12 turns of the pinion, 6 of the wheel
CLASSES = ("healthy", "missing_tooth", "wear")
KNOCK_HZ = 1500.0

CARRIER_RATE = 8192.0
CARRIER_TEETH = (20, 30)
CARRIER_SPEED = 900.0

FAULTS = {
    "healthy": [],
    "missing_tooth": [{"kind": "missing_tooth", "gear": "pinion", "tooth": 3}],
    "wear": [{"kind": "wear", "gear": "pinion", "tooth": "all", "wear_depth_um": 40}],
}


def _mesh(turns, n_teeth, phase):
    harmonics = (
        math.cos(0.7 * k) / k * np.cos(2 * np.pi * k * (n_teeth * turns + phase))
        for k in range(1, 5)
    )
    return sum(harmonics)


def knock(turns, rate, speed_rpm):
    """A decaying tone that begins where a shaft begins a turn."""
    since = np.mod(turns, 1.0) * 60.0 / speed_rpm
    return np.exp(-since / 0.002) * np.sin(2 * np.pi * KNOCK_HZ * since)


def _record(name, unit, rng):
    time = np.arange(N_SAMPLES) / RATE
    turns = SPEED / 60.0 * time
    twin = np.stack([_mesh(turns, TEETH[0], rng.uniform()) for _ in range(2)])
    twin *= 1.0 + 0.1 * unit
    fault = np.zeros_like(twin)
    if name == "missing_tooth":
        fault += knock(turns, RATE, SPEED)
    if name == "wear":
        a_turn = rng.standard_normal(round(RATE * 60.0 / SPEED))
        fault += np.resize(a_turn, N_SAMPLES)
    return twin + fault, twin


def write_pairs(folder, *, twins=True, noise=0.0, classes=CLASSES, n_units=6):
    """A small data set as `gensig generate` would make it, opened."""
    rng = np.random.default_rng(0)
    rows = [(name, unit) for unit in range(n_units) for name in classes]
    names = [name for name, _ in rows]
    units = [f"unit-{unit:04d}" for _, unit in rows]
    shard, row = shard_rows(len(rows), len(rows))
    columns = {
        "record_id": record_ids(len(rows)),
        "shard": shard,
        "row": row,
        "label": np.array([classes.index(name) for name in names]),
        "label_name": np.array(names),
        "faults_json": np.array([json.dumps(FAULTS[name]) for name in names]),
        "severity": np.array([float(name != "healthy") for name in names]),
        "fault_gear": np.array(["pinion" if FAULTS[name] else "" for name in names]),
        "fault_tooth": np.full(len(rows), -1),
        "start_tooth_pinion": np.zeros(len(rows), dtype=int),
        "start_tooth_wheel": np.zeros(len(rows), dtype=int),
        "start_phase": np.zeros(len(rows)),
        "speed_set_rpm": np.full(len(rows), SPEED),
        "torque_nm": np.full(len(rows), 20.0),
        "snr_db": np.full(len(rows), np.nan),
        "gearbox_id": np.array([unit.replace("unit", "gearbox") for unit in units]),
        "specimen_id": np.array([unit.replace("unit", "specimen") for unit in units]),
        "unit_id": np.array(units),
        "condition_id": np.array(units),
    }
    plan = Plan(columns=columns)
    config = {
        "seed": 0,
        "dataset": {"compression": "none"},
        "plan": {"classes": list(classes)},
    }
    identity = identity_hash(config, __version__)
    create_folder(
        folder,
        config=config,
        overrides=[],
        plan=plan,
        seed=0,
        generator_version=__version__,
    )
    signals = {"acceleration": (2, N_SAMPLES), "noise_power": (2,)}
    if twins:
        signals["healthy_twin"] = (2, N_SAMPLES)
    attributes = {
        "identity": identity,
        "generator_version": __version__,
        "sampling_rate_hz": RATE,
        "channel_names": ["pinion_y", "wheel_y"],
        "channel_units": ["m/s^2", "m/s^2"],
        "class_names": list(classes),
        "usable_band_hz": [0.0, 4000.0],
        "n_teeth_pinion": TEETH[0],
        "n_teeth_wheel": TEETH[1],
    }
    writer = ShardWriter(
        shard_path(folder, 0),
        n_records=len(rows),
        signals=signals,
        params=[],
        attributes=attributes,
        shard_index=0,
    )
    with writer:
        for index, (name, unit) in enumerate(rows):
            faulty, twin = _record(name, unit, rng)
            made = {"acceleration": faulty, "noise_power": np.full(2, noise)}
            if twins:
                made["healthy_twin"] = twin
            values = {
                key: value
                for key, value in plan.record(index).items()
                if key not in ("shard", "row")
            }
            values |= {
                "speed_rpm": SPEED,
                "mesh_frequency_hz": SPEED / 60.0 * TEETH[0],
            }
            writer.write(index, made, values)
    record_shards(folder, {0: writer.entry})
    finalize(folder, figures=False)
    return open_dataset(folder)


def carrier(
    seed=0,
    *,
    seconds=8.0,
    wander=0.01,
    teeth=CARRIER_TEETH,
    n_channels=1,
    speed=CARRIER_SPEED,
):
    """A healthy recording of another machine, and the turns of its driving shaft."""
    rng = np.random.default_rng((7, seed))
    n_samples = round(seconds * CARRIER_RATE)
    time = np.arange(n_samples) / CARRIER_RATE
    course = 1.0 + wander * np.sin(2 * np.pi * 0.31 * time + rng.uniform(0, 6))
    turns = np.concatenate([[0.0], np.cumsum(speed / 60.0 * course[1:])]) / CARRIER_RATE
    rows = []
    for _ in range(n_channels):
        tones = sum(
            _mesh(turns * order / teeth[2 * stage], teeth[2 * stage], rng.uniform())
            for stage, order in enumerate(_orders(teeth))
        )
        rows.append(tones + 0.05 * rng.standard_normal(n_samples))
    signal = np.stack(rows)
    recording = Recording(
        sensors=tuple(f"case_{k}" for k in range(n_channels)),
        acceleration=signal - signal.mean(axis=1, keepdims=True),
        sampling_rate=CARRIER_RATE,
    )
    return recording, turns


def _orders(teeth):
    """Mesh orders of the driving shaft, one a stage."""
    orders, ratio = [], 1.0
    for stage in range(len(teeth) // 2):
        orders.append(ratio * teeth[2 * stage])
        ratio *= teeth[2 * stage] / teeth[2 * stage + 1]
    return orders
