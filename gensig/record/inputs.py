"""Inputs of a record, made from its row of the plan.

``docs/architecture.md`` follows one record from its row to its samples.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from types import MappingProxyType
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Array
from gensig.dataset.folder.manifest import identity_hash
from gensig.errors import DatasetError, SimulationError
from gensig.faults.base import Fault
from gensig.faults.registry import read_faults
from gensig.geometry.gear import Gear
from gensig.life.life_options import LifeOptions, read_life, runs_to_failure
from gensig.life.options import WearOptions, read_wear_options
from gensig.life.root.strength import Strength
from gensig.options.configuration import Configuration
from gensig.record.machines import read_machine
from gensig.record.options import (
    DatasetOptions,
    PlanOptions,
    read_dataset_options,
    read_plan_options,
)
from gensig.record.streams import Stream, stream
from gensig.sensing.instrument import Instrument, draw_instrument
from gensig.sensing.manufacturing import (
    FurtherGear,
    Gearbox,
    Quality,
    Specimen,
    draw_gearbox,
    draw_specimen,
    with_damping_ratio,
)
from gensig.systems.base import Machine, further_gears
from gensig.systems.derived_sizes import completed
from gensig.systems.lead_in import simulate_with_lead_in
from gensig.systems.nuisances import with_nuisances
from gensig.systems.registry import LINE, PairParts
from gensig.systems.run import CleanRecord, Run, Start
from gensig.systems.shaft_sensors import shaft_signals
from gensig.version import __version__

Row = Mapping[str, Any]  # one row of a plan, by column
MISSING = float("nan")
MOST_MACHINES = 256  # that a reader keeps
AS_CONFIGURED: Mapping[str, float] = MappingProxyType({})  # no value is drawn
NUMBER = re.compile(r"[0-9]{1,18}")  # at the end of an id

# The number of a row that each cause of randomness follows.
RECORD, CONDITION, GEARBOX, SPECIMEN = "record", "condition", "gearbox", "specimen"
SUBJECTS = {
    Stream.SPECIMEN: SPECIMEN,
    Stream.GEARBOX: GEARBOX,
    Stream.SUPPORT: GEARBOX,
    Stream.PATH: GEARBOX,
    Stream.SENSOR: GEARBOX,
    Stream.ENCODER: GEARBOX,
    Stream.TOOTHED_WHEEL: GEARBOX,
    Stream.TWIN: CONDITION,
    Stream.NOISE: RECORD,
    Stream.DRIFT: RECORD,
    Stream.DROPPED: RECORD,
    Stream.TACHO: RECORD,
    Stream.HEALTHY_TWIN: RECORD,
    Stream.NUISANCE_RECORD: RECORD,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordNumbers:
    """Numbers of a record, its condition, its gearbox and its specimen in the data set."""

    record: int
    condition: int
    gearbox: int
    specimen: int

    @classmethod
    def of(cls, row: Row) -> RecordNumbers:
        """Numbers at the ends of a row's ids, such as 3 of ``gearbox-0003``, 7 of ``r000007``.

        DatasetError for an id without one.
        """
        numbers = {}
        for name in (RECORD, CONDITION, GEARBOX, SPECIMEN):
            digits = str(row[f"{name}_id"]).rpartition("-")[2]
            if not NUMBER.fullmatch(digits.lstrip("r")):
                given = str(row[f"{name}_id"])[:40]
                raise DatasetError(
                    f"{name}_id {given!r} ends in no number; restore plan.csv from a copy"
                )
            numbers[name] = int(digits.lstrip("r"))
        return cls(**numbers)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecordInputs:
    """Inputs of one record, drawn from its own random streams.

    Attributes
    ----------
    run : machine, faults, start, specimen and gearbox: what is simulated
    instrument : transfer path and sensors of the gearbox
    dataset : signals that are stored
    is_reference : whether this is the healthy twin that sets the noise of its condition
    """

    seed: int
    numbers: RecordNumbers
    run: Run
    instrument: Instrument
    dataset: DatasetOptions
    is_reference: bool = False

    @property
    def machine(self) -> Machine:
        """The machine with the drawn values of its row."""
        return self.run.system

    def stream(self, cause: Stream) -> np.random.Generator:
        """Generator of one cause, by the number of the row that the cause follows."""
        return stream(self.seed, cause, getattr(self.numbers, SUBJECTS[cause]))

    def without_faults(self) -> RecordInputs:
        """The same record of the healthy machine: same start, unit and condition."""
        return replace(self, run=replace(self.run, faults=(), with_mesh_state=False))

    def from_start(self, start: Start) -> RecordInputs:
        """The same record from another start."""
        return replace(self, run=replace(self.run, start=start))

    def healthy_twin(self) -> RecordInputs:
        """The healthy record that sets the noise of the condition.

        It starts as no row of the plan decides.
        """
        start = draw_start(self.machine, self.stream(Stream.TWIN))
        return replace(self.without_faults().from_start(start), is_reference=True)

    def nuisance_streams(
        self,
    ) -> tuple[dict[str, np.random.Generator], np.random.Generator]:
        """Generators of the nuisances of gearbox and specimen, and of the free angles.

        Those angles are drawn for the record. Those of the twin are drawn for its condition, so
        that they do not depend on which record asks for it first.
        """
        units = {
            level: stream(self.seed, Stream.NUISANCE, getattr(self.numbers, level))
            for level in (GEARBOX, SPECIMEN)
        }
        if self.is_reference:
            return units, self.stream(Stream.TWIN)
        return units, self.stream(Stream.NUISANCE_RECORD)

    def clean(self, acceleration: Array) -> Array:
        """Output of the sensors before noise, their drift included, (sensor, sample) m/s2."""
        measured = self.instrument.measure(acceleration)
        return self.instrument.drifted(measured, self.stream(Stream.DRIFT))

    def noisy(self, clean: Array, noise_power: Array) -> tuple[Array, dict[str, Any]]:
        """Noise, offset, converter and lost samples, and the columns on clipping and loss."""
        noisy, clipped = self.instrument.record(
            clean, noise_power, self.stream(Stream.NOISE)
        )
        received, dropped = self.instrument.transmitted(
            noisy, self.stream(Stream.DROPPED)
        )
        sensor = self.instrument.sensing.sensor
        too_many = int(sensor is not None and clipped > sensor.max_clipped_fraction)
        return received, {
            "clipped_fraction": clipped,
            "clipped": too_many,
            "dropped_fraction": dropped,
        }

    def noisy_twin(self, clean: Array, noise_power: Array) -> Array:
        """Output of the sensors on the machine without faults, with drift, noise and losses of
        its own.

        ``clean`` (sensor, sample) m/s2 is before drift. No draw is shared with the record: else
        their difference would be free of noise.
        """
        drift, noise, dropped = self.stream(Stream.HEALTHY_TWIN).spawn(3)
        drifted = self.instrument.drifted(clean, drift)
        noisy, _ = self.instrument.record(drifted, noise_power, noise)
        return self.instrument.transmitted(noisy, dropped)[0]

    def shaft_signals(self, record: CleanRecord | None) -> dict[str, NDArray[Any]]:
        """Signals of the sensors on the shafts, as far as they are stored.

        NaN for a failed record.
        """
        start = self.run.start or Start(tooth_pinion=0, tooth_wheel=0, phase=0.0)
        generators = (self.stream(Stream.ENCODER), self.stream(Stream.TACHO))
        return shaft_signals(
            self.dataset.shaft_signals, self.machine, start, record, *generators
        )


def simulate_motions(
    inputs: Sequence[RecordInputs],
) -> list[CleanRecord | SimulationError]:
    """Accelerations at the bearings, nuisances included; an error for each failed record.

    The bits of a record do not depend on the others of the call.
    """
    # A twin may share the run of a healthy record.
    runs = {id(each.run): each.run for each in inputs}
    results = dict(zip(runs, simulate_with_lead_in(list(runs.values())), strict=True))
    motions = []
    for each in inputs:
        motion = results[id(each.run)]
        if isinstance(motion, CleanRecord) and each.machine.sensing.nuisances:
            motion = with_nuisances(each.run, motion, *each.nuisance_streams())
        motions.append(motion)
    return motions


@final
class InputReader:
    """Typed values of one configuration, and the inputs of its records.

    Each section is read once, when it is first asked for. Records of a condition share their
    machine.
    """

    def __init__(self, config: Configuration) -> None:
        self.config = config
        self._machines: dict[tuple[tuple[str, float], ...], Machine] = {}

    @cached_property
    def seed(self) -> int:
        """The root seed."""
        return self.config.seed

    @cached_property
    def plan(self) -> PlanOptions:
        """Options of the plan."""
        return read_plan_options(self.config.section("plan"))

    @cached_property
    def dataset(self) -> DatasetOptions:
        """Options of the data set."""
        return read_dataset_options(self.config.section("dataset"))

    @property
    def classes(self) -> Mapping[str, Mapping[str, Any]]:
        """Fault option of every class of the plan, by boundary keys."""
        classes: Mapping[str, Mapping[str, Any]] = self.config["classes"]
        return classes

    @cached_property
    def runs_to_failure(self) -> bool:
        """True where the units live until they fail."""
        return runs_to_failure(self.config.get("life"))

    @cached_property
    def life(self) -> LifeOptions:
        """Options of the units' lives."""
        return read_life(self.config["life"])

    @cached_property
    def wear(self) -> WearOptions:
        """Options of wear."""
        return read_wear_options(self.config.section("wear"))

    @cached_property
    def strength(self) -> Strength:
        """Strength of the teeth."""
        return self.config.section("strength").read(Strength)

    @property
    def system_kind(self) -> str:
        """Kind of the machine."""
        return str(self.config["system"]["kind"])

    @property
    def is_line(self) -> bool:
        """True for a drive line."""
        return self.system_kind == LINE

    @cached_property
    def parts(self) -> PairParts:
        """Parts of a gear pair's machine."""
        return PairParts(self.config)

    @cached_property
    def identity(self) -> str:
        """Identity of the data set."""
        return identity_hash(self.config.plain(), __version__)

    def with_values(self, values: Mapping[str, float]) -> InputReader:
        """The reader of the configuration with drawn values put in, gears completed.

        Raises
        ------
        ConfigError    for a key that does not exist, holds no number, or is fixed for a data set
        """
        if not values:
            return self
        config = self.config.with_values(values)
        gear = completed(config.section("gear"))
        return InputReader(config.with_entries(gear=gear))

    def number(self, key: str) -> float:
        """The number of a dotted key."""
        node: Any = self.config
        for name in key.split("."):
            node = node[name]
        return float(node)

    def refuse_fixed(self, key: str) -> None:
        """Raise ConfigError for a key that no value can be drawn for."""
        self.config.with_values({key: 0.0})

    def inputs(self, row: Row) -> RecordInputs:
        """Inputs of one row of the plan.

        Raises
        ------
        GensigError    for values that make no machine, and faults that do not fit
        """
        machine = self.machine(row_values(row))
        seed, numbers = self.seed, RecordNumbers.of(row)
        start = Start(
            tooth_pinion=int(row["start_tooth_pinion"]),
            tooth_wheel=int(row["start_tooth_wheel"]),
            phase=float(row["start_phase"]),
        )
        faults: tuple[Fault, ...] = ()
        if not self.plan.sham:
            faults = tuple(row_faults(row))
        pair, gearbox = machine.pair, numbers.gearbox
        run = Run(
            system=machine,
            faults=faults,
            start=start,
            specimen=_specimen(
                seed,
                numbers.specimen,
                pair.pinion,
                pair.wheel,
                machine.quality,
                further_gears(machine.gears, machine.meshes),
                len(machine.meshes) - 1,
            ),
            gearbox=_gearbox(seed, gearbox, machine),
            with_mesh_state=self.dataset.store_mesh_state,
            discs=machine.draw_discs(stream(seed, Stream.TOOTHED_WHEEL, gearbox)),
        )
        return RecordInputs(
            seed=seed,
            numbers=numbers,
            run=run,
            instrument=draw_instrument(
                machine.sensing,
                stream(seed, Stream.PATH, gearbox),
                stream(seed, Stream.SENSOR, gearbox),
            ),
            dataset=self.dataset,
        )

    def machine(self, values: Mapping[str, float] = AS_CONFIGURED) -> Machine:
        """The machine of the configuration with drawn values put in."""
        drawn = tuple(values.items())
        if drawn not in self._machines:
            if len(self._machines) == MOST_MACHINES:
                del self._machines[next(iter(self._machines))]
            self._machines[drawn] = read_machine(self.config.with_values(values))
        return self._machines[drawn]


