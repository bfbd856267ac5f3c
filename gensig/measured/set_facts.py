"""Facts of a measured set as its YAML states them, shipped or a user's.

A user's YAML has the same keys; with ``set: NAME`` it fills in what the shipped one leaves empty.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from gensig.errors import ConfigError
from gensig.measured.file_names import NamePattern, name_pattern
from gensig.measured.measured_set import LABELS, UNKNOWN, GearTrain, SignalPlace
from gensig.measured.yaml_values import Place, entry_list, mapping
from gensig.options.plain_file import LOADER, check_option, option_text
from gensig.text.nearest import hint

USER_FILE = "measured.yaml"
SHIPPED = Path(__file__).with_name("sets")
# of every file, in a set or an entry of its files
RECORDING_KEYS = (
    "sampling_rate_hz",
    "array",
    "stages",
    "faulted_shaft",
    "speed_rpm",
    "load",
    "specimen",
    "machine",
    "classes",
)
SET_KEYS = (
    "set",
    "name",
    "title",
    "fetch",
    "licence",
    "sources",
    "from",
    "not_stated",
    "notes",
    "unit",
    "columns",
    "last_columns",
    "header_lines",
    "channels",
    "tacho",
    "pulses_per_turn",
    "files",
    *RECORDING_KEYS,
)
# about the facts, not of them; machine and pattern come with the files
NOT_FACTS = ("name", "title", "sources", "from", "not_stated", "notes", "set")
FILE_KEYS = ("pattern", "label", "rows", "speed_varies", *RECORDING_KEYS)


@dataclass(frozen=True, slots=True, kw_only=True)
class FileFacts:
    """One kind of files of a set.

    Attributes
    ----------
    pattern : of their names
    classes : class in the words of the set -> label, None for a class that is none of the three
    own_class : class of all of them; None where the name or the row tells it
    rows : class of each row of the array, for files whose rows are recordings
    shaft_frequency : Hz    None where the name tells it or nobody does
    """

    pattern: NamePattern
    classes: Mapping[str, str | None]
    own_class: str | None
    rows: tuple[str, ...]
    machine: str
    specimen: str | None
    load: str
    train: GearTrain | None
    shaft_frequency: float | None
    speed_varies: bool
    sampling_rate: float | None
    array: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class SetFacts:
    """A set: where it comes from, the form of its files, and who says so.

    Attributes
    ----------
    sources : name of a source -> its address
    stated_by : key -> names of the sources that state it
    not_stated : key -> reason why it is empty
    """

    name: str
    title: str
    fetch: str
    licence: str
    unit: str
    place: SignalPlace
    pulses_per_turn: float | None
    files: tuple[FileFacts, ...]
    sources: Mapping[str, str] = field(default_factory=dict)
    stated_by: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    not_stated: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def shipped_names() -> tuple[str, ...]:
    """Names of the sets whose layout is known."""
    return tuple(sorted(path.stem for path in SHIPPED.glob("*.yaml")))


def shipped_facts(name: str) -> SetFacts:
    """Facts of a known set.

    Raises
    ------
    ConfigError    for another name
    """
    return set_facts(_shipped_tree(name), f"set {name}", name)


def user_facts(path: Path) -> SetFacts:
    """Facts of a user's YAML, on top of the known set that it names.

    Raises
    ------
    ConfigError    for anything but plain values of known keys
    """
    tree = plain_tree(path)
    known = Place(str(path), tree).text("set")
    if known is not None:
        tree = {**_shipped_tree(known), **tree}
    name = path.stem
    if path.name == USER_FILE:
        name = path.resolve().parent.name
    return set_facts(tree, str(path), known or name)


def plain_tree(path: Path) -> dict[str, Any]:
    """Keys and values of a YAML file in its folder; no tags, a bounded size.

    Raises
    ------
    ConfigError    for a file that cannot be used
    """
    text = option_text(path, path.parent)
    check_option(path, text)
    tree = yaml.load(text, Loader=LOADER)
    return mapping({} if tree is None else tree, str(path))


def _shipped_tree(name: str) -> dict[str, Any]:
    if name not in shipped_names():
        raise ConfigError(
            f"there is no measured set '{name}'; {hint(name, shipped_names())}"
        )
    return plain_tree(SHIPPED / f"{name}.yaml")


def set_facts(tree: Mapping[str, Any], where: str, name: str) -> SetFacts:
    """Facts of the keys of a YAML.

    Raises
    ------
    ConfigError    naming the key: unknown, of another type, or out of its range
    """
    values = Place(where, tree)
    values.refuse_unknown(SET_KEYS)
    origins = values.within("from")
    files = entry_list(values.raw("files"), where)
    if not files:
        raise ConfigError(
            f"{where}: no files; give files: a pattern and a label for each"
        )
    return SetFacts(
        name=values.text("name") or name,
        title=values.text("title") or "",
        fetch=values.text("fetch") or "",
        licence=values.text("licence") or "",
        unit=values.text("unit") or UNKNOWN,
        place=SignalPlace(
            columns=values.texts("columns"),
            last_columns=values.texts("last_columns"),
            header_lines=values.whole("header_lines", 0, 10_000),
            channels=values.texts("channels"),
            tacho=values.text("tacho"),
        ),
        pulses_per_turn=values.number("pulses_per_turn", 1e-3, 1e5),
        files=tuple(
            _file_facts(
                Place(f"{where}: files {index}", {**_shared(tree), **entry}), entry
            )
            for index, entry in enumerate(files, start=1)
        ),
        sources=values.text_map("sources"),
        stated_by={key: origins.texts(key) for key in origins.names()},
        not_stated=values.text_map("not_stated"),
        notes=values.texts("notes"),
    )


def _shared(tree: Mapping[str, Any]) -> dict[str, Any]:
    """Facts of the set that hold for each of its files."""
    return {key: tree[key] for key in RECORDING_KEYS if key in tree}


def _file_facts(values: Place, entry: Mapping[str, Any]) -> FileFacts:
    """Facts of one kind of files; `entry` has the keys of its own."""
    Place(values.where, entry).refuse_unknown(FILE_KEYS)
    classes = _classes(values)
    label = values.text("label")
    rows = tuple(own for own, n in _row_blocks(values) for _ in range(n))
    pattern = name_pattern(values.required("pattern"), classes, values.where)
    if label is not None and label not in classes:
        if label not in LABELS:
            raise ConfigError(
                f"{values.where}: the label '{label}' is none of {', '.join(LABELS)}, and classes "
                "does not map it to one"
            )
        classes = {**classes, label: label}
    told = [label is not None, "{class}" in pattern.text, bool(rows)]
    if sum(told) != 1:
        raise ConfigError(
            f"{values.where}: the class is told {sum(told)} times; give label, {{class}} in the "
            "pattern, or rows"
        )
    if unknown := [own for own in rows if own not in classes]:
        raise ConfigError(
            f"{values.where}: rows has '{unknown[0]}', which classes does not"
        )
    speed = values.number("speed_rpm", 1.0, 1e6)
    return FileFacts(
        pattern=pattern,
        classes=classes,
        own_class=label,
        rows=rows,
        machine=values.text("machine") or "",
        specimen=values.text("specimen"),
        load=values.text("load") or "",
        train=_train(values),
        shaft_frequency=speed and speed / 60.0,
        speed_varies=values.flag("speed_varies"),
        sampling_rate=values.number("sampling_rate_hz", 1000.0, 1e6),
        array=values.text("array"),
    )


def _classes(values: Place) -> dict[str, str | None]:
    """Class -> label; None for a class that is none of the three."""
    classes: dict[str, str | None] = {}
    for own, label in mapping(
        values.raw("classes") or {}, f"{values.where}: classes"
    ).items():
        if label is not None and label not in LABELS:
            raise ConfigError(
                f"{values.where}: classes maps '{own}' to '{label}'; allowed: {', '.join(LABELS)}, "
                "or nothing"
            )
        classes[str(own)] = label
    return classes


def _row_blocks(values: Place) -> list[tuple[str, int]]:
    """Class and number of rows of each block of an array."""
    blocks = values.raw("rows") or []
    is_plain = isinstance(blocks, list) and all(
        isinstance(block, list)
        and len(block) == 2
        and isinstance(block[1], int)
        and 0 < block[1] <= 100_000
        for block in blocks
    )
    if not is_plain:
        raise ConfigError(
            f"{values.where}: rows must be a list of [class, number of rows]"
        )
    return [(str(own), n) for own, n in blocks]


def _train(values: Place) -> GearTrain | None:
    """Gear pairs of the stages; None where no teeth are given."""
    stages = values.raw("stages")
    if stages is None:
        return None
    is_plain = isinstance(stages, list) and all(
        isinstance(pair, list)
        and len(pair) == 2
        and all(type(n) is int and 4 <= n <= 2000 for n in pair)
        for pair in stages
    )
    if not stages or not is_plain:
        raise ConfigError(
            f"{values.where}: stages must be pairs of teeth, driving and driven, "
            "such as [[32, 80], [48, 64]]"
        )
    shaft = values.whole("faulted_shaft", 1, len(stages) + 1)
    return GearTrain(stages=tuple((a, b) for a, b in stages), faulted_shaft=shaft)
