"""A measured set as it lies in a folder: files found, classes, hashes, and what is missing."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from gensig.errors import ConfigError
from gensig.measured.measured_set import MeasuredRecording, MeasuredSet
from gensig.measured.set_facts import (
    USER_FILE,
    FileFacts,
    SetFacts,
    shipped_facts,
    shipped_names,
    user_facts,
)
from gensig.text.ordinary_file import open_ordinary

MOST_FILES = 50_000  # of a folder
MOST_OTHERS = 12  # that are named
HASHED_AT_ONCE = 1 << 22  # bytes
# what macOS adds to archives
SKIPPED_FOLDERS = ("__MACOSX",)
SKIPPED_PREFIX = "._"
# fact -> attribute of a recording that is empty without it
NEEDED = {
    "sampling_rate_hz": "sampling_rate",
    "speed_rpm": "shaft_frequency",
    "stages": "train",
}


def sets() -> tuple[str, ...]:
    """Names of the public sets whose layout is known."""
    return shipped_names()


def load(name: str | None, folder: str | Path) -> MeasuredSet:
    """A measured set in a folder; its samples are read by `gensig.measured.read_signal`.

    Parameters
    ----------
    name : of a known set; None for a folder with a ``measured.yaml`` of its own
    folder : where the user unpacked it, or the YAML of a folder. ``measured.yaml`` in the folder
        of a known set fills in what no source states

    Raises
    ------
    ConfigError    for an unknown set, a YAML that cannot be used, and a folder of another layout
    """
    place = Path(folder).expanduser()
    if place.is_file():
        facts, root = user_facts(place), place.parent
    elif not place.is_dir():
        raise ConfigError(
            f"{folder} is no folder; give the one that holds the recordings"
        )
    else:
        facts, root = _facts_of(name, place), place
    if name is not None and facts.name != name and place.is_file():
        raise ConfigError(
            f"{folder} describes '{facts.name}', not '{name}'; leave {name} out"
        )
    return _found(facts, root)


def _facts_of(name: str | None, folder: Path) -> SetFacts:
    """Facts of a known set or of the YAML of a folder, or of both."""
    own = folder / USER_FILE
    if name is None and not own.exists():
        raise ConfigError(
            f"{folder} has no {USER_FILE}; name a known set ({', '.join(shipped_names())}), or "
            "write one: docs/howto/predict.md"
        )
    if name is None:
        return user_facts(own)
    known = shipped_facts(name)
    if not own.exists():
        return known
    facts = user_facts(own)
    if facts.name != name:
        raise ConfigError(
            f"{own} describes '{facts.name}', not '{name}'; write set: {name}"
        )
    return facts


def _found(facts: SetFacts, root: Path) -> MeasuredSet:
    """The set with the recordings that its patterns find."""
    recordings: list[MeasuredRecording] = []
    others: list[str] = []
    matched = [False] * len(facts.files)
    for path in sorted(_files_below(root)):
        below = path.relative_to(root).as_posix()
        found = [
            (index, fields)
            for index, kind in enumerate(facts.files)
            if (fields := kind.pattern.match(below)) is not None
        ]
        if not found:
            others.append(below)
            continue
        digest = _sha256(path)
        for index, fields in found:
            matched[index] = True
            recordings += _recordings(
                facts, facts.files[index], path, below, digest, fields
            )
    _check_layout(facts, root, matched, others)
    others = [name for name in others if name != USER_FILE]
    return MeasuredSet(
        name=facts.name,
        title=facts.title,
        licence=facts.licence,
        folder=root,
        recordings=tuple(recordings),
        others=tuple(others[:MOST_OTHERS]),
        n_others=len(others),
        sources=facts.sources,
        missing=_missing(facts, recordings),
    )


def _check_layout(
    facts: SetFacts, root: Path, matched: list[bool], others: list[str]
) -> None:
    """Raise ConfigError where no pattern finds a file; a user's patterns must find one each."""
    of_user = not facts.sources
    if any(matched) and (all(matched) or not of_user):
        return
    wanted = ", ".join(
        kind.pattern.text
        for kind, is_found in zip(facts.files, matched, strict=True)
        if not is_found
    )
    holds = ", ".join(others[:4]) or "no file"
    if len(others) > 4:
        holds += f" and {len(others) - 4} more"
    raise ConfigError(
        f"{root} is not laid out as '{facts.name}': no file is named {wanted}; it holds {holds}"
    )