def row_values(row: Row) -> dict[str, float]:
    """The drawn values of the machine of a row, by configuration key."""
    return {
        key.removeprefix("params/"): float(value)
        for key, value in row.items()
        if key.startswith("params/") and not key.startswith("params/fault.")
    }


def row_faults(row: Row) -> list[Fault]:
    """Faults of one row of a plan; DatasetError where they are no list of mappings."""
    faults: list[Fault] = []
    try:
        parts = json.loads(str(row["faults_json"]))
    except (ValueError, RecursionError):
        parts = None
    if not isinstance(parts, list) or not all(isinstance(part, dict) for part in parts):
        raise DatasetError(
            f"faults_json {str(row['faults_json'])[:40]!r} is no list of faults; restore plan.csv "
            "from a copy"
        )
    for part in parts:
        faults += read_faults(part, "faults_json")
    return faults


def draw_start(machine: Machine, rng: np.random.Generator) -> Start:
    """Random start of a record: teeth in mesh and phase at the first sample."""
    tooth = int(rng.integers(machine.pair.pinion.n_teeth))
    mate = int(rng.integers(machine.pair.wheel.n_teeth))
    return Start(
        tooth_pinion=tooth,
        tooth_wheel=machine.driven_tooth(tooth, mate),
        phase=float(rng.random()),
    )


def _gearbox(seed: int, number: int, machine: Machine) -> Gearbox:
    """Supports and gains of a gearbox, drawn from its own streams."""
    sensing, quality = machine.sensing, machine.quality
    rng = stream(seed, Stream.GEARBOX, number)
    gearbox = draw_gearbox(
        rng,
        len(sensing.channels),
        quality,
        sensing.gain_scatter,
        n_gears=len(machine.gears),
    )
    return with_damping_ratio(gearbox, stream(seed, Stream.SUPPORT, number), quality)


@lru_cache(maxsize=32)  # the records of a unit share it
def _specimen(
    seed: int,
    number: int,
    pinion: Gear,
    wheel: Gear,
    quality: Quality,
    others: tuple[FurtherGear, ...],
    n_mountings: int,
) -> Specimen:
    rng = stream(seed, Stream.SPECIMEN, number)
    return draw_specimen(
        rng, pinion, wheel, quality, others=others, n_mountings=n_mountings
    )
