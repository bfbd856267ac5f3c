"""A small data set, made the way generation makes one, without any physics."""

import json

import h5py
import numpy as np

from gensig.dataset.folder.beginning import create_folder
from gensig.dataset.folder.closing import finalize
from gensig.dataset.folder.layout import shard_path
from gensig.dataset.folder.manifest import identity_hash, record_shards
from gensig.dataset.folder.verify import verify
from gensig.dataset.plan import Plan, record_ids, shard_rows
from gensig.dataset.splitting.splits import SUBSETS
from gensig.dataset.storage.atomic import sha256_file
from gensig.dataset.storage.checksums import accept_edits
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
FAULT_COLUMNS = ("faults_json", "severity", "fault_gear", "fault_tooth")
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
    n_records=36,
    records_per_shard=10,
    n_units=6,
    n_classes=3,
):
    shard, row = shard_rows(n_records, records_per_shard)
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


def whole_conditions(n_records=12, **columns):
    """A plan of one shard whose conditions each hold a record of every class on one unit."""
    plan = make_plan(n_records=n_records, records_per_shard=n_records)
    conditions = np.array([f"c{index // len(CLASSES)}" for index in range(n_records)])
    return Plan(columns={**plan.columns, "condition_id": conditions, **columns})


def row_of(plan, index, *, status="ok"):
    """Signals and values of one record; columns of faults that the plan has are the plan's."""
    record = plan.record(index)
    label = int(record["label"])
    faults = ("[]", 0.0, "", -1), ('[{"kind": "crack"}]', 0.25, "pinion", 3)
    fault = faults[label > 0]
    rng = np.random.default_rng(index)
    signals = {
        "acceleration": rng.normal(size=(2, 200)).astype(np.float32),
        "fault_multihot": np.eye(3, dtype=np.int8)[label],
        "signal_power": np.array([1.0, 2.0]),
        "noise_power": np.array([0.1, 0.2]),
    }
    drawn = {
        name: value for name, value in record.items() if name not in ("shard", "row")
    }
    values = {
        **dict(zip(FAULT_COLUMNS, fault, strict=True)),
        "start_tooth_pinion": 1,
        "start_tooth_wheel": 2,
        "start_phase": 0.5,
        "speed_rpm": 1800.0 + index,
        "speed_set_rpm": 1800,
        "torque_nm": 20.0,
        "mesh_frequency_hz": 690.0,
        "snr_db": float("nan"),
        "status": status,
        **drawn,
    }
    return signals, values


def writer_of(path, n_records=1, **changes):
    """The writer of a small shard; keywords replace its declaration."""
    given = {
        "signals": SIGNALS,
        "params": ["crack_depth_mm"],
        "attributes": ATTRIBUTES,
    }
    return ShardWriter(path, n_records=n_records, **(given | changes))


def trust(folder):
    """Make every sha256 and size in a folder fit its files, as only a stranger would."""
    manifest = json.loads((folder / "manifest.json").read_text())
    for index, entry in enumerate(manifest["shards"]):
        path = shard_path(folder, index)
        entry |= {"sha256": sha256_file(path), "bytes": path.stat().st_size}
    digests = {name: sha256_file(folder / name) for name in manifest["files"]}
    manifest["files"] = digests
    (folder / "manifest.json").write_text(json.dumps(manifest))
    (folder / "SHA256SUMS").unlink()
    accept_edits(folder)


def forge(folder, shard, change):
    """Change a shard, make every sha256 and size agree, and return the problems found."""
    with h5py.File(shard_path(folder, shard), "r+") as file:
        change(file)
    trust(folder)
    return "\n".join(verify(folder).problems)


def setting(name, at, value):
    """A change of values of a data set."""
    return lambda file: file[name].__setitem__(at, value)


def write_shard(
    path,
    plan,
    shard=0,
    *,
    failed=None,
    clean=False,
    twin=False,
    **changes,
):
    """With ``clean``, every record's signal is stored a second time as the one without noise, at
    half its size. With ``twin``, as that of its healthy twin, at a quarter."""
    rows = plan.rows(shard)
    stored = {}
    if clean:
        stored["acceleration_clean"] = 2
    if twin:
        stored["healthy_twin"] = 4
    if stored:
        changes["signals"] = SIGNALS | dict.fromkeys(stored, (2, 200))
    writer = writer_of(path, len(rows), **changes)
    with writer:
        for row, index in enumerate(rows.tolist()):
            status = "failed" if index == failed else "ok"
            signals, values = row_of(plan, index, status=status)
            if index != failed:
                for name, part in stored.items():
                    signals[name] = signals["acceleration"] / part
            if index == failed:
                del signals["acceleration"]
            writer.write(row, signals, values)
    return writer


def build(
    out,
    plan,
    *,
    shards=None,
    close=True,
    failed=None,
    clean=False,
    twin=False,
    figures=False,
    labelled=False,
    seed=7,
    **storage,
):
    """A data-set folder; fewer shards or close=False make an interrupted one.

    With ``labelled``, shards name their data set and number, as gensig writes them; without, they
    are those of an older version.
    """
    config = CONFIG | {"seed": seed}
    create_folder(
        out,
        config=config,
        overrides=[f"seed={seed}"],
        plan=plan,
        seed=seed,
        generator_version="0.1.0",
    )
    for shard in shards if shards is not None else range(plan.n_shards):
        if labelled:
            identity = identity_hash(config, "0.1.0")
            storage["attributes"] = ATTRIBUTES | {"identity": identity}
            storage["shard_index"] = shard
        writer = write_shard(
            shard_path(out, shard),
            plan,
            shard,
            failed=failed,
            clean=clean,
            twin=twin,
            **storage,
        )
        record_shards(out, {shard: writer.entry})
    if close:
        finalize(out, figures=figures)
    return out


def sides(table, plan, column):
    """Values of a plan column in train, validation and test."""
    ids = plan.columns["record_id"]
    record = np.argsort(ids)[np.searchsorted(np.sort(ids), table.record_id)]
    values = plan.columns[column][record]
    return [values[table.subset == subset] for subset in SUBSETS]
