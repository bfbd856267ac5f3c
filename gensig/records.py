"""One record: from a row of the plan to arrays and values, depending on the configuration and the row alone."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.dataset.manifest import identity_hash
from gensig.dynamics.mesh_state import NO_TOOTH, MeshState
from gensig.errors import ConfigError, SimulationError
from gensig.faults.base import Fault
from gensig.faults.registry import read_faults
from gensig.mesh.pair_table import N_PAIRS
from gensig.sensing.chain import detectability
from gensig.sensing.instrument import Instrument, draw_instrument
from gensig.sensing.manufacturing import Gearbox, Specimen, draw_gearbox, draw_specimen
from gensig.systems.lead_in import simulate_with_lead_in
from gensig.systems.registry import read_system
from gensig.systems.spur_pair import CleanRecord, Run, SpurPair, Start
from gensig.units import from_si
from gensig.version import __version__

Array = NDArray[np.float64]

MISSING = float("nan")
# one value for a whole data set: make several data sets to compare others
FIXED_KEYS = (
    "gear.",
    "system.",
    "sensing.sampling_rate_hz",
    "sensing.path.",
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
    PATH = 8
    SENSOR = 9


def stream(seed: int, cause: Stream, index: int = 0) -> np.random.Generator:
    """Generator of one cause and one index; depends on nothing else."""
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed, spawn_key=(int(cause), index))))


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
    varied = {key.partition(".")[0] for key in values}
    own = {name: copy.deepcopy(part) if name in varied else part for name, part in config.items()}
    for key, value in values.items():
        replace_key(own, key, value)
    return read_system(own)


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """One finished record: arrays by signal name and values by column name, as a shard takes them."""

    signals: dict[str, NDArray[Any]]
    values: dict[str, Any]


def simulate_record(config: Mapping[str, Any], row: Mapping[str, Any]) -> Record:
    """Simulate one row of a plan; see ``simulate_records``."""
    return simulate_records(config, [row])[0]


def simulate_records(config: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> list[Record]:
    """Simulate rows of a plan side by side, with the healthy twins that their noise is set by.

    A record's bits do not depend on what it is simulated beside. A motion that does not stay finite becomes a record
    marked as failed.
    """
    made: dict[tuple[tuple[str, float], ...], SpurPair] = {}
    machines = []
    for row in rows:  # the records of a condition share their machine
        drawn = tuple(row_values(row).items())
        if drawn not in made:
            made[drawn] = record_system(config, dict(drawn))
        machines.append(made[drawn])
    runs = [row_run(config, system, row) for system, row in zip(machines, rows, strict=True)]
    keys = _twin_keys(config, rows)
    places, further = _missing_twins(config, runs, rows, keys)
    # the same machines without their faults, to see what the faults change
    asked = config["dataset"]["store_detectability"]
    sound = {place: replace(run, faults=(), tell_mesh=False) for place, run in enumerate(runs) if asked and run.faults}
    results = simulate_with_lead_in([*runs, *further, *sound.values()])
    without = dict(zip(sound, results[len(runs) + len(further) :], strict=True))
    kept = {key: found for key in keys if (found := _TWINS.get(key)) is not None}
    _TWINS.clear()
    _TWINS.update(kept)
    for key, place in places.items():
        twin, sharing = results[place], keys.index(key)
        instrument = row_instrument(config, machines[sharing], rows[sharing])
        _TWINS[key] = (
            twin if isinstance(twin, SimulationError) else instrument.power(instrument.measure(twin.acceleration))
        )
    return [
        _finish(config, system, row, key, result, without.get(place, result) if asked else None)
        for place, (system, row, key, result) in enumerate(zip(machines, rows, keys, results[: len(rows)], strict=True))
    ]


def _finish(
    config: Mapping[str, Any],
    system: SpurPair,
    row: Mapping[str, Any],
    twin: TwinKey,
    result: CleanRecord | SimulationError,
    sound: CleanRecord | SimulationError | None,
) -> Record:
    """Path, sensor, noise, labels and result columns of one row; ``sound`` is the same record without its faults."""
    seed, index = read_seed(config), int(str(row["record_id"]).lstrip("r"))
    sensing, instrument = system.sensing, row_instrument(config, system, row)
    n_sensors, n_samples = len(sensing.channel_names), round(system.operating.duration * sensing.sampling_rate)
    measured = None if isinstance(result, SimulationError) else instrument.measure(result.acceleration)
    noise_power: Array | SimulationError = np.zeros(n_sensors)
    if sensing.snr is not None and measured is not None:
        reference = _TWINS[twin] if sensing.snr_reference == "healthy_twin" else instrument.power(measured)
        factor = sensing.noise_factor(sensing.snr)
        noise_power = reference if isinstance(reference, SimulationError) else reference * factor
    problem = next((one for one in (result, noise_power) if isinstance(one, SimulationError)), None)
    if isinstance(result, SimulationError) or isinstance(noise_power, SimulationError) or measured is None:
        source = np.full((len(sensing.channels), n_samples), MISSING)
        noisy = clean = np.full((n_sensors, n_samples), MISSING)
        noise_power = np.full(n_sensors, MISSING)
        told = {"status": "failed", "status_reason": str(problem), "speed_rpm": MISSING, "mesh_frequency_hz": MISSING}
    else:
        source, clean, speed_rpm = (
            result.acceleration[:, sensing.n_lead :],
            measured,
            from_si("speed_rpm", result.mean_speed),
        )
        noisy, clipped = instrument.record(clean, noise_power, stream(seed, Stream.NOISE, index))
        told = {
            "speed_rpm": speed_rpm,
            "mesh_frequency_hz": speed_rpm / 60.0 * system.pair.pinion.n_teeth,
            "contact_loss_fraction": result.contact_loss_fraction,
            "integration_error": result.integration_error,
            "integration_check": result.integration_check,
            **clipping(system, clipped),
        }
        if isinstance(sound, CleanRecord) and sensing.has_white_noise:
            told["detectability"] = detectability(clean - instrument.measure(sound.acceleration), noise_power)
    signals: dict[str, NDArray[Any]] = {
        "acceleration": noisy.astype(np.float32),
        "fault_multihot": _multihot(config, row),
        "signal_power": instrument.power(clean),
        "noise_power": noise_power,
    }
    if config["dataset"]["store_clean"]:
        signals["acceleration_clean"] = clean.astype(np.float32)
    if config["dataset"]["store_source"]:
        signals["acceleration_source"] = source.astype(np.float32)
    if config["dataset"]["store_shaft_angle"]:
        failed = np.full(n_samples, MISSING)
        signals["shaft_angle"] = failed if isinstance(result, SimulationError) else result.shaft_angle
    if config["dataset"]["store_mesh_state"]:
        signals |= _mesh_signals(result.mesh if isinstance(result, CleanRecord) else None, n_samples)
    columns = {key: value for key, value in row.items() if key not in ("shard", "row")}
    return Record(signals=signals, values={**columns, **told})


def clipping(system: SpurPair, clipped: float) -> dict[str, Any]:
    """Columns on a record of which a share lies outside the converter's range."""
    sensor = system.sensing.sensor
    return {"clipped_fraction": clipped, "clipped": int(sensor is not None and clipped > sensor.max_clipped_fraction)}


