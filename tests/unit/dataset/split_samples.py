"""A data set that has every protocol, made without any physics."""

import numpy as np

from gensig.dataset.plan import Plan, record_ids, shard_rows

LEAKY = "random_window_leaky"
N_UNITS = 12
N_CLASSES = 3
FAILED = 40  # number of the record that failed
REFERENCES = (0, 39)  # numbers of the reference records
CLASSES = ("healthy", "crack", "pitting")


def every_protocol_plan(n_records=144):
    """Two units share their gears; speed, load, noise and severity vary; two reference records."""
    index = np.arange(n_records)
    condition = index // N_CLASSES
    unit = condition % N_UNITS
    label = index % N_CLASSES
    rng = np.random.default_rng(3)
    shard, row = shard_rows(n_records, 20)
    severity = np.where(label == 0, 0.0, rng.uniform(0.1, 0.9, n_records))
    faults = np.array(["[]", '[{"kind": "crack"}]', '[{"kind": "pitting"}]'])
    return Plan(
        columns={
            "record_id": record_ids(n_records),
            "shard": shard,
            "row": row,
            "label": label,
            "label_name": np.array(CLASSES)[label],
            "gearbox_id": np.array([f"g{number}" for number in unit]),
            "specimen_id": np.array([f"s{number // 2}" for number in unit]),
            "unit_id": np.array([f"u{number}" for number in unit]),
            "condition_id": np.array([f"c{number}" for number in condition]),
            "is_reference": np.isin(index, REFERENCES).astype(int),
            "speed_set_rpm": rng.uniform(1000.0, 2000.0, n_records)[condition],
            "torque_nm": rng.uniform(10.0, 40.0, n_records)[condition],
            "snr_db": rng.uniform(0.0, 30.0, n_records)[condition],
            "severity": severity,
            "faults_json": faults[label],
            "params/crack_depth_mm": np.where(label == 1, 3.0 * severity, np.nan),
        }
    )
