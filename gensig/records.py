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
from gensig.errors import ConfigError, SimulationError
from gensig.faults.base import Fault
from gensig.faults.registry import read_faults
from gensig.sensing.chain import detectability
from gensig.sensing.instrument import Instrument, draw_instrument
from gensig.sensing.manufacturing import Gearbox, Specimen, draw_gearbox, draw_specimen, with_damping_ratio
from gensig.systems.lead_in import simulate_with_lead_in
from gensig.systems.mesh_signals import mesh_signals
from gensig.systems.nuisances import with_nuisances
from gensig.systems.operation import operating_signals
from gensig.systems.registry import read_system
from gensig.systems.shaft_sensors import SWITCHES, shaft_signals
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
    "sensing.tacho.",
    "sensing.encoder.",
    "operating.duration_s",
    "operating.turns",
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
    NUISANCE = 10
    NUISANCE_RECORD = 11
    DRIFT = 12
    ENCODER = 13
    SUPPORT = 14
    DROPPED = 15
    TACHO = 16


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
    everything = [*runs, *further, *sound.values()]
    results = simulate_with_lead_in(everything)
    last = zip(sound, results[len(runs) + len(further) :], strict=True)
    without = {place: shaken(config, rows[place], runs[place], result) for place, result in last}
    kept = {key: found for key in keys if (found := _TWINS.get(key)) is not None}
    _TWINS.clear()
    _TWINS.update(kept)
    for key, place in places.items():
        sharing = keys.index(key)
        twin = shaken(config, rows[sharing], everything[place], results[place], twin=True)
        instrument = row_instrument(config, machines[sharing], rows[sharing])
        _TWINS[key] = (
            twin if isinstance(twin, SimulationError) else instrument.power(instrument.measure(twin.acceleration))
        )
    own = [shaken(config, row, run, result) for row, run, result in zip(rows, runs, results, strict=False)]
    return [
        _finish(config, system, row, key, result, without.get(place, result) if asked else None)
        for place, (system, row, key, result) in enumerate(zip(machines, rows, keys, own, strict=True))
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
    sensing, instrument = system.sensing, row_instrument(config, system, row)
    n_sensors, n_samples = len(sensing.channel_names), round(system.operating.duration * sensing.sampling_rate)
    measured = None if isinstance(result, SimulationError) else row_clean(config, row, instrument, result.acceleration)
    noise_power: Array | SimulationError = np.zeros(n_sensors)
    if sensing.snr is not None and measured is not None:
        reference = _TWINS[twin] if sensing.snr_reference == "healthy_twin" else instrument.power(measured)
        factor = 10.0 ** (-sensing.snr / 10.0)
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
        noisy, recorded = row_noisy(config, row, instrument, clean, noise_power)
        told = {
            "speed_rpm": speed_rpm,
            "mesh_frequency_hz": speed_rpm / 60.0 * system.pair.pinion.n_teeth,
            "contact_loss_fraction": result.contact_loss_fraction,
            "integration_error": result.integration_error,
            "integration_check": result.integration_check,
            **recorded,
        }
        if isinstance(sound, CleanRecord) and sensing.has_white_noise:
            told["detectability"] = detectability(
                clean - row_clean(config, row, instrument, sound.acceleration), noise_power
            )
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
    if config["dataset"]["store_operating"]:
        angle = np.full(n_samples, MISSING) if isinstance(result, SimulationError) else result.shaft_angle
        signals |= operating_signals(system.operating, sensing.sampling_rate, angle)
    signals |= _shaft_signals(config, system, row, result if isinstance(result, CleanRecord) else None)
    if config["dataset"]["store_mesh_state"]:
        signals |= mesh_signals(result.mesh if isinstance(result, CleanRecord) else None, n_samples)
    columns = {key: value for key, value in row.items() if key not in ("shard", "row")}
    return Record(signals=signals, values={**columns, **told})


def row_clean(config: Mapping[str, Any], row: Mapping[str, Any], instrument: Instrument, acceleration: Array) -> Array:
    """What the sensors of a row put out before noise, their drift included, (sensor, sample) m/s2."""
    measured = instrument.measure(acceleration)
    return measured * instrument.drift(measured.shape[1], _row_stream(config, row, Stream.DRIFT))


def row_noisy(
    config: Mapping[str, Any], row: Mapping[str, Any], instrument: Instrument, clean: Array, noise_power: Array
) -> tuple[Array, dict[str, Any]]:
    """Noise, offset, converter and lost samples of a row, and the columns on what clips and what is lost."""
    noisy, clipped = instrument.record(clean, noise_power, _row_stream(config, row, Stream.NOISE))
    sent, dropped = instrument.sent(noisy, _row_stream(config, row, Stream.DROPPED))
    sensor = instrument.sensing.sensor
    too_many = int(sensor is not None and clipped > sensor.max_clipped_fraction)
    return sent, {"clipped_fraction": clipped, "clipped": too_many, "dropped_fraction": dropped}


def _row_stream(config: Mapping[str, Any], row: Mapping[str, Any], cause: Stream) -> np.random.Generator:
    return stream(read_seed(config), cause, int(str(row["record_id"]).lstrip("r")))


def _shaft_signals(
    config: Mapping[str, Any], system: SpurPair, row: Mapping[str, Any], record: CleanRecord | None
) -> dict[str, NDArray[Any]]:
    """What the sensors on the shafts of a row tell."""
    gearbox = int(str(row["gearbox_id"]).rpartition("-")[2])
    causes = (stream(read_seed(config), Stream.ENCODER, gearbox), _row_stream(config, row, Stream.TACHO))
    return shaft_signals(config["dataset"], system, _row_start(row), record, *causes)


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
    if dataset["store_operating"]:
        shapes |= {"shaft_speed": (n_samples,), "torque_set": (n_samples,)}
    shapes |= {name: (n_samples,) for key, name in SWITCHES.items() if dataset[key]}
    if dataset["store_mesh_state"]:
        shapes |= {name: values.shape for name, values in mesh_signals(None, n_samples).items()}
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
    faults = () if config["plan"]["sham"] else tuple(row_faults(row))
    return Run(
        system=system,
        faults=faults,
        start=_row_start(row),
        specimen=specimen,
        gearbox=gearbox,
        tell_mesh=config["dataset"]["store_mesh_state"],
    )


def _row_start(row: Mapping[str, Any]) -> Start:
    return Start(
        tooth_pinion=int(row["start_tooth_pinion"]),
        tooth_wheel=int(row["start_tooth_wheel"]),
        phase=float(row["start_phase"]),
    )


def row_instrument(config: Mapping[str, Any], system: SpurPair, row: Mapping[str, Any]) -> Instrument:
    """Transfer path and sensors of a row's gearbox, drawn from their own streams."""
    seed, gearbox = read_seed(config), int(str(row["gearbox_id"]).rpartition("-")[2])
    causes = (stream(seed, cause, gearbox) for cause in (Stream.PATH, Stream.SENSOR))
    return draw_instrument(system.sensing, *causes)


def shaken(
    config: Mapping[str, Any],
    row: Mapping[str, Any],
    run: Run,
    result: CleanRecord | SimulationError,
    twin: bool = False,
) -> CleanRecord | SimulationError:
    """A motion with the nuisances of its unit.

    Angles that no tooth tells are drawn for the record; those of a healthy twin for its condition, so that they do not
    depend on which record asks for it first.
    """
    if isinstance(result, SimulationError) or not run.system.sensing.nuisances:
        return result
    seed = read_seed(config)
    own, name = (Stream.TWIN, "condition_id") if twin else (Stream.NUISANCE_RECORD, "record_id")
    place = {key: int(str(row[key]).rpartition("-")[2].lstrip("r")) for key in ("gearbox_id", "specimen_id", name)}
    units = {level: stream(seed, Stream.NUISANCE, place[f"{level}_id"]) for level in ("gearbox", "specimen")}
    return with_nuisances(run, result, units, stream(seed, own, place[name]))


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
    box = draw_gearbox(
        stream(seed, Stream.GEARBOX, gearbox), len(system.sensing.channels), quality, system.sensing.gain_scatter
    )
    return (
        draw_specimen(stream(seed, Stream.SPECIMEN, specimen), system.pair.pinion, system.pair.wheel, quality),
        with_damping_ratio(box, stream(seed, Stream.SUPPORT, gearbox), quality),
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
