"""Contrasts: a machine with and without a fault, over a map of speeds and torques."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.dynamics.decimation import usable_band
from gensig.errors import ConfigError, SimulationError
from gensig.faults.registry import FAULTS, fault_parts, without_vary
from gensig.options.configuration import Configuration, Section, whole_number
from gensig.plan.condition_courses import SEED_KEY, settle_courses
from gensig.plan.make import make_plan
from gensig.production.streaming import epoch_seed
from gensig.record.fault_gain import with_fault_gain
from gensig.record.inputs import (
    InputReader,
    RecordInputs,
    Row,
    draw_start,
    simulate_motions,
)
from gensig.record.options import AS_GIVEN, CROSSED
from gensig.record.streams import Stream, stream
from gensig.sensing.instrument import Instrument
from gensig.sensing.options import read_sensing
from gensig.systems.registry import read_system
from gensig.systems.run import CleanRecord

SPEED, TORQUE = "operating.speed_rpm", "operating.torque_nm"
SPEED_SHARES = (0.25, 0.5, 1.0, 1.5, 2.0)  # of the set-point, where no speeds are given
TORQUE_SHARES = (0.25, 0.5, 1.0, 2.0)
FEWEST_UNITS = 4  # what is chosen on all but one of them needs a spread
MOST_CELLS = 400
# Records and bins over which spectra of colored noise are averaged: together the mean of the
# inverse is right within 1 %.
NOISE_DRAWS = 16
NOISE_BINS = 9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairCell:
    """Contrasts of all units at one speed and torque.

    A unit whose motion did not stay finite has NaN.

    Attributes
    ----------
    residual : (unit, channel, sample) m/s2         faulty less sound, without noise
    sound, faulty : (unit, channel, sample) m/s2    as recorded, with one start and one noise
    sound_angle, faulty_angle : (unit, sample) rad  of the pinion
    noise_power : (unit, channel) (m/s2)^2          variance of the noise, in the band of the
                                                    signal-to-noise ratio
    noise_density : (unit, channel, bin) (m/s2)^2   mean of |rfft(noise)|^2 / samples; one bin for
                                                    all where the noise is white
    """

    residual: Array
    sound: Array
    faulty: Array
    sound_angle: Array
    faulty_angle: Array
    noise_power: Array
    noise_density: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class FaultPairs:
    """Plan of a map of contrasts; plain data, so that processes can share the cells.

    Attributes
    ----------
    config : Configuration         as composed
    speeds_rpm, torques_nm : of the pinion, rising
    n_units : machines of the same build: each another set of gears, and another gearbox unless
              ``plan.n_gearboxes`` says how many there are
    gears : name -> (teeth, turns for one of the pinion) of the gears with a fault
    rows : one of a plan for each cell and unit, cell by cell, torques fastest
    noise_shape : (unit, channel, bin) or None    density of noise of power 1; None where white
    fixed_power : (unit, channel) or None         power of the noise at the set-point, where it
                                                  holds everywhere
    """

    config: Configuration
    speeds_rpm: tuple[float, ...]
    torques_nm: tuple[float, ...]
    n_units: int
    gears: dict[str, tuple[int, float]]
    channel_names: tuple[str, ...]
    sampling_rate: float
    usable_frequency: float
    duration: float
    rows: tuple[dict[str, Any], ...]
    noise_shape: Array | None
    fixed_power: Array | None

    @property
    def size_key(self) -> str | None:
        """Key of the fault's first size; None for several faults or one without a size."""
        fault = FAULTS.get(self.config["fault"]["kind"])
        if fault is None or not fault.sizes:
            return None
        return fault.sizes[0][0]

    @property
    def n_cells(self) -> int:
        """Speeds times torques."""
        return len(self.speeds_rpm) * len(self.torques_nm)

    def cell(self, index: int) -> PairCell:
        """Simulate one cell; cells are numbered speed by speed, torques fastest."""
        rows = self.rows[index * self.n_units : (index + 1) * self.n_units]
        sound, faulty = _contrasts(InputReader(self.config), rows)
        motions = simulate_motions([*sound, *faulty])
        n_samples = round(self.duration * self.sampling_rate)
        shape = (self.n_units, len(self.channel_names), n_samples)
        residual, *recorded = (np.full(shape, np.nan) for _ in range(3))
        angles = [np.full((self.n_units, n_samples), np.nan) for _ in range(2)]
        power = np.full(shape[:2], np.nan)
        for unit, inputs in enumerate(faulty):
            without, with_fault = motions[unit :: self.n_units]
            with_fault = with_fault_gain(inputs, with_fault, without)
            if isinstance(without, SimulationError) or isinstance(
                with_fault, SimulationError
            ):
                continue
            if self.fixed_power is None:
                power[unit] = _noise_power(inputs, without)
            else:
                power[unit] = self.fixed_power[unit]
            clean = []
            for motion, signal, angle in zip(
                (without, with_fault), recorded, angles, strict=True
            ):
                clean.append(inputs.clean(motion.acceleration))
                signal[unit] = inputs.noisy(clean[-1], power[unit])[0]
                angle[unit] = motion.shaft_angle
            residual[unit] = clean[1] - clean[0]
        density = power[:, :, None]
        if self.noise_shape is not None:
            density = density * self.noise_shape
        return PairCell(
            residual=residual,
            sound=recorded[0],
            faulty=recorded[1],
            sound_angle=angles[0],
            faulty_angle=angles[1],
            noise_power=power,
            noise_density=density,
        )


