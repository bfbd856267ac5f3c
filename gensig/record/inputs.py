"""What a row of a plan asks for: its machine, unit, start and sensors, each drawn from a stream of its own."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping
from enum import IntEnum
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError, SimulationError
from gensig.faults.base import Fault
from gensig.faults.registry import read_faults
from gensig.geometry.gear import Gear
from gensig.record.machines import read_machine
from gensig.sensing.instrument import Instrument, draw_instrument
from gensig.sensing.manufacturing import Gearbox, Quality, Specimen, draw_gearbox, draw_specimen, with_damping_ratio
from gensig.systems.nuisances import with_nuisances
from gensig.systems.pair_machine import CleanRecord, PairMachine, Run, Start
from gensig.systems.shaft_sensors import shaft_signals
from gensig.text import nearest

Array = NDArray[np.float64]
MISSING = float("nan")
# one value for a whole data set: make several data sets to compare others
FIXED_KEYS = (
    "gear.",
    "system.",
    "modification.",
    "strength.",
    "heat.",
    "wear.",
    "life.",
    "mesh.n_slices",
    "mesh.coupling_modules",
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
    HEALTHY_TWIN = 17
    LIFE = 18
    LIFE_HISTORY = 19
    TOOTHED_WHEEL = 20


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


def record_system(config: Mapping[str, Any], values: Mapping[str, float]) -> PairMachine:
    """The machine of one record: the configuration with the drawn values put in."""
    varied = {key.partition(".")[0] for key in values}
    own = {name: copy.deepcopy(part) if name in varied else part for name, part in config.items()}
    for key, value in values.items():
        replace_key(own, key, value)
    return read_machine(own)


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


def row_healthy_twin(
    config: Mapping[str, Any], row: Mapping[str, Any], instrument: Instrument, clean: Array, noise_power: Array
) -> Array:
    """What the sensors of a row report of its machine without faults, with drift, noise and losses of its own.

    ``clean`` (sensor, sample) m/s2 is before drift. No draw is shared with the record: else their difference would be
    free of noise.
    """
    drift, noise, dropped = _row_stream(config, row, Stream.HEALTHY_TWIN).spawn(3)
    noisy, _ = instrument.record(clean * instrument.drift(clean.shape[1], drift), noise_power, noise)
    return instrument.sent(noisy, dropped)[0]


def _row_stream(config: Mapping[str, Any], row: Mapping[str, Any], cause: Stream) -> np.random.Generator:
    return stream(read_seed(config), cause, int(str(row["record_id"]).lstrip("r")))


def row_shaft_signals(
    config: Mapping[str, Any], system: PairMachine, row: Mapping[str, Any], record: CleanRecord | None
) -> dict[str, NDArray[Any]]:
    """What the sensors on the shafts of a row tell."""
    gearbox = int(str(row["gearbox_id"]).rpartition("-")[2])
    causes = (stream(read_seed(config), Stream.ENCODER, gearbox), _row_stream(config, row, Stream.TACHO))
    return shaft_signals(config["dataset"], system, _row_start(row), record, *causes)


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


def row_run(config: Mapping[str, Any], system: PairMachine, row: Mapping[str, Any]) -> Run:
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
        discs=system.draw_discs(stream(read_seed(config), Stream.TOOTHED_WHEEL, _number(row, "gearbox_id"))),
    )


def _number(row: Mapping[str, Any], name: str) -> int:
    return int(str(row[name]).rpartition("-")[2])


def _row_start(row: Mapping[str, Any]) -> Start:
    return Start(
        tooth_pinion=int(row["start_tooth_pinion"]),
        tooth_wheel=int(row["start_tooth_wheel"]),
        phase=float(row["start_phase"]),
    )


def row_instrument(config: Mapping[str, Any], system: PairMachine, row: Mapping[str, Any]) -> Instrument:
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


def twin_start(config: Mapping[str, Any], system: PairMachine, row: Mapping[str, Any]) -> Start:
    """Where the healthy twin of a unit at a condition starts."""
    rng = stream(read_seed(config), Stream.TWIN, int(str(row["condition_id"]).rpartition("-")[2]))
    tooth = int(rng.integers(system.pair.pinion.n_teeth))
    return Start(
        tooth_pinion=tooth,
        tooth_wheel=system.driven_tooth(tooth, int(rng.integers(system.pair.wheel.n_teeth))),
        phase=float(rng.random()),
    )


def _unit(config: Mapping[str, Any], system: PairMachine, row: Mapping[str, Any]) -> tuple[Specimen, Gearbox]:
    """Specimen and gearbox of a row, drawn from their own streams."""
    seed, quality = read_seed(config), system.quality
    specimen, gearbox = (int(str(row[name]).rpartition("-")[2]) for name in ("specimen_id", "gearbox_id"))
    box = draw_gearbox(
        stream(seed, Stream.GEARBOX, gearbox), len(system.sensing.channels), quality, system.sensing.gain_scatter
    )
    return (
        _specimen(seed, specimen, system.pair.pinion, system.pair.wheel, quality),
        with_damping_ratio(box, stream(seed, Stream.SUPPORT, gearbox), quality),
    )


@lru_cache(maxsize=32)  # the records of a unit share it
def _specimen(seed: int, number: int, pinion: Gear, wheel: Gear, quality: Quality) -> Specimen:
    return draw_specimen(stream(seed, Stream.SPECIMEN, number), pinion, wheel, quality)


def replace_key(config: dict[str, Any], key: str, value: float) -> None:
    """Set a dotted key that must exist and hold a number."""
    if key.startswith(FIXED_KEYS):
        raise ConfigError(f"plan.vary: '{key}' is one value for a whole data set; give several with -m instead")
    *parents, leaf = key.split(".")
    node: Any = config
    for name in parents:
        node = node.get(name) if isinstance(node, dict) else None
    if not isinstance(node, dict) or leaf not in node or isinstance(node[leaf], dict | list | str | bool):
        near = nearest.near(key, [one for one in _numeric_keys(config) if not one.startswith(FIXED_KEYS)])
        hint = f"; did you mean {' or '.join(map(repr, near))}?" if near else ""
        raise ConfigError(f"plan.vary: '{key}' is no key of the configuration that holds a number{hint}")
    node[leaf] = int(value) if isinstance(node[leaf], int) and float(value).is_integer() else value


def _numeric_keys(tree: Mapping[str, Any], prefix: str = "") -> list[str]:
    """Dotted keys that hold numbers."""
    found = []
    for name, value in tree.items():
        if isinstance(value, dict):
            found += _numeric_keys(value, f"{prefix}{name}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            found.append(f"{prefix}{name}")
    return found
