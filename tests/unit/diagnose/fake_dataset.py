"""A data set in memory with the interface of `gensig.dataset.reader.Dataset`: mesh tone plus impulses once a turn."""

import json
from pathlib import Path

import numpy as np

N_TEETH = {"n_teeth_pinion": 23, "n_teeth_wheel": 84}
CLASSES = ("healthy", "crack", "pitting", "missing_tooth")
IMPULSE = {
    "healthy": 0.0,
    "crack": 1.0,
    "pitting": 1.8,
    "missing_tooth": 5.0,
    "wear": 3.0,
}
CARRIER_HZ = {
    "healthy": 4000.0,
    "crack": 3000.0,
    "pitting": 6000.0,
    "missing_tooth": 4500.0,
    "wear": 1500.0,
}


class FakeDataset:
    """Records are drawn from their own seed, so that nothing is stored and any process reads the same."""

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
        self.n_records = n_units * records_per_unit
        self.sampling_rate = sampling_rate
        self.class_names = tuple(classes)
        self.channel_names = tuple(f"channel_{index}" for index in range(n_channels))
        self.attributes = {
            "schema_version": 1,
            "sampling_rate_hz": sampling_rate,
            **N_TEETH,
        }
        self.attributes["config_json"] = json.dumps({"plan": {"sham": sham}})
        self.signal_names = ["acceleration", *(["healthy_twin"] if twins else [])]
        self.sham = sham
        self.protocols = ("by_unit", "random_window_leaky")
        self.left_out = {
            "cross_specimen": "1 specimen_id in the plan, and at least 4 are needed"
        }
        self.usable = np.ones(self.n_records, dtype=bool)
        self.strength, self.noise, self.seed = strength, noise, seed
        self.n_samples = round(duration * sampling_rate)
        rng = np.random.default_rng(seed)
        unit = np.repeat(np.arange(n_units), records_per_unit)
        label = np.arange(self.n_records) % len(classes)
        severity = np.where(label > 0, rng.choice([0.3, 0.6, 1.0], self.n_records), 0.0)
        self.columns = {
            "record_id": np.array([f"r{index:05d}" for index in range(self.n_records)]),
            "label": label,
            "label_name": np.array(self.class_names)[label],
            "severity": severity,
            "unit_id": np.array([f"u{index:02d}" for index in unit]),
            "speed_rpm": rng.choice([1200.0, 1800.0], self.n_records)
            * rng.uniform(0.99, 1.01, self.n_records),
            "unit_gain": rng.uniform(0.7, 1.4, n_units)[unit],
        }

    @property
    def column_names(self):
        return list(self.columns)

    def column(self, name):
        return self.columns[name]

    def signals(
        self, record_index, start=0, stop=None, channels=None, *, name="acceleration"
    ):
        is_twin = self.signal_names.index(name) > 0
        rng = np.random.default_rng([self.seed, record_index])
        time = np.arange(self.n_samples) / self.sampling_rate
        turn = self.columns["speed_rpm"][record_index] / 60
        fault = self.class_names[self.columns["label"][record_index]]
        phase = rng.uniform()
        mesh = np.sin(2 * np.pi * 23 * (turn * time + phase)) + 0.5 * np.sin(
            4 * np.pi * 23 * (turn * time + phase)
        )
        since = np.mod(turn * time + phase, 1.0) / turn
        ringing = np.exp(-since / 8e-4) * np.sin(2 * np.pi * CARRIER_HZ[fault] * since)
        height = (
            self.strength
            * IMPULSE[fault]
            * (0.5 + self.columns["severity"][record_index])
        )
        height = 0.0 if self.sham or is_twin else height
        rng = np.random.default_rng([self.seed, record_index, 1]) if is_twin else rng
        noise = self.noise * rng.standard_normal(
            (len(self.channel_names), self.n_samples)
        )
        gain = (
            self.columns["unit_gain"][record_index]
            * np.linspace(1.0, 0.6, len(self.channel_names))[:, None]
        )
        signal = (gain * (mesh + height * ringing) + noise).astype(np.float32)
        signal = signal if channels is None else signal[channels]
        return signal[:, start:stop]

    def split(self, protocol):
        unit = np.unique(self.columns["unit_id"], return_inverse=True)[1]
        n_units = unit.max() + 1
        subsets = {"train": [], "validation": [], "test": []}
        if protocol == "by_unit":
            bounds = {
                "train": (0, n_units // 2),
                "validation": (n_units // 2, 3 * n_units // 4),
            }
            bounds["test"] = (3 * n_units // 4, n_units)
            for name, (low, high) in bounds.items():
                subsets[name] = [
                    (int(i), 0.0, 1.0)
                    for i in np.flatnonzero((unit >= low) & (unit < high))
                ]
        else:
            for i in range(self.n_records):
                subsets["train"].append((i, 0.0, 0.5))
                subsets["validation"].append((i, 0.5, 0.75))
                subsets["test"].append((i, 0.75, 1.0))
        return subsets


class CompleteDataset(FakeDataset):
    """Two channels, healthy twins and every column that a baseline reads."""

    def __init__(self, **changes):
        super().__init__(**{"duration": 0.5, "n_channels": 2, "twins": True, **changes})
        rng = np.random.default_rng(7)
        self.columns |= {
            "fault_gear": np.where(self.columns["label"] > 0, "wheel", ""),
            "start_tooth_pinion": rng.integers(
                N_TEETH["n_teeth_pinion"], size=self.n_records
            ),
            "start_tooth_wheel": rng.integers(
                N_TEETH["n_teeth_wheel"], size=self.n_records
            ),
            "start_phase": rng.uniform(size=self.n_records),
            "integration_error": rng.uniform(1e-5, 1e-4, self.n_records),
        }