def make_pairs(
    config: Configuration,
    *,
    speeds_rpm: Sequence[float] | None = None,
    torques_nm: Sequence[float] | None = None,
    n_units: int = 8,
    fixed_noise: bool = False,
    epoch: int = 0,
) -> FaultPairs:
    """Plan contrasts of the selected fault over a map; values are as configured, not drawn.

    Parameters
    ----------
    config : composed configuration; of ``plan`` only ``n_gearboxes`` and ``sham`` count
    speeds_rpm, torques_nm : of the pinion; None takes shares of the set-point
    n_units : machines of the same build
    fixed_noise : True takes the noise that ``sensing.snr_db`` makes at the set-point everywhere,
                  as a sensor has it, rather than the same signal-to-noise ratio everywhere
    epoch : any number but 0 gives other machines, as in ``gensig.production.streaming``

    Raises
    ------
    ConfigError    for a machine without fault or noise, and for numbers that cannot be used
    """
    config = config.with_entries(seed=epoch_seed(config.seed, epoch))
    fault, operating = config["fault"], config["operating"]
    _check_fault_and_noise(fault, config["sensing"])
    whole_number("the number of machines", n_units, at_least=FEWEST_UNITS)
    speeds = _levels(
        "speeds in r/min", speeds_rpm, operating["speed_rpm"], SPEED_SHARES
    )
    torques = _levels(
        "torques in N m", torques_nm, operating["torque_nm"], TORQUE_SHARES
    )
    if len(speeds) * len(torques) > MOST_CELLS:
        raise ConfigError(
            f"{len(speeds)} speeds x {len(torques)} torques "
            f"are more than {MOST_CELLS} cells; give fewer"
        )
    fixed = without_vary(fault)
    config = config.with_entries(fault=fixed, classes={fault["kind"]: fixed})
    config = config.with_keys("dataset", store_mesh_state=False)
    reader, rows = _planned(config, speeds, torques, n_units)
    system = read_system(reader.config)
    teeth = {"pinion": system.pair.pinion.n_teeth, "wheel": system.pair.wheel.n_teeth}
    faulted = dict.fromkeys(str(part["gear"]) for part in fault_parts(fault))
    shape = power = None
    if not system.sensing.has_white_noise:
        shape = _noise_shape(reader, rows[:n_units])
    if fixed_noise:
        point = [operating["speed_rpm"]], [operating["torque_nm"]]
        power = _power_of_units(*_planned(config, *point, n_units))
    return FaultPairs(
        config=reader.config,
        speeds_rpm=speeds,
        torques_nm=torques,
        n_units=n_units,
        gears={gear: (teeth[gear], teeth["pinion"] / teeth[gear]) for gear in faulted},
        channel_names=tuple(system.sensing.channel_names),
        sampling_rate=system.sensing.sampling_rate,
        usable_frequency=usable_band(system.sensing.sampling_rate)[1],
        duration=system.operating.duration,
        rows=tuple(rows),
        noise_shape=shape,
        fixed_power=power,
    )


def _check_fault_and_noise(fault: Section, sensing: Section) -> None:
    """Raise ConfigError for a machine without a fault, or without noise of the healthy twin."""
    if not fault_parts(fault):
        raise ConfigError(
            f"fault={fault['kind']}: there is nothing to find; "
            "choose a fault, for instance fault=crack "
            "(plan.sham=true leaves it out as a control)"
        )
    if not read_sensing(sensing).has_noise:
        raise ConfigError(
            "sensing.snr_db = null: without noise every fault is seen; "
            "give a signal-to-noise ratio in dB, or sensing.noise.level_m_per_s2"
        )
    if sensing["snr_reference"] != "healthy_twin":
        raise ConfigError(
            "sensing.snr_reference: noise that follows the record tells the fault; "
            "use healthy_twin"
        )