def _recordings(
    facts: SetFacts,
    kind: FileFacts,
    path: Path,
    below: str,
    digest: str,
    fields: dict[str, str],
) -> Iterator[MeasuredRecording]:
    """The recordings of one file: one, or one a row of its array."""
    machine = kind.machine or facts.name
    place = replace(facts.place, array=kind.array)
    classes: tuple[str | None, ...] = kind.rows or (
        kind.own_class or fields.get("class"),
    )
    for row, own in enumerate(classes):
        assert own is not None
        name, its_place = below, place
        if kind.array is not None:
            name = f"{below}:{kind.array}"
        if kind.rows:
            name, its_place = f"{name}[{row}]", replace(place, row=row)
        specimen = fields.get("specimen") or kind.specimen or own
        yield MeasuredRecording(
            name=name,
            file=path,
            sha256=digest,
            own_class=own,
            label=kind.classes.get(own),
            machine=machine,
            specimen=f"{machine} {specimen}",
            train=kind.train,
            shaft_frequency=_frequency(kind, fields),
            speed_varies=kind.speed_varies,
            load=_load(kind, fields),
            sampling_rate=kind.sampling_rate,
            unit=facts.unit,
            pulses_per_turn=facts.pulses_per_turn,
            place=its_place,
        )


def _frequency(kind: FileFacts, fields: dict[str, str]) -> float | None:
    """Frequency of the driving shaft in Hz, of the name or of the facts."""
    if "speed_hz" in fields:
        return float(fields["speed_hz"])
    if "speed_rpm" in fields:
        return float(fields["speed_rpm"]) / 60.0
    return kind.shaft_frequency


def _load(kind: FileFacts, fields: dict[str, str]) -> str:
    if "torque_nm" in fields:
        return f"{fields['torque_nm']} N m"
    return fields.get("load") or kind.load


def _missing(facts: SetFacts, recordings: list[MeasuredRecording]) -> dict[str, str]:
    """Needed facts that some recording lacks -> reason."""
    missing = {}
    for key, attribute in NEEDED.items():
        lacking = [one for one in recordings if getattr(one, attribute) is None]
        if lacking:
            reason = facts.not_stated.get(key, "not given")
            missing[key] = f"{len(lacking)} of {len(recordings)} recordings: {reason}"
    return missing


def _files_below(root: Path) -> Iterator[Path]:
    """Files of a folder and of those in it; links to elsewhere are refused."""
    n_files = 0
    inside = root.resolve()
    for parent, folders, names in os.walk(root, followlinks=False):
        folders[:] = [name for name in sorted(folders) if name not in SKIPPED_FOLDERS]
        for name in names:
            if name.startswith(SKIPPED_PREFIX):
                continue
            path = Path(parent) / name
            if not path.resolve().is_relative_to(inside):
                raise ConfigError(
                    f"{path} leads out of {root}; recordings must lie in the folder itself"
                )
            n_files += 1
            if n_files > MOST_FILES:
                raise ConfigError(
                    f"{root} holds more than {MOST_FILES} files; give the folder of the set alone"
                )
            if path.is_file():
                yield path


def _sha256(path: Path) -> str:
    digest = hashlib.sha256()
    try:
        with open_ordinary(path) as stream:
            while part := stream.read(HASHED_AT_ONCE):
                digest.update(part)
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}") from None
    return digest.hexdigest()
