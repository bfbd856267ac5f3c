"""The same machine with and without a fault, side by side, over a map of speeds and torques and
several units.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.decimation import usable_band
from gensig.errors import ConfigError, SimulationError
from gensig.faults.registry import fault_parts, without_vary
from gensig.options.configuration import Configuration, whole_number
from gensig.plan.condition_courses import SEED_KEY, settle_courses
from gensig.plan.make import make_plan
from gensig.production.streaming import epoch_seed
from gensig.record.inputs import (
    InputReader,
    RecordInputs,
    Row,
    draw_start,
    simulate_motions,
)
from gensig.record.options import read_plan_options
from gensig.record.streams import Stream, stream
from gensig.sensing.instrument import Instrument
from gensig.systems.registry import read_system
from gensig.systems.run import CleanRecord

Array = NDArray[np.float64]

SPEED, TORQUE = "operating.speed_rpm", "operating.torque_nm"
SPEED_SHARES = (0.25, 0.5, 1.0, 1.5, 2.0)  # of the set-point, where no speeds are given
TORQUE_SHARES = (0.25, 0.5, 1.0, 2.0)
FEWEST_UNITS = 4  # what is chosen on all but one of them needs a spread
MOST_CELLS = 400
NOISE_DRAWS = (
    16  # records of noise whose spectra are averaged where it is not white ...
)
NOISE_BINS = 9  # ... and bins: together the mean of its inverse is right within 1 %


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairCell:
    """Pairs of all units at one speed and torque; NaN for a unit whose motion did not stay finite.

    Attributes
    ----------
    residual : (unit, channel, sample) m/s2     what the fault adds, without noise
    sound, faulty : (unit, channel, sample) m/s2    as recorded; both of a unit have the same start and the same noise
    sound_angle, faulty_angle : (unit, sample) rad  of the pinion
    noise_power : (unit, channel) (m/s2)^2          variance of the noise, in the band of the signal-to-noise ratio
    noise_density : (unit, channel, bin) (m/s2)^2   mean of |rfft(noise)|^2 / samples; one bin for all where it is white
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
    """All that a map of pairs is made from; plain data, so that processes can share the cells.

    Attributes
    ----------
    config : Configuration         as composed
    speeds_rpm, torques_nm : of the pinion, rising
    n_units : machines of the same build: each another set of gears, and another gearbox unless ``plan.n_gearboxes``
              says how many there are
    gears : name -> (teeth, turns for one of the pinion) of the gears with a fault
    rows : one of a plan for each cell and unit, cell by cell, torques fastest
    noise_shape : (unit, channel, bin) or None    density of noise of power 1 where it is not white
    fixed_power : (unit, channel) or None         power of the noise where it is that of the set-point everywhere
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
    def n_cells(self) -> int:
        """Speeds times torques."""
        return len(self.speeds_rpm) * len(self.torques_nm)

    def cell(self, place: int) -> PairCell:
        """Simulate the cell of speed ``place // len(torques_nm)`` and torque ``place %
        len(torques_nm)``.
        """
        rows = self.rows[place * self.n_units : (place + 1) * self.n_units]
        sound, faulty = _contrasts(self.config, rows)
        motions = simulate_motions([*sound, *faulty])
        n_samples = round(self.duration * self.sampling_rate)
        shape = (self.n_units, len(self.channel_names), n_samples)
        signals = {
            name: np.full(shape, np.nan) for name in ("residual", "sound", "faulty")
        }
        angles = {
            name: np.full((self.n_units, n_samples), np.nan)
            for name in ("sound_angle", "faulty_angle")
        }
        power = np.full(shape[:2], np.nan)
        for unit, inputs in enumerate(faulty):
            without, with_fault = motions[unit], motions[self.n_units + unit]
            if isinstance(without, SimulationError) or isinstance(
                with_fault, SimulationError
            ):
                continue
            power[unit] = (
                _noise_power(inputs, without)
                if self.fixed_power is None
                else self.fixed_power[unit]
            )
            clean = []
            for name, motion in (("sound", without), ("faulty", with_fault)):
                clean.append(inputs.clean(motion.acceleration))
                signals[name][unit] = inputs.noisy(clean[-1], power[unit])[0]
                angles[f"{name}_angle"][unit] = motion.shaft_angle
            signals["residual"][unit] = clean[1] - clean[0]
        shape_of_noise = (
            np.ones((1, 1, 1)) if self.noise_shape is None else self.noise_shape
        )
        return PairCell(
            **signals,
            **angles,
            noise_power=power,
            noise_density=power[:, :, None] * shape_of_noise,
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
    """Plan pairs of the selected fault over a map, every value as configured rather than drawn.

    Parameters
    ----------
    config : composed configuration; of ``plan`` only ``n_gearboxes`` and ``sham`` count
    speeds_rpm, torques_nm : of the pinion; None takes shares of the set-point
    n_units : machines of the same build
    fixed_noise : the noise that ``sensing.snr_db`` makes at the set-point everywhere, as a sensor's own noise is,
                  rather than the same signal-to-noise ratio everywhere
    epoch : any number but 0 gives other machines, as in ``gensig.production.streaming``

    Raises
    ------
    ConfigError    for a machine without fault or noise, and for numbers that cannot be used
    """
    config = config.with_entries(seed=epoch_seed(config.seed, epoch))
    fault, sensing = config["fault"], config["sensing"]
    if not fault_parts(fault):
        raise ConfigError(
            f"fault={fault['kind']}: there is nothing to find; choose a fault, for instance fault=crack "
            "(plan.sham=true leaves it out as a control)"
        )
    if sensing["snr_db"] is None:
        raise ConfigError(
            "sensing.snr_db = null: without noise every fault is seen; give a signal-to-noise ratio in dB"
        )
    if sensing["snr_reference"] != "healthy_twin":
        raise ConfigError(
            "sensing.snr_reference: noise that follows the record tells the fault; use healthy_twin"
        )
    whole_number("the number of units", n_units, at_least=FEWEST_UNITS)
    speeds = _levels(
        "speeds in r/min", speeds_rpm, config["operating"]["speed_rpm"], SPEED_SHARES
    )
    torques = _levels(
        "torques in N m", torques_nm, config["operating"]["torque_nm"], TORQUE_SHARES
    )
    if len(speeds) * len(torques) > MOST_CELLS:
        raise ConfigError(
            f"{len(speeds)} speeds x {len(torques)} torques are more than {MOST_CELLS} cells; give fewer"
        )
    config = config.with_entries(
        fault=without_vary(fault), classes={fault["kind"]: without_vary(fault)}
    )
    config = config.with_keys("dataset", store_mesh_state=False)
    planned, rows = _planned(config, speeds, torques, n_units)
    system = read_system(planned)
    teeth = {"pinion": system.pair.pinion.n_teeth, "wheel": system.pair.wheel.n_teeth}
    faulted = dict.fromkeys(str(part["gear"]) for part in fault_parts(fault))
    return FaultPairs(
        config=planned,
        speeds_rpm=speeds,
        torques_nm=torques,
        n_units=n_units,
        gears={gear: (teeth[gear], teeth["pinion"] / teeth[gear]) for gear in faulted},
        channel_names=tuple(system.sensing.channel_names),
        sampling_rate=system.sensing.sampling_rate,
        usable_frequency=usable_band(system.sensing.sampling_rate)[1],
        duration=system.operating.duration,
        rows=tuple(rows),
        noise_shape=None
        if system.sensing.has_white_noise
        else _noise_shape(planned, rows[:n_units]),
        fixed_power=_power_at_set_point(config, n_units) if fixed_noise else None,
    )


def _levels(
    what: str, given: Sequence[float] | None, set_point: float, shares: Sequence[float]
) -> tuple[float, ...]:
    """The values of one axis, rising."""
    values = (
        [share * set_point for share in shares]
        if given is None
        else [float(value) for value in given]
    )
    if (
        not values
        or not all(math.isfinite(value) and value > 0.0 for value in values)
        or len(set(values)) < len(values)
    ):
        raise ConfigError(
            f"{what}: {', '.join(f'{value:g}' for value in values)}; give positive numbers, each once"
        )
    return tuple(sorted(values))


def _planned(
    config: Configuration,
    speeds: Sequence[float],
    torques: Sequence[float],
    n_units: int,
) -> tuple[Configuration, list[dict[str, Any]]]:
    """The configuration with a plan of one row a cell and unit, and those rows, each unit in a
    gearbox of its own.
    """
    plan = read_plan_options(config)
    n_gearboxes = n_units if plan.n_gearboxes is None else plan.n_gearboxes
    config = config.with_keys(
        "plan",
        n_records=None,
        n_units=n_units,
        n_gearboxes=1,
        conditions_per_unit=None,
        n_repeats=1,
        classes=list(config["classes"]),
        design="grid",
        vary={
            SPEED: {"distribution": "choice", "values": list(speeds)},
            TORQUE: {"distribution": "choice", "values": list(torques)},
        },
    )
    config = settle_courses(config, () if SEED_KEY in plan.vary else (SEED_KEY,))
    table = make_plan(config)
    rows = [table.record(index) for index in range(table.n_records)]
    gearboxes = [
        f"gearbox-{index % n_units % n_gearboxes:04d}" for index in range(len(rows))
    ]
    return config, [
        {**row, "gearbox_id": gearbox}
        for row, gearbox in zip(rows, gearboxes, strict=True)
    ]


def _contrasts(
    config: Configuration, rows: Sequence[Row]
) -> tuple[list[RecordInputs], list[RecordInputs]]:
    """Each row without and with its fault, from the start of the healthy twin that sets the noise
    of a data set.

    Both are records: their nuisances and noise are those of the row.
    """
    reader = InputReader(config)
    inputs = [reader.inputs(row) for row in rows]
    starts = [draw_start(each.machine, each.stream(Stream.TWIN)) for each in inputs]
    faulty = [
        each.from_start(start) for each, start in zip(inputs, starts, strict=True)
    ]
    return [each.without_faults() for each in faulty], faulty


def _noise_power(inputs: RecordInputs, sound: CleanRecord) -> Array:
    instrument, sensing = inputs.instrument, inputs.machine.sensing
    reference = instrument.power(instrument.measure(sound.acceleration))
    return reference * sensing.noise_factor(float(sensing.snr or 0.0))


def _power_at_set_point(config: Configuration, n_units: int) -> Array:
    """Noise power of every unit at the configured speed and torque, (unit, channel)."""
    operating = config["operating"]
    planned, rows = _planned(
        config, [operating["speed_rpm"]], [operating["torque_nm"]], n_units
    )
    sound, _ = _contrasts(planned, rows)
    powers = []
    for inputs, motion in zip(sound, simulate_motions(sound), strict=True):
        if isinstance(motion, SimulationError):
            raise motion
        powers.append(_noise_power(inputs, motion))
    return np.stack(powers)


def _noise_shape(config: Configuration, rows: Sequence[Row]) -> Array:
    """Density of each unit's noise at power 1, averaged over draws and neighbouring bins, (unit,
    channel, bin).
    """
    reader = InputReader(config)
    densities = []
    for unit, row in enumerate(rows):
        inputs = reader.inputs(row)
        sensing = inputs.machine.sensing
        n_samples = round(inputs.machine.operating.duration * sensing.sampling_rate)
        silent = np.zeros((len(sensing.channel_names), n_samples))
        ideal = Instrument(
            sensing=replace(sensing, sensor=None),
            path=inputs.instrument.path,
            sensors=None,
        )
        children = stream(config.seed, Stream.NOISE, unit).spawn(NOISE_DRAWS)
        noises = (
            ideal.record(silent, np.ones(len(silent)), rng)[0] for rng in children
        )
        density = (
            np.mean(
                [np.abs(np.fft.rfft(noise, axis=-1)) ** 2 for noise in noises], axis=0
            )
            / n_samples
        )
        densities.append([_smoothed(line) for line in density])
    return np.array(densities)


def _smoothed(density: Array) -> Array:
    """Running mean; at either end of the bins that there are."""
    window = np.ones(min(NOISE_BINS, len(density)))
    return np.convolve(density, window, mode="same") / np.convolve(
        np.ones_like(density), window, mode="same"
    )
