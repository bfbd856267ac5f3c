"""Simulation of records: rows of the plan to arrays and values."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Array
from gensig.dynamics.mesh_state import MeshState, mesh_signals
from gensig.errors import SimulationError
from gensig.geometry.contact import GearPair
from gensig.operation.options import operating_signals
from gensig.operation.setpoint import Operating
from gensig.record.fault_gain import needs_sound, with_fault_gain
from gensig.record.inputs import (
    MISSING,
    InputReader,
    RecordInputs,
    Row,
    simulate_motions,
)
from gensig.sensing.chain import detectability
from gensig.systems.base import Machine
from gensig.systems.run import CleanRecord
from gensig.units import from_si

Signals = dict[str, NDArray[Any]]
TWIN, TWIN_SOURCE = "healthy_twin", "healthy_twin_source"  # signals without the faults


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """One finished record.

    Arrays by signal name and values by column name, as a shard takes them.
    """

    signals: Signals
    values: dict[str, Any]


def simulate_record(reader: InputReader, row: Row) -> Record:
    """Simulate one row of a plan; see ``simulate_records``."""
    return simulate_records(reader, [row])[0]


def simulate_records(reader: InputReader, rows: Sequence[Row]) -> list[Record]:
    """Simulate rows of a plan together with the healthy twins that set their noise.

    The bits of a record do not depend on the other rows. A motion that does not stay finite
    becomes a record marked as failed.
    """
    return list(finished_records(reader, rows))


def finished_records(reader: InputReader, rows: Sequence[Row]) -> Iterator[Record]:
    """The records of ``simulate_records``, each measured when it is asked for.

    All motions are simulated before the first, but the samples of one record only are in memory
    where each is stored at once.
    """
    inputs = [reader.inputs(row) for row in rows]
    keys = [(reader.identity, str(row["condition_id"])) for row in rows]
    twins = _missing_twins(inputs, keys)
    stored = reader.dataset.needs_sound_records
    sound = {
        index: each.without_faults()
        for index, each in enumerate(inputs)
        if needs_sound(each) or (stored and each.run.faults)
    }
    motions = iter(simulate_motions([*inputs, *twins.values(), *sound.values()]))
    of_records = [next(motions) for _ in inputs]
    _keep_twins(keys, {key: (twin, next(motions)) for key, twin in twins.items()})
    of_sound = dict(zip(sound, motions, strict=True))
    for index, row in enumerate(rows):
        of_sound_machine = of_sound.get(index, of_records[index])
        measured = _Measured(
            inputs=inputs[index],
            motion=with_fault_gain(inputs[index], of_records[index], of_sound_machine),
            sound=of_sound_machine,
            twin_power=_TWINS.power.get(keys[index]),
        )
        yield _record(reader, row, measured)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Measured:
    """A simulated motion with what its record is made of.

    ``sound`` is the motion of the same record without its faults, the motion itself where it has
    none or is not asked for. ``twin_power`` is the power of the healthy twin at the sensors, None
    where noise does not follow it.
    """

    inputs: RecordInputs
    motion: CleanRecord | SimulationError
    sound: CleanRecord | SimulationError
    twin_power: Array | SimulationError | None

    def noise_power(self, signal: Array) -> Array:
        """Mean square of the noise that a signal gets, (sensor,).

        Raises the error of a failed twin.
        """
        instrument = self.inputs.instrument
        sensing = instrument.sensing
        reference = self.twin_power
        if not sensing.noise_follows_twin:
            reference = instrument.power(signal)
        if isinstance(reference, SimulationError):
            raise reference
        assert reference is not None
        return sensing.noise_power(reference, signal.shape[-1])

    def healthy_twin(self) -> Signals:
        """Signals of the same record without its faults, as far as they are stored.

        They are the output of the sensors and, where the source is stored, the accelerations at
        the bearings. Nothing in them depends on the fault.
        """
        dataset = self.inputs.dataset
        if not dataset.store_healthy_twin:
            return {}
        if isinstance(self.sound, SimulationError):
            raise self.sound
        source = self.sound.acceleration
        clean = self.inputs.instrument.measure(source)
        twin = self.inputs.noisy_twin(clean, self.noise_power(clean))
        signals: Signals = {TWIN: twin.astype(np.float32)}
        if dataset.store_source:
            recorded = source[:, self.inputs.machine.sensing.n_lead :]
            signals[TWIN_SOURCE] = recorded.astype(np.float32)
        return signals


def _record(reader: InputReader, row: Row, measured: _Measured) -> Record:
    """Path, sensor, noise, labels and result columns of one row."""
    try:
        record = _finished(measured)
    except SimulationError as error:
        record = _failed(measured, error)
    dataset, machine = measured.inputs.dataset, measured.inputs.machine
    n_samples = machine.n_samples
    motion, angle = None, np.full(n_samples, MISSING)
    if isinstance(measured.motion, CleanRecord):
        motion = measured.motion
        angle = motion.shaft_angle
    signals = {**record.signals, "fault_multihot": _multihot(reader, row)}
    if dataset.store_operating:
        rate = machine.sensing.sampling_rate
        signals |= operating_signals(
            machine.operating, rate, angle, machine.load_exponent
        )
    signals |= measured.inputs.shaft_signals(motion)
    if dataset.store_mesh_state:
        signals |= _mesh_signals(machine, motion)
    columns = {key: value for key, value in row.items() if key not in ("shard", "row")}
    return Record(signals=signals, values={**columns, **record.values})


def _finished(measured: _Measured) -> Record:
    """Samples and results of a motion; raises the error of one that failed."""
    inputs, motion = measured.inputs, measured.motion
    if isinstance(motion, SimulationError):
        raise motion
    _check_speed(inputs.machine.operating, motion)
    sensing, dataset = inputs.machine.sensing, inputs.dataset
    clean = inputs.clean(motion.acceleration)
    noise_power = measured.noise_power(clean)
    twin = measured.healthy_twin()
    noisy, conversion = inputs.noisy(clean, noise_power)
    speed_rpm = from_si("speed_rpm", motion.mean_speed)
    values = {
        "speed_rpm": speed_rpm,
        "mesh_frequency_hz": speed_rpm / 60.0 * inputs.machine.pair.pinion.n_teeth,
        "contact_loss_fraction": motion.contact_loss_fraction,
        "integration_error": motion.integration_error,
        "integration_check": motion.integration_check,
        **conversion,
    }
    is_judged = dataset.store_detectability and sensing.has_white_noise
    if is_judged and isinstance(measured.sound, CleanRecord):
        residual = clean - inputs.clean(measured.sound.acceleration)
        values["detectability"] = detectability(residual, noise_power)
    source = motion.acceleration[:, sensing.n_lead :]
    signals = _samples(inputs, noisy, clean, noise_power, source)
    return Record(signals=signals | twin, values=values)


def _check_speed(operating: Operating, motion: CleanRecord) -> None:
    """Raise SimulationError where the drive did not hold the speed of the set-point."""
    error = abs(motion.mean_speed / operating.mean_speed - 1.0)
    if error <= operating.speed_tolerance:
        return
    turned, wanted = (
        from_si("speed_rpm", speed)
        for speed in (motion.mean_speed, operating.mean_speed)
    )
    raise SimulationError(
        f"the mean speed is {turned:.4g} r/min, not {wanted:.4g} (operating.speed_tolerance = "
        f"{operating.speed_tolerance:g}): the drive does not hold {operating.torque:.4g} N m at "
        "that speed; lower operating.torque_nm, or raise the speed or the drive's frequency"
    )


def _failed(measured: _Measured, error: SimulationError) -> Record:
    """A record of missing samples, with the reason of its failure."""
    inputs = measured.inputs
    sensing, n_samples = inputs.machine.sensing, inputs.machine.n_samples
    silent = np.full((len(sensing.channel_names), n_samples), MISSING)
    source = np.full((len(sensing.channels), n_samples), MISSING)
    noise_power = np.full(len(silent), MISSING)
    twin: Signals = {}
    if inputs.dataset.store_healthy_twin:
        twin[TWIN] = silent.astype(np.float32)
        if inputs.dataset.store_source:
            twin[TWIN_SOURCE] = source.astype(np.float32)
    values = {
        "status": "failed",
        "status_reason": str(error),
        "speed_rpm": MISSING,
        "mesh_frequency_hz": MISSING,
    }
    signals = _samples(inputs, silent, silent, noise_power, source)
    return Record(signals=signals | twin, values=values)


def _samples(
    inputs: RecordInputs,
    noisy: Array,
    clean: Array,
    noise_power: Array,
    source: Array,
) -> Signals:
    """Signals of the sensors on the housing, in the types of a shard."""
    signals: Signals = {
        "acceleration": noisy.astype(np.float32),
        "signal_power": inputs.instrument.power(clean),
        "noise_power": noise_power,
    }
    if inputs.dataset.store_clean:
        signals["acceleration_clean"] = clean.astype(np.float32)
    if inputs.dataset.store_source:
        signals["acceleration_source"] = source.astype(np.float32)
    return signals


def gear_columns(pair: GearPair) -> dict[str, int | float]:
    """Teeth and geometry of a pair: columns where units differ, else root attributes."""
    pinion, wheel = pair.pinion, pair.wheel
    return {
        "n_teeth_pinion": pinion.n_teeth,
        "n_teeth_wheel": wheel.n_teeth,
        "normal_module_mm": from_si("normal_module_mm", pinion.normal_module),
        "pressure_angle_deg": from_si("pressure_angle_deg", pinion.pressure_angle),
        "helix_angle_deg": from_si("helix_angle_deg", pinion.helix_angle),
        "face_width_pinion_mm": from_si("face_width_mm", pinion.face_width),
        "face_width_wheel_mm": from_si("face_width_mm", wheel.face_width),
        "center_distance_mm": from_si("center_distance_mm", pair.center_distance),
        "transverse_contact_ratio": pair.transverse_contact_ratio,
        "overlap_ratio": pair.overlap_ratio,
    }


def signal_shapes(reader: InputReader) -> dict[str, tuple[int, ...]]:
    """Shape of every array of one record, by signal name."""
    dataset, machine = reader.dataset, reader.machine()
    n_channels, n_samples = len(machine.sensing.channel_names), machine.n_samples
    sensors, samples = (n_channels, n_samples), (n_samples,)
    shapes: dict[str, tuple[int, ...]] = {
        "acceleration": sensors,
        "fault_multihot": (len(reader.plan.classes),),
        "signal_power": (n_channels,),
        "noise_power": (n_channels,),
    }
    if dataset.store_clean:
        shapes["acceleration_clean"] = sensors
    if dataset.store_healthy_twin:
        shapes[TWIN] = sensors
    if dataset.store_source:
        sources = (len(machine.sensing.channels), n_samples)
        shapes["acceleration_source"] = sources
        if dataset.store_healthy_twin:
            shapes[TWIN_SOURCE] = sources
    if dataset.store_operating:
        shapes |= {"shaft_speed": samples, "torque_set": samples}
    shapes |= dict.fromkeys(dataset.shaft_signals, samples)
    if dataset.store_mesh_state:
        state = _mesh_signals(machine, None)
        shapes |= {name: values.shape for name, values in state.items()}
    return shapes


def _mesh_signals(machine: Machine, motion: CleanRecord | None) -> Signals:
    """Loads of the teeth of all meshes, the followed one first.

    Without values for a failed record, which has no motion.
    """
    n_samples, n_pairs = machine.n_samples, machine.most_pairs
    further = [mesh for mesh in machine.meshes if not mesh.followed]
    state: MeshState | None = None
    states: Sequence[MeshState | None] = [None] * len(further)
    if motion is not None:
        state, states = motion.mesh, motion.further_meshes
    signals = mesh_signals(state, n_samples, n_pairs)
    for mesh, state in zip(further, states, strict=True):
        signals |= mesh_signals(state, n_samples, n_pairs, f"{mesh.name}_")
    return signals


def _multihot(reader: InputReader, row: Row) -> NDArray[np.int8]:
    """1 for the record's class and, where its fault is compound, for the classes of its parts."""
    parts = json.loads(str(row["faults_json"]))
    kinds = {part["kind"] for part in parts if len(parts) > 1}
    present = [
        label == int(row["label"]) or reader.classes[name]["kind"] in kinds
        for label, name in enumerate(reader.plan.classes)
    ]
    return np.array(present, dtype=np.int8)


