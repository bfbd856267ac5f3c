"""Everything that a set of implants is made of, and the words of its folder that name it.

The words are `overrides.yaml`: a key and a value in JSON each. Places are relative to the folder,
so that a tree that is moved as a whole stays together.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gensig.dataset.folder.layout import OVERRIDES, read_overrides
from gensig.dataset.reader import open_dataset
from gensig.errors import DatasetError
from gensig.implants.gearing import Gearing
from gensig.implants.implanting import Given, Implanter, taken_recordings
from gensig.implants.options import ImplantOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class ImplantSources:
    """Sources and choices of a set of implants.

    Attributes
    ----------
    data : folder of the simulated set
    healthy : recordings: files, or as they were loaded elsewhere
    teeth : driving and driven gear of each stage in turn
    speed_rpm : of the driving shaft, one or one a recording
    options : choices of the set
    sampling_rate, channels, unit, array, tacho : how files are read, see
        `gensig.implants.carriers.read_healthy`
    pulses_per_turn : of the tacho
    """

    data: Path
    healthy: Sequence[Given]
    teeth: tuple[int, ...]
    speed_rpm: tuple[float, ...]
    options: ImplantOptions = field(default_factory=ImplantOptions)
    sampling_rate: float | None = None
    channels: tuple[str, ...] | None = None
    unit: str = "m/s2"
    array: str | None = None
    tacho: str | None = None
    pulses_per_turn: int = 1

    @property
    def files(self) -> tuple[Path, ...] | None:
        """The recordings as files; None where one was loaded elsewhere."""
        paths = [Path(each) for each in self.healthy if isinstance(each, str | Path)]
        if len(paths) < len(self.healthy):
            return None
        return tuple(path.expanduser() for path in paths)


def open_implanter(sources: ImplantSources) -> Implanter:
    """Implanter of sources; its simulated set, ``pairs.data``, is the caller's to close.

    Raises
    ------
    ConfigError, DatasetError    with one line, for what cannot be used
    """
    gearing = Gearing(teeth=sources.teeth)
    data = open_dataset(sources.data.expanduser())
    try:
        recordings = taken_recordings(
            sources.healthy,
            sampling_rate=sources.sampling_rate,
            channels=sources.channels,
            unit=sources.unit,
            array=sources.array,
            tacho=sources.tacho,
        )
        return Implanter(
            data,
            recordings,
            gearing,
            sources.speed_rpm,
            sources.options,
            pulses_per_turn=sources.pulses_per_turn,
        )
    except BaseException:
        data.close()
        raise


def source_words(sources: ImplantSources, out: Path) -> list[str]:
    """Words that name the sources of a folder, as `read_sources` reads them."""
    options, files = sources.options, sources.files
    healthy = None
    if files is not None:
        healthy = [_place(file, out) for file in files]
    values = {
        "data": _place(sources.data, out),
        "healthy": healthy,
        "teeth": sources.teeth,
        "speed_rpm": sources.speed_rpm,
        "gain_db": options.gain_db,
        "path": options.path,
        "residual": options.residual,
        "records": options.n_records,
        "duration": options.duration,
        "held_out": options.held_out,
        "plain_healthy": options.plain_healthy,
        "seed": options.seed,
        "sampling_rate": sources.sampling_rate,
        "channels": sources.channels,
        "unit": sources.unit,
        "array": sources.array,
        "tacho": sources.tacho,
        "pulses_per_turn": sources.pulses_per_turn,
    }
    return [f"{name}={json.dumps(value)}" for name, value in values.items()]


def read_sources(out: Path) -> ImplantSources:
    """Sources of a folder by its words; nothing that they name is looked at.

    Raises
    ------
    DatasetError    for words that are not those of `source_words`, and for recordings that were
                    no files
    """
    words = [word.partition("=") for word in read_overrides(out)]
    try:
        given = {name: READERS[name](json.loads(text)) for name, _, text in words}
        healthy, teeth = given["healthy"], given["teeth"]
        speed_rpm, data = given["speed_rpm"], given["data"]
        options = ImplantOptions(
            gain_db=given["gain_db"],
            path=given["path"],
            residual=given["residual"],
            n_records=given["records"],
            duration=given["duration"],
            held_out=given["held_out"],
            plain_healthy=given["plain_healthy"],
            seed=given["seed"],
        )
        reading = {name: given[name] for name in OF_READING}
    except (ArithmeticError, LookupError, RecursionError, TypeError, ValueError):
        raise DatasetError(
            f"{out / OVERRIDES} does not name the sources of a set of implants; restore it from "
            "a copy"
        ) from None
    if healthy is None:
        raise DatasetError(
            f"{out} is made of recordings that were in memory, and no file has them: give "
            "gensig.implant the same ones and another out"
        )
    return ImplantSources(
        data=_found(data, out),
        healthy=tuple(_found(file, out) for file in healthy),
        teeth=teeth,
        speed_rpm=speed_rpm,
        options=options,
        **reading,
    )


def _place(path: Path, out: Path) -> str:
    """A path seen from a folder."""
    return os.path.relpath(path.expanduser().resolve(), out.expanduser().resolve())


def _found(place: str, out: Path) -> Path:
    """The path of a place seen from a folder, without steps up where they cancel out."""
    return Path(os.path.normpath(out.expanduser().resolve() / place))


def _text(value: Any) -> str:
    if not isinstance(value, str) or "\0" in value:
        raise TypeError
    return value


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError
    return float(value)


def _whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise TypeError
    return value


def _several(kind: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def read(value: Any) -> tuple[Any, ...]:
        if not isinstance(value, list):
            raise TypeError
        return tuple(map(kind, value))

    return read


def _or_none(kind: Callable[[Any], Any]) -> Callable[[Any], Any]:
    return lambda value: None if value is None else kind(value)


READERS: Mapping[str, Callable[[Any], Any]] = {
    "data": _text,
    "healthy": _or_none(_several(_text)),
    "teeth": _several(_whole),
    "speed_rpm": _several(_number),
    "gain_db": _several(_number),
    "path": _text,
    "residual": _text,
    "records": _whole,
    "duration": _or_none(_number),
    "held_out": _number,
    "plain_healthy": _number,
    "seed": _whole,
    "sampling_rate": _or_none(_number),
    "channels": _or_none(_several(_text)),
    "unit": _text,
    "array": _or_none(_text),
    "tacho": _or_none(_text),
    "pulses_per_turn": _whole,
}
OF_READING = ("sampling_rate", "channels", "unit", "array", "tacho", "pulses_per_turn")
