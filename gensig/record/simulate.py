"""One record: from a row of the plan to arrays and values, depending on the configuration and the row alone."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.dataset.folder.manifest import identity_hash
from gensig.errors import SimulationError
from gensig.operation.options import operating_signals
from gensig.record.inputs import (
    MISSING,
    record_system,
    row_clean,
    row_healthy_twin,
    row_instrument,
    row_noisy,
    row_run,
    row_shaft_signals,
    row_values,
    shaken,
    twin_start,
)
from gensig.sensing.chain import Sensing, detectability
from gensig.sensing.instrument import Instrument
from gensig.systems.lead_in import simulate_with_lead_in
from gensig.systems.mesh_signals import mesh_signals
from gensig.systems.pair_machine import CleanRecord, PairMachine, Run
from gensig.systems.shaft_sensors import SWITCHES
from gensig.units import from_si
from gensig.version import __version__

Array = NDArray[np.float64]


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
    made: dict[tuple[tuple[str, float], ...], PairMachine] = {}
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
    asked = config["dataset"]["store_detectability"] or config["dataset"]["store_healthy_twin"]
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
    system: PairMachine,
    row: Mapping[str, Any],
    twin: TwinKey,
    result: CleanRecord | SimulationError,
    sound: CleanRecord | SimulationError | None,
) -> Record:
    """Path, sensor, noise, labels and result columns of one row; ``sound`` is the same record without its faults."""
    sensing, instrument = system.sensing, row_instrument(config, system, row)
    n_sensors, n_samples = len(sensing.channel_names), round(system.operating.duration * sensing.sampling_rate)
    measured = None if isinstance(result, SimulationError) else row_clean(config, row, instrument, result.acceleration)
    noise_power = None if measured is None else _noise_power(sensing, twin, instrument, measured)
    healthy: Array | SimulationError | None = None
    if config["dataset"]["store_healthy_twin"]:
        healthy = _healthy_twin(config, row, twin, instrument, sound)
    problem = next((one for one in (result, noise_power, healthy) if isinstance(one, SimulationError)), None)
    if (
        problem is not None
        or not isinstance(result, CleanRecord)
        or not isinstance(noise_power, np.ndarray)
        or measured is None
    ):
        source = np.full((len(sensing.channels), n_samples), MISSING)
        noisy = clean = np.full((n_sensors, n_samples), MISSING)
        healthy = None if healthy is None else clean
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
        wanted = config["dataset"]["store_detectability"] and sensing.has_white_noise
        if wanted and isinstance(sound, CleanRecord):
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
    if isinstance(healthy, np.ndarray):
        signals["healthy_twin"] = healthy.astype(np.float32)
    if config["dataset"]["store_source"]:
        signals["acceleration_source"] = source.astype(np.float32)
    if config["dataset"]["store_operating"]:
        angle = np.full(n_samples, MISSING) if isinstance(result, SimulationError) else result.shaft_angle
        signals |= operating_signals(system.operating, sensing.sampling_rate, angle, system.load_exponent)
    signals |= row_shaft_signals(config, system, row, result if isinstance(result, CleanRecord) else None)
    if config["dataset"]["store_mesh_state"]:
        signals |= mesh_signals(result.mesh if isinstance(result, CleanRecord) else None, n_samples, system.most_pairs)
    columns = {key: value for key, value in row.items() if key not in ("shard", "row")}
    return Record(signals=signals, values={**columns, **told})


def _noise_power(sensing: Sensing, twin: TwinKey, instrument: Instrument, signal: Array) -> Array | SimulationError:
    """Mean square of the noise that a signal gets, (sensor,)."""
    if sensing.snr is None:
        return np.zeros(len(signal))
    reference = _TWINS[twin] if sensing.snr_reference == "healthy_twin" else instrument.power(signal)
    return reference if isinstance(reference, SimulationError) else reference * sensing.noise_factor(sensing.snr)


def _healthy_twin(
    config: Mapping[str, Any],
    row: Mapping[str, Any],
    twin: TwinKey,
    instrument: Instrument,
    sound: CleanRecord | SimulationError | None,
) -> Array | SimulationError | None:
    """What the sensors report of the same record without its faults; nothing in it depends on the fault."""
    if not isinstance(sound, CleanRecord):
        return sound
    clean = instrument.measure(sound.acceleration)
    power = _noise_power(instrument.sensing, twin, instrument, clean)
    return power if isinstance(power, SimulationError) else row_healthy_twin(config, row, instrument, clean, power)


def signal_shapes(config: Mapping[str, Any], system: PairMachine) -> dict[str, tuple[int, ...]]:
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
    if dataset["store_healthy_twin"]:
        shapes["healthy_twin"] = (n_channels, n_samples)
    if dataset["store_source"]:
        shapes["acceleration_source"] = (len(system.sensing.channels), n_samples)
    if dataset["store_operating"]:
        shapes |= {"shaft_speed": (n_samples,), "torque_set": (n_samples,)}
    shapes |= {name: (n_samples,) for key, name in SWITCHES.items() if dataset[key]}
    if dataset["store_mesh_state"]:
        shapes |= {name: values.shape for name, values in mesh_signals(None, n_samples, system.most_pairs).items()}
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
            twin = replace(run, faults=(), tell_mesh=False, start=twin_start(config, run.system, row))
            wanted.setdefault(key, twin)
            if not run.faults and run.start == twin.start:
                among[key] = place
    further = [key for key in wanted if key not in among]
    return among | {key: len(runs) + k for k, key in enumerate(further)}, [wanted[key] for key in further]