def _mesh_signals(mesh: MeshState | None, n_samples: int) -> dict[str, NDArray[Any]]:
    """The mesh state as a shard takes it; of a failed record nothing is known."""
    if mesh is None:
        nobody = np.full((N_PAIRS, n_samples), NO_TOOTH, dtype=np.int16)
        return {
            "mesh_pinion_tooth": nobody,
            "mesh_wheel_tooth": nobody,
            "mesh_load_share": np.full((N_PAIRS, n_samples), MISSING, dtype=np.float32),
            "mesh_force": np.full(n_samples, MISSING, dtype=np.float32),
            "contact_lost": np.zeros(n_samples, dtype=np.int8),
            "fault_engaged": np.zeros(n_samples, dtype=np.int8),
        }
    return {
        "mesh_pinion_tooth": mesh.pinion_tooth,
        "mesh_wheel_tooth": mesh.wheel_tooth,
        "mesh_load_share": mesh.load_share.astype(np.float32),
        "mesh_force": mesh.force.astype(np.float32),
        "contact_lost": mesh.contact_lost.astype(np.int8),
        "fault_engaged": mesh.fault_engaged.astype(np.int8),
    }


def signal_shapes(config: Mapping[str, Any], system: SpurPair) -> dict[str, tuple[int, ...]]:
    """Shape of every array of one record, by signal name."""
    dataset, n_channels = config["dataset"], len(system.sensing.channel_names)
    n_samples = round(system.operating.duration * system.sensing.sampling_rate)
    shapes: dict[str, tuple[int, ...]] = {
        "acceleration": (n_channels, n_samples),
        "fault_multihot": (len(config["plan"]["classes"]),),
        "signal_power": (n_channels,),
        "noise_power": (n_channels,),
    }
    if dataset["store_clean"]:
        shapes["acceleration_clean"] = (n_channels, n_samples)
    if dataset["store_source"]:
        shapes["acceleration_source"] = (len(system.sensing.channels), n_samples)
    if dataset["store_shaft_angle"]:
        shapes["shaft_angle"] = (n_samples,)
    if dataset["store_mesh_state"]:
        shapes |= {name: values.shape for name, values in _mesh_signals(None, n_samples).items()}
    return shapes