TwinKey = tuple[str, str]  # identity of the data set, condition


class _Twins(threading.local):
    """Power of healthy twins at the sensors, kept from one call to the next by each thread."""

    def __init__(self) -> None:
        self.power: dict[TwinKey, Array | SimulationError] = {}


_TWINS = _Twins()


def forget_twins() -> None:
    """Drop what is kept of healthy twins, so that a timing counts them."""
    _TWINS.power.clear()


def _missing_twins(
    inputs: Sequence[RecordInputs], keys: Sequence[TwinKey]
) -> dict[TwinKey, RecordInputs]:
    """Inputs of the healthy twins that noise needs and that are not known yet.

    A plan lets the healthy record of a group start as the twin does. Where that record is among the
    inputs, it is the twin, and its run is simulated once.
    """
    twins: dict[TwinKey, RecordInputs] = {}
    shared: dict[TwinKey, RecordInputs] = {}
    for each, key in zip(inputs, keys, strict=True):
        if not each.machine.sensing.noise_follows_twin or key in _TWINS.power:
            continue
        twin = each.healthy_twin()
        twins.setdefault(key, twin)
        if not each.run.faults and each.run.start == twin.run.start:
            shared[key] = replace(twins[key], run=each.run)
    return twins | shared


def _keep_twins(
    keys: Sequence[TwinKey],
    simulated: dict[TwinKey, tuple[RecordInputs, CleanRecord | SimulationError]],
) -> None:
    """Keep the twins of these records: those known before, and those simulated now."""
    known = {key: _TWINS.power[key] for key in keys if key in _TWINS.power}
    _TWINS.power.clear()
    _TWINS.power.update(known)
    for key, (inputs, motion) in simulated.items():
        power: Array | SimulationError
        if isinstance(motion, SimulationError):
            power = motion
        else:
            measured = inputs.instrument.measure(motion.acceleration)
            power = inputs.instrument.power(measured)
        _TWINS.power[key] = power
