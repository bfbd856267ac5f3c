"""A small data set, made the way generation makes one, without any physics."""

from pathlib import Path

import numpy as np

from gensig.dataset.folder.beginning import create_folder
from gensig.dataset.folder.layout import shard_path
from gensig.dataset.folder.manifest import finalize, identity_hash, record_shard
from gensig.dataset.plan import Plan, record_ids, shard_places
from gensig.dataset.storage.shard import ShardWriter

CLASSES = ["healthy", "crack", "pitting"]
ATTRIBUTES = {
    "generator_version": "0.1.0",
    "sampling_rate_hz": 1000.0,
    "channel_names": ["pinion_y", "wheel_ü"],
    "channel_units": ["m/s^2", "m/s^2"],
    "class_names": CLASSES,
    "n_teeth_pinion": 23,
    "n_teeth_wheel": 84,
    "usable_band_hz": [10.0, 400.0],
    "config_json": '{"a": 1}',
}
SIGNALS = {
    "acceleration": (2, 200),
    "fault_multihot": (3,),
    "signal_power": (2,),
    "noise_power": (2,),
}
CONFIG = {
    "seed": 7,
    "gear": {"n_teeth": 23},
    "out": "x",
    "executor": {"n_workers": 2},
    "verbosity": 1,
}


def make_plan(
    n_records: int = 36,
    records_per_shard: int = 10,
    n_units: int = 6,
    n_classes: int = 3,
) -> Plan:
    shard, row = shard_places(n_records, records_per_shard)
    index = np.arange(n_records)
    label = index % n_classes
    unit = (index // n_classes) % n_units
    return Plan(
        columns={
            "record_id": record_ids(n_records),
            "shard": shard,
            "row": row,
            "label": label,
            "label_name": np.array(CLASSES)[label],
            "gearbox_id": np.array([f"g{u}" for u in unit]),
            "specimen_id": np.array([f"s{u}" for u in unit]),
            "unit_id": np.array([f"u{u}" for u in unit]),
            "condition_id": np.array([f"c{i % 4}" for i in index]),
            "params/crack_depth_mm": np.where(label == 1, 0.1 * index, np.nan),
        }
    )


def row_of(
    plan: Plan, index: int, *, status: str = "ok"
) -> tuple[dict[str, np.ndarray], dict]:
    """Signals and values of one record."""
    record = plan.record(index)
    label = int(record["label"])
    rng = np.random.default_rng(index)
    signals = {
        "acceleration": rng.normal(size=(2, 200)).astype(np.float32),
        "fault_multihot": np.eye(3, dtype=np.int8)[label],
        "signal_power": np.array([1.0, 2.0]),
        "noise_power": np.array([0.1, 0.2]),
    }
    values = {
        name: value for name, value in record.items() if name not in ("shard", "row")
    } | {
        "faults_json": "[]" if label == 0 else '[{"kind": "crack"}]',
        "severity": 0.0 if label == 0 else 0.25,
        "fault_gear": "" if label == 0 else "pinion",
        "fault_tooth": -1 if label == 0 else 3,
        "start_tooth_pinion": 1,
        "start_tooth_wheel": 2,
        "start_phase": 0.5,
        "speed_rpm": 1800.0 + index,
        "speed_set_rpm": 1800,
        "torque_nm": 20.0,
        "mesh_frequency_hz": 690.0,
        "snr_db": float("nan"),
        "status": status,
    }
    return signals, values


def write_shard(
    path: Path,
    plan: Plan,
    shard: int = 0,
    *,
    failed: int | None = None,
    clean: bool = False,
    **changes,
) -> ShardWriter:
    """With ``clean``, every record's signal is stored a second time as the one without noise, at
    half its size."""
    rows = plan.rows(shard)
    writer = ShardWriter(
        path,
        n_records=len(rows),
        signals=SIGNALS | ({"acceleration_clean": (2, 200)} if clean else {}),
        params=["crack_depth_mm"],
        attributes=changes.pop("attributes", ATTRIBUTES),
        **changes,
    )
    with writer:
        for row, index in enumerate(rows.tolist()):
            signals, values = row_of(
                plan, index, status="failed" if index == failed else "ok"
            )
            if clean and index != failed:
                signals["acceleration_clean"] = signals["acceleration"] / 2
            if index == failed:
                del signals["acceleration"]
            writer.write(row, signals, values)
    return writer


def build(
    out: Path,
    plan: Plan,
    *,
    shards: range | None = None,
    close: bool = True,
    failed: int | None = None,
    clean: bool = False,
    figures: bool = False,
    **storage: str,
) -> Path:
    """A data-set folder; fewer shards or close=False make an interrupted one."""
    identity = identity_hash(CONFIG, "0.1.0")
    create_folder(
        out,
        config=CONFIG,
        overrides=["seed=7"],
        plan=plan,
        identity=identity,
        seed=7,
        generator_version="0.1.0",
    )
    for shard in shards if shards is not None else range(plan.n_shards):
        writer = write_shard(
            shard_path(out, shard), plan, shard, failed=failed, clean=clean, **storage
        )
        record_shard(out, shard, writer.sha256, writer.n_bytes, writer.n_failed)
    if close:
        finalize(out, figures=figures)
    return out