def _multihot(config: Mapping[str, Any], row: Mapping[str, Any]) -> NDArray[np.int8]:
    """1 for the record's class and, where its fault is compound, for the classes of its parts."""
    parts = json.loads(str(row["faults_json"]))
    kinds = {part["kind"] for part in parts} if len(parts) > 1 else set()
    present = [
        place == int(row["label"]) or config["classes"][name]["kind"] in kinds
        for place, name in enumerate(config["plan"]["classes"])
    ]
    return np.array(present, dtype=np.int8)


def row_values(row: Mapping[str, Any]) -> dict[str, float]:
    """The drawn values of the machine, by configuration key."""
    return {
        key.removeprefix("params/"): float(value)
        for key, value in row.items()
        if key.startswith("params/") and not key.startswith("params/fault.")
    }


def row_faults(row: Mapping[str, Any]) -> list[Fault]:
    """Faults of one row of a plan."""
    return [fault for part in json.loads(str(row["faults_json"])) for fault in read_faults(part, "faults_json")]


def row_run(config: Mapping[str, Any], system: SpurPair, row: Mapping[str, Any]) -> Run:
    """What one row of a plan asks to simulate."""
    specimen, gearbox = _unit(config, system, row)
    start = Start(
        tooth_pinion=int(row["start_tooth_pinion"]),
        tooth_wheel=int(row["start_tooth_wheel"]),
        phase=float(row["start_phase"]),
    )
    faults = () if config["plan"]["sham"] else tuple(row_faults(row))
    return Run(
        system=system,
        faults=faults,
        start=start,
        specimen=specimen,
        gearbox=gearbox,
        tell_mesh=config["dataset"]["store_mesh_state"],
    )


def row_instrument(config: Mapping[str, Any], system: SpurPair, row: Mapping[str, Any]) -> Instrument:
    """Transfer path and sensors of a row's gearbox, drawn from their own streams."""
    seed, gearbox = read_seed(config), int(str(row["gearbox_id"]).rpartition("-")[2])
    causes = (stream(seed, cause, gearbox) for cause in (Stream.PATH, Stream.SENSOR))
    return draw_instrument(system.sensing, *causes)


TwinKey = tuple[str, str]
_TWINS: dict[TwinKey, Array | SimulationError] = {}


def forget_twins() -> None:
    """Drop what is kept of healthy twins, so that a timing counts them."""
    _TWINS.clear()


def _twin_keys(config: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> list[TwinKey]:
    identity = identity_hash(dict(config), __version__)
    return [(identity, str(row["condition_id"])) for row in rows]


def _missing_twins(
    config: Mapping[str, Any], runs: Sequence[Run], rows: Sequence[Mapping[str, Any]], keys: Sequence[TwinKey]
) -> tuple[dict[TwinKey, int], list[Run]]:
    """The healthy twins that noise needs and nobody has yet: their places among the runs and the further ones given.

    A plan lets the sound record of a group start as the twin does: where that is among the runs, it is the twin.
    """
    wanted: dict[TwinKey, Run] = {}
    among: dict[TwinKey, int] = {}
    for place, (run, row, key) in enumerate(zip(runs, rows, keys, strict=True)):
        sensing = run.system.sensing
        if sensing.snr is not None and sensing.snr_reference == "healthy_twin" and key not in _TWINS:
            twin = replace(run, faults=(), tell_mesh=False, start=_twin_start(config, run.system, row))
            wanted.setdefault(key, twin)
            if not run.faults and run.start == twin.start:
                among[key] = place
    further = [key for key in wanted if key not in among]
    return among | {key: len(runs) + k for k, key in enumerate(further)}, [wanted[key] for key in further]


def _twin_start(config: Mapping[str, Any], system: SpurPair, row: Mapping[str, Any]) -> Start:
    """Where the healthy twin of a unit at a condition starts."""
    rng = stream(read_seed(config), Stream.TWIN, int(str(row["condition_id"]).rpartition("-")[2]))
    return Start(
        tooth_pinion=int(rng.integers(system.pair.pinion.n_teeth)),
        tooth_wheel=int(rng.integers(system.pair.wheel.n_teeth)),
        phase=float(rng.random()),
    )


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
