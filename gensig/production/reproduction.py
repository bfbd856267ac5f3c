"""Records of a finished data set made once more from their recorded parameters."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Array, Integers
from gensig.dataset.folder.environment import environment
from gensig.dataset.folder.failures import without_numbers
from gensig.dataset.folder.joining import joined_folder, refuse_implants
from gensig.dataset.folder.layout import PLAN, Manifest, shard_path
from gensig.dataset.plan import Plan, read_plan
from gensig.dataset.schema import SCALES, stored_reason
from gensig.dataset.storage.guard import open_shard, read_rows
from gensig.dataset.storage.quantization import quantized, read_signal
from gensig.errors import ConfigError, DatasetError, SimulationError
from gensig.options.configuration import Configuration
from gensig.record.inputs import InputReader, simulate_motions
from gensig.record.simulate import Record, simulate_record, simulate_records

ACCEPTED = 1e-6  # of a record's RMS, where the processor or a library is another
# facts of an environment that bits may depend on
DECIDING = ("cpu_model", "python", "numpy", "scipy", "numba")
BLOCK = 16  # records simulated at a time


@dataclass(frozen=True, slots=True, kw_only=True)
class Reproduction:
    """Comparison of records with those made once more.

    Parameters
    ----------
    n_records : int          records made
    n_equal : int            records with the same bits
    n_failed : int           records that failed both times for the same reason, without signal
    largest : float          largest difference of a sample over its channel's RMS; inf where only
                             one of both failed
    worst : str              the record with that difference, '' when all are equal
    n_refused : int          records that differ by more than is accepted
    other : dict             differing facts of the environment: recorded and present value
    """

    n_records: int
    n_equal: int
    n_failed: int
    largest: float
    worst: str
    n_refused: int
    other: dict[str, tuple[str, str]]


def reproduce(folder: Path, records: int | Sequence[str]) -> Reproduction:
    """Simulate records of a data set and compare their samples with those on disk.

    ``records`` are so many, spread over the set, or those of some ids or numbers.

    In the environment that made the data set every bit must agree. On another processor, or with
    other versions of the libraries, a difference of ``ACCEPTED`` of the record's RMS is accepted,
    and one count more where samples are stored as counts.

    Raises
    ------
    DatasetError    for a folder of another version of gensig, changed, or not finished
    ConfigError     for a record that the set does not have
    """
    manifest, reader, plan = _finished(folder)
    chosen = _chosen(folder, plan, records)
    here = environment()
    recorded = {name: str(manifest.environment.get(name, "")) for name in DECIDING}
    other = {
        name: (recorded[name], str(here[name]))
        for name in DECIDING
        if recorded[name] != str(here[name])
    }
    differences: dict[str, float] = {}
    refused, n_failed = 0, 0
    for start in range(0, len(chosen), BLOCK):
        rows = [plan.record(int(index)) for index in chosen[start : start + BLOCK]]
        for row, record in zip(rows, simulate_records(reader, rows), strict=True):
            difference, count = _difference(folder, row, record)
            n_failed += difference == 0.0 and record.values.get("status") == "failed"
            if difference > 0.0:
                differences[str(row["record_id"])] = difference
                refused += not other or difference > ACCEPTED + count
    worst = max(differences, key=lambda name: differences[name], default="")
    return Reproduction(
        n_records=len(chosen),
        n_equal=len(chosen) - len(differences) - n_failed,
        n_failed=n_failed,
        largest=differences.get(worst, 0.0),
        worst=worst,
        n_refused=refused,
        other=other,
    )


def recorded_row(folder: Path, record: str) -> tuple[InputReader, dict[str, Any]]:
    """Reader of a data set and the row of one record, by its number or its id."""
    _, reader, plan = _finished(folder)
    return reader, plan.record(_position(folder, plan, record, flag="--record"))


def _chosen(folder: Path, plan: Plan, records: int | Sequence[str]) -> Integers:
    """Positions in the plan of so many records or of some, ascending, each once."""
    if isinstance(records, int):
        n_made = min(records, plan.n_records)
        places = np.linspace(0, plan.n_records - 1, n_made).round()
    else:
        places = np.array(
            [_position(folder, plan, record, flag="--records") for record in records]
        )
    return np.unique(places.astype(np.int64))


def _position(folder: Path, plan: Plan, record: str, *, flag: str) -> int:
    """Position in the plan of a record's id or number."""
    ids = plan.columns["record_id"].tolist()
    if record in ids:
        return int(ids.index(record))
    if record.isdecimal() and int(record) < plan.n_records:
        return int(record)
    raise ConfigError(
        f"{flag} {record}: {folder} has records 0 to {plan.n_records - 1}, "
        f"ids {ids[0]} to {ids[-1]}"
    )


