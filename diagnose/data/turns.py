"""Turns of both gears as the input of a network: records in the angle domain instead of time."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self, final

import numpy as np
from numpy.typing import NDArray

from diagnose.data.inputs import NetworkInput, RecordedSignal
from diagnose.data.packed_turns import HEADER, n_points, packed, turns_of
from diagnose.data.redrawn_sets import RedrawnTurns
from diagnose.data.references import all_references, reference_kind
from diagnose.data.targets import GEARS, fault_positions, record_targets, tooth_entries
from diagnose.data.teeth import common_teeth, missing_teeth, teeth_of_records
from diagnose.data.turn_levels import turn_levels
from diagnose.data.whitening import whitened_turns
from diagnose.data.windows import (
    FloatArray,
    Read,
    Segments,
    Task,
    WindowSet,
    read_signal,
)
from gensig.errors import ConfigError, DatasetError
from gensig.options.configuration import Section, whole_number
from gensig.signals.alignment import changed_turns
from gensig.signals.separation import GearTurns, separate_gears
from gensig.signals.transfer.ringing import without_ringing
from gensig.signals.unexplained_teeth import unexplained_teeth

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

# Keys of a network's configuration.
N_TEETH, PER_TOOTH, HALVES = "n_teeth", "samples_per_tooth", "halves"
REFERENCE, NO_REFERENCE, UNEXPLAINED = "reference", "none", "unexplained"
EACH_CHANNEL, WHITENED, REDRAWS = "each_channel", "whitened", "redraws"
MACHINE = "machine"  # value of `WHITENED`: by all recordings of a machine together
LEAST_HARMONICS = 3  # of the mesh that a recording must hold; assumed
EXAMPLE_TEETH = (11, 13)  # of an input that is tried on a network; any numbers serve

HEALTHY_NEEDED = (
    "this model compares with healthy recordings of the machine: say --healthy FILE"
)
NO_HEALTHY = (
    "this model takes no healthy recording: leave --healthy out, "
    "or train one with reference=other_condition"
)


class Steady(NamedTuple):
    """Turns of a recording of steady speed, and its mesh frequency in Hz."""

    turns: GearTurns
    mesh_frequency: float


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Turns(NetworkInput):
    """Turns of the driving and the driven gear and the mean passage of a tooth, end to end.

    `diagnose.data.packed_turns` says how they lie in an array. Records may differ in their
    numbers of teeth.

    Attributes
    ----------
    samples_per_tooth : of the turns
    n_teeth : of the driving and the driven gear, for a network that reads no others; else None
    halves : True if a training takes either half of a stretch as a further example
    unexplained : True if the turns of what no other tooth explains stand behind the record, see
        `gensig.signals.unexplained_teeth`
    reference : kind of `diagnose.data.references.references`; what these do not explain of the
        turns stands behind all others, see `gensig.signals.alignment.changed_turns`; or ``"none"``
    each_channel : True if every channel is an input of its own, so that a network takes
        recordings of any number of channels
    whitened : True if the resonances of the machine are taken from each turn by itself, see
        `diagnose.data.whitening`; ``"machine"`` if from all recordings of the machine together,
        see `gensig.signals.transfer.ringing`
    redraws : further examples of every training record, each of a machine drawn anew, see
        `diagnose.data.redraws`
    """

    samples_per_tooth: int
    n_teeth: tuple[int, int] | None = None
    halves: bool = True
    unexplained: bool = False
    reference: str = NO_REFERENCE
    each_channel: bool = False
    whitened: bool | str = False
    redraws: int = 0

    has_window_length: ClassVar[bool] = False
    why_not_exported: ClassVar[str | None] = (
        "this model looks at turns, which are made before the network: "
        "export one that reads windows"
    )

    @classmethod
    def completed(cls, model_config: Section, dataset: Dataset) -> Section:
        """The configuration, with the tooth counts of the data set if it has a key for them.

        Raises
        ------
        ConfigError    for a data set that does not say them, or has several where the network
            reads one pair
        """
        if name := missing_teeth(dataset):
            raise ConfigError(
                f"the data set does not say {name}, which this model needs: model=cnn"
            )
        if N_TEETH not in model_config:
            return model_config
        teeth = common_teeth(dataset)
        if teeth is None:
            raise ConfigError(
                "the records differ in their numbers of teeth, and this model reads one pair "
                "of gears: model=tooth reads any"
            )
        return model_config | {N_TEETH: list(teeth)}

    @classmethod
    def of(cls, model_config: Section) -> Self:
        """Turns as the configuration of a network says."""
        n_teeth = None
        if model_config.get(N_TEETH) is not None:
            driving, driven = model_config[N_TEETH]
            n_teeth = (int(driving), int(driven))
        return cls(
            samples_per_tooth=model_config[PER_TOOTH],
            n_teeth=n_teeth,
            halves=model_config.get(HALVES, True),
            unexplained=model_config.get(UNEXPLAINED, False),
            reference=model_config.get(REFERENCE, NO_REFERENCE),
            each_channel=model_config.get(EACH_CHANNEL, False),
            whitened=_checked_whitening(model_config.get(WHITENED, False)),
            redraws=whole_number(
                f"model.{REDRAWS}", model_config.get(REDRAWS, 0), at_least=0
            ),
        )

    @property
    def compares(self) -> bool:
        """True if references are looked at."""
        return self.reference != NO_REFERENCE

    @property
    def of_stored_records(self) -> Self:
        """The same turns without redraws."""
        return replace(self, redraws=0)

    @property
    def n_kinds(self) -> int:
        """Number of turns of either gear in an input."""
        return 1 + self.unexplained + self.compares

    def check(self, task: Task, segments: Segments, network: str) -> None:
        """Refuse stretches that hold no turn of the driving gear, with the shortest one."""
        speed = _speed_rpm(task)[segments.record]
        seconds = (segments.stop - segments.start) / task.dataset.sampling_rate
        turns = seconds * speed / 60
        if turns.min() < 1:
            raise ConfigError(
                f"a stretch holds {turns.min():.2g} turns of the pinion, "
                f"and model {network} needs a whole one: leave the protocol out, "
                "make longer records or choose another model"
            )

    def example(self, n_channels: int, window_samples: int) -> NDArray[np.float32]:
        """Silent turns, whatever the length of a window."""
        n_teeth = self.n_teeth or EXAMPLE_TEETH
        length = n_points(n_teeth, self.samples_per_tooth, self.n_kinds)
        shape = (1, 1 if self.each_channel else n_channels, length)
        silent = np.zeros(shape, dtype=np.float32)
        silent[..., :HEADER] = n_teeth
        return silent

    def load(
        self,
        task: Task,
        segments: Segments,
        *,
        training: bool = False,
        read: Read = read_signal,
    ) -> WindowSet:
        """Turns of each stretch; with `halves` a training has those of either half too.

        A half has the same teeth and other noise.

        Raises
        ------
        DatasetError    for a stretch without a whole turn
        """
        rate = task.dataset.sampling_rate
        speed_rpm, teeth = _speed_rpm(task).tolist(), teeth_of_records(task.dataset)
        sound_turns = self._sound_turns(task, read)
        gathered = _Gathered(inputs=self, sampling_rate=rate)
        for row in segments.rows():
            record, start, _ = row
            signal = read(task, *row)
            speed, n_teeth = speed_rpm[record], tuple(teeth[record].tolist())
            passages_per_sample = speed / 60 * n_teeth[0] / rate
            for first, part in _parts(signal, halves=training and self.halves):
                try:
                    of_part = self.turns(part, rate, speed, n_teeth)
                except ValueError as error:
                    if part is signal:
                        raise DatasetError(
                            f"record {record}: {error}; this model needs longer records"
                        ) from None
                    continue  # half a stretch may be too short
                passages = (start + first) * passages_per_sample
                compared = [Steady(of_part, speed / 60 * n_teeth[0])]
                gathered.add([*compared, *sound_turns(record)], record, passages)
        if training and self.redraws:
            self._add_redraws(task, segments, gathered)
        record_of, passage = np.array(gathered.record), np.array(gathered.passages)
        targets = record_targets(task.dataset, record_of)
        targets["position"] = fault_positions(
            task.dataset, record_of, passage, teeth[record_of]
        )
        targets["entry"] = tooth_entries(task.dataset, record_of, passage)
        windows = gathered.windows(task.labels()[record_of], task.normalise)
        return replace(windows, targets=targets)

    def of_recording(self, recording: RecordedSignal) -> WindowSet:
        """Turns of a whole recording.

        Raises
        ------
        ConfigError    for an unknown speed or unknown teeth, less than a turn, and healthy
            recordings that are missing or that the network does not take
        """
        file, speed_rpm = recording.file, recording.speed_rpm
        n_teeth = self.n_teeth or recording.n_teeth
        if speed_rpm is None:
            raise ConfigError(
                "this model looks at turns and must know the speed: "
                f"say --speed-rpm of {file}"
            )
        if n_teeth is None:
            raise ConfigError(
                "this model looks at turns and must know the teeth of both gears: "
                f"say --teeth of {file}, of the driving gear first"
            )
        if self.compares != bool(recording.healthy):
            raise ConfigError(HEALTHY_NEEDED if self.compares else NO_HEALTHY)
        rate, mesh = recording.sampling_rate, speed_rpm / 60 * n_teeth[0]
        if 0.5 * rate < LEAST_HARMONICS * mesh:
            raise ConfigError(
                f"{file}: {rate:.5g} samples a second hold {0.5 * rate / mesh:.1f} harmonics of "
                f"the mesh at {mesh:.5g} Hz, and this model needs {LEAST_HARMONICS}: measure at "
                f"{2 * LEAST_HARMONICS * mesh:.5g} or more, or at a lower speed"
            )
        try:
            compared = [
                Steady(
                    self.turns(signal, rate, speed, n_teeth), speed / 60 * n_teeth[0]
                )
                for signal, speed in (
                    (recording.signal, speed_rpm),
                    *((other.signal, other.speed_rpm) for other in recording.healthy),
                )
            ]
        except ValueError as error:
            raise ConfigError(f"{file}: {error}") from None
        gathered = _Gathered(inputs=self, sampling_rate=rate)
        gathered.add(compared, 0, 0.0)
        nothing = np.zeros(len(gathered.record), dtype=np.int64)
        return gathered.windows(nothing, recording.normalise)

    def seconds(self, *, window: float, recording: float) -> float:
        """Seconds of the whole recording."""
        return recording

    def turns(
        self,
        signal: FloatArray,
        sampling_rate: float,
        speed_rpm: float,
        n_teeth: tuple[int, int],
    ) -> GearTurns:
        """Turns of both gears and the mean passage of one recording.

        Parameters
        ----------
        signal : (channel, sample) m/s^2
        sampling_rate : Hz
        speed_rpm : of the driving gear, constant
        n_teeth : of the driving and the driven gear

        Raises
        ------
        ValueError    for less than a turn of the driving gear
        """
        turns = separate_gears(
            signal,
            sampling_rate,
            speed_rpm / 60 * n_teeth[0],
            n_teeth,
            samples_per_tooth=self.samples_per_tooth,
        )
        return self.prepared(turns)

    def prepared(self, turns: GearTurns) -> GearTurns:
        """Turns as the network looks at them: whitened, if the input says so of each by itself."""
        if self.whitened is True:
            return whitened_turns(turns)
        return turns

    def packed(
        self, turns: GearTurns, sound: Sequence[GearTurns] = ()
    ) -> NDArray[np.float32]:
        """Turns of both gears and the mean passage of a recording, one after the other.

        Those of what no other tooth explains, and of what healthy recordings do not explain, follow
        where the input has them.

        Parameters
        ----------
        turns : of the recording
        sound : of healthy recordings of the same machine, see
            `gensig.signals.alignment.changed_turns`

        Returns
        -------
        (channel, point) float32 in the signal's unit, see `diagnose.data.packed_turns`
        """
        gears = [self._teeth(turns.driving), self._teeth(turns.driven)]
        further: list[FloatArray] = []
        if self.unexplained:
            further += [gear.rest for gear in unexplained_teeth(*gears)]
        if sound:
            changed = changed_turns(turns, sound)
            further += [self._teeth(changed.driving), self._teeth(changed.driven)]
        return packed(gears, turns.mesh, further)

    def levels(self, turns: GearTurns) -> NDArray[np.float32]:
        """(feature,) of `diagnose.data.turn_levels`."""
        driving, driven = self._teeth(turns.driving), self._teeth(turns.driven)
        return turn_levels(driving, driven, turns.mesh)

    def of_gear(self, array: NDArray[np.float32], gear: str, entry: int) -> FloatArray:
        """(channel, tooth, sample) mean turn of a gear, with the mean passage of the mesh.

        Parameters
        ----------
        array : (channel, point) of `packed`
        gear : of `diagnose.data.targets.GEARS`
        entry : sample of a passage from which teeth begin
        """
        driving, driven, mesh = turns_of(array, self.samples_per_tooth)
        turn = {GEARS[1]: driving, GEARS[2]: driven}[gear]
        whole = turn + mesh[:, None]
        return self._teeth(np.roll(whole.reshape(len(turn), -1), -entry, axis=-1))

    def _teeth(self, turn: FloatArray) -> FloatArray:
        """(channel, tooth, sample) of a turn (channel, sample)."""
        return turn.reshape(len(turn), -1, self.samples_per_tooth)

    def inputs_of(
        self, compared: Sequence[Steady], sampling_rate: float
    ) -> list[tuple[GearTurns, list[GearTurns]]]:
        """Turns and those of healthy recordings, for every input of a recording.

        Parameters
        ----------
        compared : the recording, and the healthy ones of its machine
        sampling_rate : Hz
        """
        turns, *sound = [each.turns for each in compared]
        if self.whitened == MACHINE:
            frequencies = [each.mesh_frequency for each in compared]
            turns, *sound = without_ringing([turns, *sound], frequencies, sampling_rate)
        if not self.each_channel:
            return [(turns, sound)]
        return [
            (turns.of_channel(index), [other.of_channel(index) for other in sound])
            for index in range(len(turns.mesh))
        ]

    def _sound_turns(self, task: Task, read: Read) -> Callable[[int], list[Steady]]:
        """Function that returns the turns of the reference of a record; none without references.

        Raises
        ------
        ConfigError    for a record without a reference
        """
        if not self.compares:
            return lambda record: []
        chosen = all_references(task, reference_kind(self.reference))
        n_samples, rate = int(task.dataset.n_samples), task.dataset.sampling_rate
        speed_rpm, teeth = _speed_rpm(task), teeth_of_records(task.dataset)

        @functools.cache
        def turns(other: int) -> Steady:
            signal, speed = read(task, other, 0, n_samples), float(speed_rpm[other])
            driving, driven = teeth[other].tolist()
            return Steady(
                self.turns(signal, rate, speed, (driving, driven)), speed / 60 * driving
            )

        def of_record(record: int) -> list[Steady]:
            if not chosen[record]:
                raise ConfigError(
                    f"record {record} has no healthy record of its machine to compare with: "
                    "make the data set with plan.n_reference=1, or leave reference=none"
                )
            return [turns(other) for other in chosen[record]]

        return of_record

    def _add_redraws(self, task: Task, segments: Segments, gathered: _Gathered) -> None:
        """Take in the records of the segments as those of machines drawn anew."""
        sound: Sequence[Sequence[int]] = ()
        if self.compares:
            sound = all_references(task, reference_kind(self.reference))
        redrawn = RedrawnTurns(task, self.samples_per_tooth, self.redraws)
        for record in segments.record.tolist():
            others = sound[record] if sound else ()
            for drawn in redrawn.of_record(record, others):
                compared = [
                    Steady(self.prepared(turns), frequency)
                    for turns, frequency in drawn
                ]
                gathered.add(compared, record, 0.0)


@dataclass(slots=True, kw_only=True)
class _Gathered:
    """Inputs that are gathered one by one, with their records and the passages before them."""

    inputs: Turns
    sampling_rate: float
    signals: list[NDArray[np.float32]] = field(default_factory=list)
    levels: list[NDArray[np.float32]] = field(default_factory=list)
    record: list[int] = field(default_factory=list)
    passages: list[float] = field(default_factory=list)

    def add(self, compared: Sequence[Steady], record: int, passages: float) -> None:
        """Take in all inputs of a recording and of the healthy ones of its machine."""
        for turns, sound in self.inputs.inputs_of(compared, self.sampling_rate):
            self.signals.append(self.inputs.packed(turns, sound))
            self.levels.append(self.inputs.levels(turns))
            self.record.append(record)
            self.passages.append(passages)

    def windows(self, label: NDArray[Any], normalise: str) -> WindowSet:
        """All inputs as windows that fill their signals."""
        return WindowSet(
            signals=tuple(self.signals),
            segment=np.arange(len(self.signals)),
            start=np.zeros(len(self.signals), dtype=np.int64),
            label=label,
            record=np.array(self.record),
            window_samples=max(signal.shape[-1] for signal in self.signals),
            normalise=normalise,
            n_header=HEADER,
            levels=np.stack(self.levels),
        )


def _checked_whitening(value: Any) -> bool | str:
    if value not in (True, False, MACHINE):
        raise ConfigError(
            f"model.{WHITENED} must be true, false or {MACHINE}, not {value!r}"
        )
    return value if value == MACHINE else bool(value)


def _speed_rpm(task: Task) -> FloatArray:
    """(record,) speed of the driving gear."""
    return np.asarray(task.dataset.column("speed_rpm"), dtype=float)


def _parts(
    signal: NDArray[np.float32], *, halves: bool
) -> list[tuple[int, NDArray[np.float32]]]:
    """First sample and signal of the whole and, if wanted, of its two halves."""
    parts = [(0, signal)]
    if halves:
        middle = signal.shape[-1] // 2
        parts += [(0, signal[:, :middle]), (middle, signal[:, middle : 2 * middle])]
    return parts
