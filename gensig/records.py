"""One record: from a row of the plan to arrays and values, depending on the configuration and the row alone."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.dataset.manifest import identity_hash
from gensig.errors import ConfigError, SimulationError
from gensig.faults.base import Fault
from gensig.faults.registry import read_faults
from gensig.sensing.chain import add_noise, power
from gensig.sensing.manufacturing import Gearbox, Specimen, draw_gearbox, draw_specimen
from gensig.systems.registry import read_system
from gensig.systems.spur_pair import SpurPair, Start
from gensig.units import from_si
from gensig.version import __version__

Array = NDArray[np.float64]

MISSING = float("nan")
# one value for a whole data set: make several data sets to compare others
FIXED_KEYS = (
    "gear.",
    "system.",
    "sensing.sampling_rate_hz",
    "operating.duration_s",
    "plan.",
    "dataset.",
    "executor.",
    "seed",
)


class Stream(IntEnum):
    """Causes of randomness; each has its own stream, so that changing one leaves the others alone."""

    CONDITION = 0
    FAULT = 1
    ORDER = 2
    SPECIMEN = 3
    GEARBOX = 4
    START = 5
    TWIN = 6
    NOISE = 7


def stream(seed: int, cause: Stream, index: int = 0) -> np.random.Generator:
    """Generator of one cause and one index; depends on nothing else."""
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(int(cause), index))))


def read_seed(config: Mapping[str, Any]) -> int:
    """The root seed."""
    return whole_number("seed", config["seed"], at_least=0)


def whole_number(key: str, value: Any, *, at_least: int) -> int:
    """Check a count from a configuration."""
    if isinstance(value, bool) or not isinstance(value, int) or value < at_least:
        raise ConfigError(f"{key} = {value!r} must be a whole number of at least {at_least}")
    return value


def record_system(config: Mapping[str, Any], values: Mapping[str, float]) -> SpurPair:
    """The machine of one record: the configuration with the drawn values put in."""
    own = copy.deepcopy(dict(config))
    for key, value in values.items():
        replace_key(own, key, value)
    return read_system(own)


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """One finished record: arrays by signal name and values by column name, as a shard takes them."""

    signals: dict[str, NDArray[Any]]
    values: dict[str, Any]


def simulate_record(config: Mapping[str, Any], row: Mapping[str, Any]) -> Record:
    """Simulate one row of a plan; a motion that does not stay finite becomes a record marked as failed."""
    seed, index = read_seed(config), int(str(row["record_id"]).lstrip("r"))
    values = {
        key.removeprefix("params/"): float(value)
        for key, value in row.items()
        if key.startswith("params/") and not key.startswith("params/fault.")
    }
    system = record_system(config, values)
    faults = [] if config["plan"]["sham"] else row_faults(row)
    columns = {key: value for key, value in row.items() if key not in ("shard", "row")}
    n_channels = len(system.sensing.channels)
    parts = json.loads(str(row["faults_json"]))
    kinds = {part["kind"] for part in parts} if len(parts) > 1 else set()
    multihot = np.array(
        [
            place == int(row["label"]) or config["classes"][name]["kind"] in kinds
            for place, name in enumerate(config["plan"]["classes"])
        ],
        dtype=np.int8,
    )
    try:
        clean, noise_power, result = _simulate_clean(config, system, faults, row)
    except SimulationError as error:
        n_samples = round(system.operating.duration * system.sensing.sampling_rate)
        clean, noise_power = np.full((n_channels, n_samples), MISSING), np.full(n_channels, MISSING)
        result = {"status": "failed", "status_reason": str(error), "speed_rpm": MISSING, "mesh_frequency_hz": MISSING}
    noisy = add_noise(clean, noise_power, stream(seed, Stream.NOISE, index))
    signals: dict[str, NDArray[Any]] = {
        "acceleration": noisy.astype(np.float32),
        "fault_multihot": multihot,
        "signal_power": power(clean),
        "noise_power": noise_power,
    }
    if config["dataset"]["store_clean"]:
        signals["acceleration_clean"] = clean.astype(np.float32)
    return Record(signals=signals, values={**columns, **result})


def row_faults(row: Mapping[str, Any]) -> list[Fault]:
    """Faults of one row of a plan."""
    return [fault for part in json.loads(str(row["faults_json"])) for fault in read_faults(part, "faults_json")]


def _simulate_clean(
    config: Mapping[str, Any], system: SpurPair, faults: list[Fault], row: Mapping[str, Any]
) -> tuple[Array, Array, dict[str, Any]]:
    """Clean accelerations, noise power by channel, and the result columns."""
    specimen, gearbox = _unit(config, system, row)
    start = Start(
        tooth_pinion=int(row["start_tooth_pinion"]),
        tooth_wheel=int(row["start_tooth_wheel"]),
        phase=float(row["start_phase"]),
    )
    record = system.simulate(faults, start=start, specimen=specimen, gearbox=gearbox)
    if system.sensing.snr is None:
        noise_power = np.zeros(len(system.sensing.channels))
    else:
        if system.sensing.snr_reference == "healthy_twin":
            reference = _twin_power(config, system, row)
        else:
            reference = power(record.acceleration)
        noise_power = reference * 10.0 ** (-system.sensing.snr / 10.0)
    speed_rpm = from_si("speed_rpm", record.mean_speed)
    return (
        record.acceleration,
        noise_power,
        {
            "speed_rpm": speed_rpm,
            "mesh_frequency_hz": speed_rpm / 60.0 * system.pair.pinion.n_teeth,
            "contact_loss_fraction": record.contact_loss_fraction,
        },
    )


_TWINS: dict[tuple[str, str], Array] = {}


def forget_twins() -> None:
    """Drop what is kept of healthy twins, so that a timing counts them."""
    _TWINS.clear()


def _twin_power(config: Mapping[str, Any], system: SpurPair, row: Mapping[str, Any]) -> Array:
    """Power by channel of the healthy twin of a unit at a condition, from a start of its own; the last one is kept."""
    key = (identity_hash(dict(config), __version__), str(row["condition_id"]))
    if key not in _TWINS:
        rng = stream(read_seed(config), Stream.TWIN, int(str(row["condition_id"]).rpartition("-")[2]))
        pair = system.pair
        start = Start(
            tooth_pinion=int(rng.integers(pair.pinion.n_teeth)),
            tooth_wheel=int(rng.integers(pair.wheel.n_teeth)),
            phase=float(rng.random()),
        )
        specimen, gearbox = _unit(config, system, row)
        twin = system.simulate(start=start, specimen=specimen, gearbox=gearbox)
        _TWINS.clear()
        _TWINS[key] = power(twin.acceleration)
    return _TWINS[key]


def _unit(config: Mapping[str, Any], system: SpurPair, row: Mapping[str, Any]) -> tuple[Specimen, Gearbox]:
    """Specimen and gearbox of a row, drawn from their own streams."""
    seed, quality = read_seed(config), system.quality
    specimen, gearbox = (int(str(row[name]).rpartition("-")[2]) for name in ("specimen_id", "gearbox_id"))
    return (
        draw_specimen(stream(seed, Stream.SPECIMEN, specimen), system.pair.pinion, system.pair.wheel, quality),
        draw_gearbox(
            stream(seed, Stream.GEARBOX, gearbox), len(system.sensing.channels), quality, system.sensing.gain_scatter
        ),
    )


def replace_key(config: dict[str, Any], key: str, value: float) -> None:
    """Set a dotted key that must exist and hold a number."""
    if key.startswith(FIXED_KEYS):
        raise ConfigError(f"plan.vary: '{key}' is one value for a whole data set; give several with -m instead")
    *parents, leaf = key.split(".")
    node: Any = config
    for name in parents:
        node = node.get(name) if isinstance(node, dict) else None
    if not isinstance(node, dict) or leaf not in node or isinstance(node[leaf], dict | list | str | bool):
        raise ConfigError(f"plan.vary: '{key}' is no key of the configuration that holds a number")
    node[leaf] = int(value) if isinstance(node[leaf], int) and float(value).is_integer() else value
