"""A data set in memory with the interface of `gensig.dataset.reader.Dataset`.

The signal is a mesh tone with impulses once a turn.
"""

import json
from pathlib import Path

import numpy as np

from gensig.errors import DatasetError

N_TEETH = {"n_teeth_pinion": 23, "n_teeth_wheel": 84}
CLASSES = ("healthy", "crack", "pitting", "missing_tooth")
NAMES = (*CLASSES, "wear")
IMPULSE = dict(zip(NAMES, (0.0, 1.0, 1.8, 5.0, 3.0), strict=True))
CARRIER_HZ = dict(zip(NAMES, (4000.0, 3000.0, 6000.0, 4500.0, 1500.0), strict=True))


class FakeDataset:
    """Records are drawn from their seed: nothing is stored, and any process reads the same."""

    def __init__(
        self,
        *,
        n_units=8,
        records_per_unit=8,
        classes=CLASSES,
        n_channels=1,
        duration=0.25,
        sampling_rate=12800.0,
        strength=1.0,
        noise=0.5,
        seed=0,
        twins=False,
        sham=False,
    ):
        self.folder = Path("fake")
        self.n_records = n = n_units * records_per_unit
        self.sampling_rate = sampling_rate
        self.class_names = tuple(classes)
        self.channel_names = tuple(f"channel_{index}" for index in range(n_channels))
        self.attributes = {"schema_version": 1, "sampling_rate_hz": sampling_rate}
        self.attributes |= N_TEETH
        self.attributes["config_json"] = json.dumps({"plan": {"sham": sham}})
        self.signal_names = ["acceleration", "healthy_twin"][: 1 + twins]
        self.gear_names = ["pinion", "wheel"]
        self.protocols = ("by_unit", "random_window_leaky")
        few = "the plan has 1 set of gears, and at least 4 are needed"
        self.left_out = {"cross_specimen": few, "new_machine": few}
        self.usable = np.ones(n, dtype=bool)
        self.sham, self.strength, self.noise, self.seed = sham, strength, noise, seed
        self.n_samples = round(duration * sampling_rate)
        rng = np.random.default_rng(seed)
        unit = np.repeat(np.arange(n_units), records_per_unit)
        label = np.arange(n) % len(classes)
        self.columns = {
            "record_id": np.array([f"r{index:05d}" for index in range(n)]),
            "label": label,
            "label_name": np.array(self.class_names)[label],
            "severity": np.where(label > 0, rng.choice([0.3, 0.6, 1.0], n), 0.0),
            "unit_id": np.array([f"u{index:02d}" for index in unit]),
            "speed_rpm": rng.choice([1200.0, 1800.0], n) * rng.uniform(0.99, 1.01, n),
            "unit_gain": rng.uniform(0.7, 1.4, n_units)[unit],
        }

    @property
    def column_names(self):
        return list(self.columns)

    def column(self, name):
        return self.columns[name]

    def n_teeth(self, gear):
        name = f"n_teeth_{gear}"
        if name in self.columns:
            return np.asarray(self.columns[name])
        if name not in self.attributes:
            raise DatasetError(f"neither column nor attribute {name}")
        return np.full(self.n_records, self.attributes[name])

    def signals(
        self, record_index, start=0, stop=None, channels=None, *, name="acceleration"
    ):
        row = {key: values[record_index] for key, values in self.columns.items()}
        is_twin = self.signal_names.index(name) > 0
        fault = self.class_names[row["label"]]
        height = self.strength * IMPULSE[fault] * (0.5 + row["severity"])
        if self.sham or is_twin:
            height = 0.0
        rng = np.random.default_rng([self.seed, record_index])
        frequency, phase = row["speed_rpm"] / 60, rng.uniform()
        turns = np.arange(self.n_samples) / self.sampling_rate * frequency + phase
        mesh = np.sin(2 * np.pi * 23 * turns) + 0.5 * np.sin(4 * np.pi * 23 * turns)
        since = np.mod(turns, 1.0) / frequency
        ringing = np.exp(-since / 8e-4) * np.sin(2 * np.pi * CARRIER_HZ[fault] * since)
        if is_twin:
            rng = np.random.default_rng([self.seed, record_index, 1])
        n_channels = len(self.channel_names)
        noise = self.noise * rng.standard_normal((n_channels, self.n_samples))
        gain = row["unit_gain"] * np.linspace(1.0, 0.6, n_channels)[:, None]
        signal = (gain * (mesh + height * ringing) + noise).astype(np.float32)
        return signal[channels if channels is not None else slice(None), start:stop]

    def split(self, protocol):
        if protocol not in ("new_machine", "by_unit"):
            fractions = {
                "train": (0, 0.5),
                "validation": (0.5, 0.75),
                "test": (0.75, 1),
            }
            return {
                name: [(record, *part) for record in range(self.n_records)]
                for name, part in fractions.items()
            }
        unit = np.unique(self.columns["unit_id"], return_inverse=True)[1]
        n = unit.max() + 1
        subset = np.digitize(unit, [n // 2, 3 * n // 4])
        return {
            name: [(int(i), 0.0, 1.0) for i in np.flatnonzero(subset == index)]
            for index, name in enumerate(("train", "validation", "test"))
        }


class CompleteDataset(FakeDataset):
    """Two channels, healthy twins and every column that a baseline reads."""

    def __init__(self, **changes):
        super().__init__(**{"duration": 0.5, "n_channels": 2, "twins": True, **changes})
        rng = np.random.default_rng(7)
        n = self.n_records
        self.columns |= {
            "fault_gear": np.where(self.columns["label"] > 0, "wheel", ""),
            "start_tooth_pinion": rng.integers(N_TEETH["n_teeth_pinion"], size=n),
            "start_tooth_wheel": rng.integers(N_TEETH["n_teeth_wheel"], size=n),
            "start_phase": rng.uniform(size=n),
            "integration_error": rng.uniform(1e-5, 1e-4, n),
            "condition_id": np.char.add("c", (np.arange(n) // 4).astype(str)),
            "speed_set_rpm": np.repeat(rng.uniform(1000, 2000, -(-n // 4)), 4)[:n],
        }