def simulate_twin(reader: InputReader, row: Mapping[str, Any]) -> Record:
    """The record without its faults: same unit, condition, start and noise, severity zero.

    The original less its twin is the residual of the fault, exact but for the rounding of stored
    samples.

    Raises
    ------
    SimulationError    where the original or the twin does not stay finite
    """
    original = simulate_record(reader, row)
    sham = InputReader(reader.config.with_keys("plan", sham=True))
    twin = simulate_record(sham, row)
    for record in (original, twin):
        if record.values.get("status") == "failed":
            raise SimulationError(
                f"record {row['record_id']} failed: {record.values['status_reason']}"
            )
    signals = dict(twin.signals)
    sound: dict[str, Any] = {
        "severity": 0.0,
        "faults_json": "[]",
        "fault_gear": "",
        "fault_tooth": -1,
    }
    if not np.array_equal(signals["noise_power"], original.signals["noise_power"]):
        # noise follows the record, so that the twin alone would have another
        inputs = sham.inputs(row)
        (healthy,) = simulate_motions([inputs])
        if isinstance(healthy, SimulationError):
            raise healthy
        signals["noise_power"] = original.signals["noise_power"]
        noisy, conversion = inputs.noisy(
            inputs.clean(healthy.acceleration), signals["noise_power"]
        )
        signals["acceleration"] = noisy.astype(np.float32)
        sound |= conversion
    return Record(signals=signals, values={**twin.values, **sound})


def _finished(folder: Path) -> tuple[Manifest, InputReader, Plan]:
    manifest, config = joined_folder(folder)
    refuse_implants(folder, config)
    if not manifest.is_complete:
        raise DatasetError(
            f"{folder} is incomplete; run `gensig resume {folder}` first"
        )
    return manifest, InputReader(Configuration(config)), read_plan(folder / PLAN)


def _difference(
    folder: Path, row: Mapping[str, Any], record: Record
) -> tuple[float, float]:
    """Largest difference of a sample over the RMS of its channel, and one count on that scale."""
    path, position = shard_path(folder, int(row["shard"])), int(row["row"])
    largest, count = 0.0, 0.0
    with open_shard(path, folder=folder) as file:
        failed = str(read_rows(file["status"])[position]) == "failed"
        if failed != (record.values.get("status") == "failed"):
            return np.inf, 0.0
        if failed:
            made_reason = without_numbers(stored_reason(record.values["status_reason"]))
            reason = str(read_rows(file["status_reason"])[position])
            if made_reason != without_numbers(reason):
                return np.inf, 0.0
            return 0.0, 0.0
        for name, scale_name in SCALES.items():
            if name not in file:
                continue
            stored, made = read_signal(file, name, position), record.signals[name]
            if file[name].dtype.kind == "i":
                counts, scale = quantized(made)
                wide = np.multiply(counts, scale[:, None], dtype=np.float64)
                made = wide.astype(np.float32)
                stored_scale = np.asarray(file[scale_name][position])
                count = float(np.max(stored_scale / _rms(stored)))
            if _sha256(stored) != _sha256(made):
                wide = stored.astype(np.float64)
                difference = np.max(np.abs(wide - made) / _rms(wide)[:, None])
                largest = max(largest, float(difference))
        for name, values in record.signals.items():
            if name in file and name not in SCALES:
                largest = max(largest, _other_difference(file[name][position], values))
    return largest, count


def _other_difference(stored: NDArray[Any], made: NDArray[Any]) -> float:
    """Largest difference of other arrays over the RMS of their values.

    Infinite where whole numbers differ.
    """
    made = made.astype(stored.dtype)
    is_whole = stored.dtype.kind in "iu"
    if np.array_equal(stored, made, equal_nan=not is_whole):
        return 0.0
    if is_whole:
        return np.inf
    wide = stored.astype(np.float64).reshape(1, -1)
    return float(np.max(np.abs(wide - made.reshape(1, -1)) / _rms(wide)))


def _rms(signal: NDArray[Any]) -> Array:
    """RMS of each channel, (channel,); one of zeros counts as 1."""
    level = np.sqrt(np.mean(np.square(signal, dtype=np.float64), axis=1))
    return np.where(level > 0.0, level, 1.0)


def _sha256(samples: NDArray[np.float32]) -> str:
    content = np.ascontiguousarray(samples, dtype="<f4").tobytes()
    return hashlib.sha256(content).hexdigest()