def _levels(
    what: str, given: Sequence[float] | None, set_point: float, shares: Sequence[float]
) -> tuple[float, ...]:
    """The values of one axis, rising."""
    values = [share * set_point for share in shares]
    if given is not None:
        values = [float(value) for value in given]
    are_positive = all(math.isfinite(value) and value > 0.0 for value in values)
    if not values or not are_positive or len(set(values)) < len(values):
        text = ", ".join(f"{value:g}" for value in values)
        raise ConfigError(f"{what}: {text}; give positive numbers, each once")
    return tuple(sorted(values))


def _planned(
    config: Configuration,
    speeds: Sequence[float],
    torques: Sequence[float],
    n_units: int,
) -> tuple[InputReader, list[dict[str, Any]]]:
    """The reader of a plan of one row for each cell and unit, and those rows."""
    plan = InputReader(config).plan
    n_gearboxes = plan.n_gearboxes
    if n_gearboxes is None:
        n_gearboxes = n_units
    config = config.with_keys(
        "plan",
        n_records=None,
        n_units=n_units,
        n_gearboxes=1,
        machines=CROSSED,
        fault_gear=AS_GIVEN,
        n_reference=0,
        conditions_per_unit=None,
        n_repeats=1,
        classes=list(config["classes"]),
        design="grid",
        vary={
            SPEED: {"distribution": "choice", "values": list(speeds)},
            TORQUE: {"distribution": "choice", "values": list(torques)},
        },
    )
    config = settle_courses(config, tuple({SEED_KEY} - set(plan.vary)))
    table = make_plan(config)
    rows = []
    for index in range(table.n_records):
        gearbox = f"gearbox-{index % n_units % n_gearboxes:04d}"
        rows.append({**table.record(index), "gearbox_id": gearbox})
    return InputReader(config), rows


def _contrasts(
    reader: InputReader, rows: Sequence[Row]
) -> tuple[list[RecordInputs], list[RecordInputs]]:
    """Inputs of each row without and with its fault.

    Both begin as the healthy twin that sets the noise of a data set. Nuisances and noise are
    those of the row.
    """
    inputs = [reader.inputs(row) for row in rows]
    starts = [draw_start(each.machine, each.stream(Stream.TWIN)) for each in inputs]
    faulty = [
        each.from_start(start) for each, start in zip(inputs, starts, strict=True)
    ]
    return [each.without_faults() for each in faulty], faulty


def _noise_power(inputs: RecordInputs, sound: CleanRecord) -> Array:
    instrument, sensing = inputs.instrument, inputs.machine.sensing
    reference = instrument.power(instrument.measure(sound.acceleration))
    return sensing.noise_power(reference, inputs.machine.n_samples)


def _power_of_units(reader: InputReader, rows: Sequence[Row]) -> Array:
    """Noise power of every unit's record, (unit, channel)."""
    sound, _ = _contrasts(reader, rows)
    powers = []
    for inputs, motion in zip(sound, simulate_motions(sound), strict=True):
        if isinstance(motion, SimulationError):
            raise motion
        powers.append(_noise_power(inputs, motion))
    return np.stack(powers)


def _noise_shape(reader: InputReader, rows: Sequence[Row]) -> Array:
    """Density of each unit's noise at power 1, averaged over draws and bins.

    Shape (unit, channel, bin).
    """
    densities = []
    for unit, row in enumerate(rows):
        inputs = reader.inputs(row)
        sensing = inputs.machine.sensing
        n_samples = inputs.machine.n_samples
        silent = np.zeros((len(sensing.channel_names), n_samples))
        ideal = Instrument(
            sensing=replace(sensing, sensor=None),
            path=inputs.instrument.path,
            sensors=None,
        )
        children = stream(reader.seed, Stream.NOISE, unit).spawn(NOISE_DRAWS)
        noises = (
            ideal.record(silent, np.ones(len(silent)), rng)[0] for rng in children
        )
        powers = [np.abs(np.fft.rfft(noise, axis=-1)) ** 2 for noise in noises]
        density = np.mean(powers, axis=0) / n_samples
        densities.append([_smoothed(channel) for channel in density])
    return np.array(densities)


def _smoothed(density: Array) -> Array:
    """Running mean; at either end of the bins that there are."""
    window = np.ones(min(NOISE_BINS, len(density)))
    n_averaged = np.convolve(np.ones_like(density), window, mode="same")
    return np.convolve(density, window, mode="same") / n_averaged
