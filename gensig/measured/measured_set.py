"""Values of a measured set: its gears, its recordings, and what nobody stated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

HEALTHY, ONE_TOOTH, MANY_TEETH = "healthy", "one_tooth", "many_teeth"
LABELS = (HEALTHY, ONE_TOOTH, MANY_TEETH)
# units whose values are accelerations; values of any other unit are compared with each other only
ACCELERATIONS = ("m/s2", "g")
UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True, kw_only=True)
class GearTrain:
    """Gear pairs in series.

    Attributes
    ----------
    stages : teeth of the driving and the driven gear of each stage, from the driving shaft on
    faulted_shaft : number of the shaft that carries the faulty gear, 1 is the driving shaft; None
        where it is not known
    """

    stages: tuple[tuple[int, int], ...]
    faulted_shaft: int | None = None

    def shaft_ratio(self, shaft: int) -> float:
        """Turns of a shaft, counted from 1, for a turn of the driving shaft."""
        ratio = 1.0
        for driving, driven in self.stages[: shaft - 1]:
            ratio *= driving / driven
        return ratio

    def mesh_orders(self) -> tuple[float, ...]:
        """Mesh frequency of each stage over the frequency of the driving shaft."""
        return tuple(
            driving * self.shaft_ratio(index)
            for index, (driving, _) in enumerate(self.stages, start=1)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalPlace:
    """Place and form of the samples of a recording in its file.

    Attributes
    ----------
    array : name of the array of a .npz, .h5 or .mat file; None is the usual one
    row : of an array whose rows are recordings; None takes all rows as channels
    columns : names of the columns of a table without names, empty where it has them
    last_columns : names of the last columns of a table without names, the others are left alone
    header_lines : lines before the numbers; None looks for the first line of numbers
    channels : names of the channels to use; empty takes all but `tacho`
    tacho : channel of the pulses of the driving shaft, None where there is none
    """

    array: str | None = None
    row: int | None = None
    columns: tuple[str, ...] = ()
    last_columns: tuple[str, ...] = ()
    header_lines: int | None = None
    channels: tuple[str, ...] = ()
    tacho: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredRecording:
    """One recording, described; `gensig.measured.read_signal` reads its samples.

    Attributes
    ----------
    name : file below the folder, with array or row where the file holds several
    file : the file
    sha256 : of the file, hexadecimal
    own_class : class in the words of the set
    label : healthy, one_tooth or many_teeth; None where the class is none of these
    machine, specimen : recordings of one specimen share gears and assembly
    train : None where the teeth are not known
    shaft_frequency : Hz    of the driving shaft, None where it is not known
    speed_varies : True for a course of speeds, of which `shaft_frequency` is the nominal one
    load : in the words of the set
    sampling_rate : Hz    None where it is not known
    unit : m/s2, g, another or ``unknown``
    pulses_per_turn : of the tacho, None where it is not known
    """

    name: str
    file: Path
    sha256: str
    own_class: str
    label: str | None
    machine: str
    specimen: str
    train: GearTrain | None
    shaft_frequency: float | None
    speed_varies: bool
    load: str
    sampling_rate: float | None
    unit: str
    pulses_per_turn: float | None
    place: SignalPlace

    @property
    def is_acceleration(self) -> bool:
        """True where the level of the samples is known in m/s2."""
        return self.unit in ACCELERATIONS


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredSet:
    """A measured set as it lies in a folder.

    Attributes
    ----------
    name, title, licence : licence is the wording of the source, empty where none states it
    folder : where it was found
    recordings : in the order of their names
    others : files of the folder that belong to no recording, at most `MOST_OTHERS` of them
    n_others : number of such files
    sources : fact -> source that states it
    missing : fact -> reason; to be given in the YAML before a recording can be used
    """

    name: str
    title: str
    licence: str
    folder: Path
    recordings: tuple[MeasuredRecording, ...]
    others: tuple[str, ...]
    n_others: int
    sources: Mapping[str, str]
    missing: Mapping[str, str]

    def machines(self) -> tuple[str, ...]:
        """Names of the machines, in order of appearance."""
        return tuple(dict.fromkeys(one.machine for one in self.recordings))

    def of_machine(self, machine: str) -> tuple[MeasuredRecording, ...]:
        """Recordings of one machine."""
        return tuple(one for one in self.recordings if one.machine == machine)


def specimens(recordings: tuple[MeasuredRecording, ...]) -> dict[str, tuple[str, ...]]:
    """Label -> names of its sets of gears, of recordings that have a label."""
    found: dict[str, dict[str, None]] = {}
    for one in recordings:
        if one.label is not None:
            found.setdefault(one.label, {})[one.specimen] = None
    return {label: tuple(found[label]) for label in LABELS if label in found}
