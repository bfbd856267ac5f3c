"""Groups, their options, and the keys of an option with value, unit and comment.

Read from the text of the configuration files, comments included, without Hydra: quick enough for
completion at a key press. The description of a group is its comment in the defaults list of the
primary file.
"""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import yaml

from gensig.errors import ConfigError
from gensig.options.defaults_lists import OptionCounts
from gensig.options.plain_file import LOADER, check_choice, check_option, option_text
from gensig.units import split_unit

PRIMARY = ("generate", "train")
USER_FOLDER = "configs"  # default folder of a user's options
# suffix of a key -> unit as engineers write it; other suffixes are units already
WRITTEN = {
    "mpa_sqrt_m": "MPa sqrt(m)",
    "kg_m2": "kg m2",
    "w_per_m2k": "W/(m2 K)",
    "w_per_mk": "W/(m K)",
    "j_per_kgk": "J/(kg K)",
    "per_k": "1/K",
    "degc": "degC",
    "n_per_m": "N/m",
    "ns_per_m": "N s/m",
    "nm_per_rad": "N m/rad",
    "knm_per_rad": "kN m/rad",
    "mnm_per_rad": "MN m/rad",
    "nms_per_rad": "N m s/rad",
    "rpm": "r/min",
    "nm": "N m",
    "n": "N",
    "hz": "Hz",
    "gpa": "GPa",
    "mpa": "MPa",
    "hbs": "HBS",
    "db": "dB",
}
SENTENCE_END = re.compile(r"(?<!\bal)(?<!\beq)\.\s+(?=[A-Z<0-9]|docs/)")
EXPONENT = re.compile(r"[-+]?[0-9.]+[eE][-+]?[0-9]+")


@dataclass(frozen=True, slots=True, kw_only=True)
class Key:
    """One key of an option.

    Attributes
    ----------
    name : dotted name
    text : value as the file writes it
    value : value as it is read
    unit, comment : empty where there is none
    """

    name: str
    text: str
    value: Any
    unit: str
    comment: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """One group: its subject, its default option, and the primary file that has it."""

    name: str
    about: str
    default: str | None
    primary: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """One option of a group, and its file."""

    name: str
    about: str
    file: Path


@dataclass(frozen=True, slots=True)
class _Default:
    """An entry of a defaults list; ``group`` None for an option of the file's group."""

    group: str | None
    option: Any
    comment: str


class _File:
    """One configuration file: its tree with positions, and its lines for the comments."""

    def __init__(self, path: Path, folder: Path) -> None:
        self.path = path
        self.source = option_text(path, folder)
        self.lines = self.source.splitlines()

    @cached_property
    def tree(self) -> Any:
        check_option(self.path, self.source)
        return yaml.compose(self.source, Loader=LOADER)

    @property
    def is_global(self) -> bool:
        """True where its keys are those of the whole configuration."""
        head = [line.replace(" ", "") for line in self.lines[:3]]
        return "#@package_global_" in head

    def about(self) -> str:
        """The first sentence of the comment at the top."""
        words: list[str] = []
        for line in self.lines:
            if not line.startswith("#"):
                break
            text = line.lstrip("# ")
            if not text.startswith("@package"):
                words.append(text.strip())
        return SENTENCE_END.split(" ".join(words))[0].rstrip(".")

    def defaults(self) -> list[_Default]:
        """The entries of its defaults list."""
        if not isinstance(self.tree, yaml.MappingNode):
            return []
        for key, value in self.tree.value:
            if key.value == "defaults" and isinstance(value, yaml.SequenceNode):
                return [self._default(node) for node in value.value]
        return []

    def _default(self, node: Any) -> _Default:
        if not isinstance(node, yaml.MappingNode):
            return _Default(None, node.value, "")
        group, option = node.value[0]
        name = None if option.value == "null" else option.value
        return _Default(group.value, name, self._comment(group, option))

    def entries(self, prefix: str = "") -> Iterator[Key]:
        """Every key that holds a value; nested names are dotted."""
        if isinstance(self.tree, yaml.MappingNode):
            yield from self._keys(self.tree, prefix, skipped=("defaults",))

    def _keys(
        self, mapping: Any, prefix: str, *, skipped: Sequence[str] = ()
    ) -> Iterator[Key]:
        for key, value in mapping.value:
            if key.value in skipped:
                continue
            name = f"{prefix}{key.value}"
            is_block = isinstance(value, yaml.MappingNode) and not value.flow_style
            if is_block and key.value != "vary":
                yield from self._keys(value, f"{name}.")
            else:
                yield self._key(name, key, value)

    def _key(self, name: str, key: Any, node: Any) -> Key:
        value = _value(node)
        text = self.source[node.start_mark.index : node.end_mark.index]
        if isinstance(node, yaml.CollectionNode):
            text = yaml.safe_dump(
                value, default_flow_style=True, sort_keys=False, width=10**6
            ).strip()
        return Key(
            name=name,
            text=text,
            value=value,
            unit=_unit(str(key.value)),
            comment=self._comment(key, node),
        )

    def _comment(self, key: Any, value: Any) -> str:
        """The comment after a value with its continuation lines, or the one above its key."""
        is_block = isinstance(value, yaml.CollectionNode) and not value.flow_style
        mark = key.end_mark if is_block else value.end_mark
        rest = self.lines[mark.line][mark.column :]
        after = re.search(r"(?:^|\s)#\s*(.*)$", rest)
        parts = [after.group(1)] if after else []
        for line in self.lines[mark.line + 1 :]:
            is_deeper = _indent(line) > key.start_mark.column
            if not (_is_comment(line) and is_deeper):
                break
            parts.append(line.lstrip().lstrip("# "))
        if not after:
            parts = [*self._comment_above(key), *parts]
        return " ".join(parts)

    def _comment_above(self, key: Any) -> list[str]:
        """Lines of the comment that ends right above a key, at its indentation."""
        above = self.lines[: key.start_mark.line]
        parts: list[str] = []
        while above and _is_comment(above[-1]):
            if _indent(above[-1]) != key.start_mark.column or not _is_separate(above):
                break
            parts.insert(0, above.pop().lstrip().lstrip("# "))
        return parts


def groups(config_dir: str | Path | None = None) -> list[Group]:
    """Every group of the package and of a user's folder, in the order of the primary files."""
    result: dict[str, Group] = {}
    for primary in PRIMARY:
        for entry in _primary(primary).defaults():
            if entry.group is not None and entry.group not in result:
                result[entry.group] = Group(
                    name=entry.group,
                    about=entry.comment,
                    default=entry.option,
                    primary=primary,
                )
    for folder in _folders(config_dir)[1:]:
        for path in sorted(folder.iterdir()):
            if path.is_dir() and path.name not in result and any(path.glob("*.yaml")):
                result[path.name] = Group(
                    name=path.name,
                    about="of your own",
                    default=None,
                    primary=PRIMARY[0],
                )
    return list(result.values())


def options(group: str, config_dir: str | Path | None = None) -> list[Option]:
    """The options of a group; the package's precede a user's of the same name, as in Hydra."""
    files: dict[str, _File] = {}
    for folder in _folders(config_dir):
        for path in (folder / group).glob("*.yaml"):
            if path.stem not in files:
                files[path.stem] = _File(path, folder)
    return [
        Option(name=name, about=file.about(), file=file.path)
        for name, file in sorted(files.items())
    ]


def sections() -> dict[str, str]:
    """Sections of the primary files that offer no choice, each with its primary file.

    Mesh, solver, quality and others; plain keys belong to the section named as the file.
    """
    result: dict[str, str] = {}
    for primary in PRIMARY:
        for key in _primary(primary).entries():
            head, dot, _ = key.name.partition(".")
            result.setdefault(head if dot else primary, primary)
    return result


def section_keys(name: str) -> list[Key]:
    """Keys of one section of a primary file, see `sections`."""
    keys = list(_primary(sections()[name]).entries())
    if name in PRIMARY:
        return [key for key in keys if "." not in key.name]
    return [key for key in keys if key.name.startswith(f"{name}.")]


def option_keys(
    group: str, option: str, config_dir: str | Path | None = None
) -> list[Key]:
    """Keys of one option, with those of the options that it builds on."""
    result: dict[str, Key] = {}
    for key in _option_keys(group, option, group, config_dir):
        before = result.get(key.name)
        if before is not None and not key.comment:
            key = replace(key, comment=before.comment)
        for outer in [name for name in result if key.name.startswith(f"{name}.")]:
            del result[outer]  # null there, a group of keys here
        result[key.name] = key
    return list(result.values())


def chosen_options(
    group: str, option: str, config_dir: str | Path | None = None
) -> dict[str, str]:
    """Options of other groups that an option chooses, with those that it builds on."""
    file = _find(group, option, config_dir)
    result: dict[str, str] = {}
    for entry in file.defaults():
        if entry.group is None and entry.option != "_self_":
            result |= chosen_options(group, entry.option, config_dir)
    for entry in file.defaults():
        if entry.group is not None and entry.group.startswith("override /"):
            result[entry.group.removeprefix("override /")] = str(entry.option)
    return result


def _option_keys(
    group: str, option: str, package: str, config_dir: str | Path | None
) -> Iterator[Key]:
    file = _find(group, option, config_dir)
    for entry in file.defaults():
        if entry.group is None:
            if entry.option != "_self_":
                yield from _option_keys(group, entry.option, package, config_dir)
        elif not entry.group.startswith("override") and entry.option is not None:
            inner, _, key = entry.group.partition("@")
            yield from _option_keys(
                f"{group}/{inner}",
                entry.option,
                f"{package}.{key or inner}",
                config_dir,
            )
    yield from file.entries("" if file.is_global else f"{package}.")


def user_folder() -> Path | None:
    """./configs where it holds options of a user; None where it is gensig's own or another's."""
    folder = Path(USER_FOLDER)
    is_checkout = (folder / f"{PRIMARY[0]}.yaml").exists()
    if not folder.is_dir() or is_checkout or folder.samefile(_folders(None)[0]):
        return None
    names = [group.name for group in groups()]
    if not any(
        path.is_file() for name in names for path in (folder / name).glob("*.yaml")
    ):
        return None
    return folder


def _find(group: str, option: str, config_dir: str | Path | None) -> _File:
    check_choice(f"{group}/{option}", "the name of an option")
    package, *own = _folders(config_dir)
    name = f"{option}.yaml"
    if (package / group / name).is_file():
        return _File(package / group / name, package)
    for folder in own:
        path = folder / group / name
        if path.is_file():
            OptionCounts(folder).check(path)
            return _File(path, folder)
    raise ConfigError(f"no option '{option}' of {group}")


@lru_cache(maxsize=len(PRIMARY))
def _primary(name: str) -> _File:
    folder = _folders(None)[0]
    return _File(folder / f"{name}.yaml", folder)


def _folders(config_dir: str | Path | None) -> list[Path]:
    """The package's folder of configurations, and the user's."""
    spec = importlib.util.find_spec("gensig.configs")
    locations = spec.submodule_search_locations if spec is not None else None
    if not locations:
        raise ConfigError(
            "gensig's own configuration files are missing; install gensig again"
        )
    package = Path(next(iter(locations)))
    if config_dir is None:
        return [package]
    folder = Path(config_dir).expanduser()
    if not folder.is_dir():
        raise ConfigError(f"--config-dir {config_dir} is not a folder")
    return [package, folder]


def _value(node: Any) -> Any:
    """A node as plain Python; 3e3 is a number, as Hydra reads it."""
    if isinstance(node, yaml.MappingNode):
        return {key.value: _value(inner) for key, inner in node.value}
    if isinstance(node, yaml.SequenceNode):
        return [_value(inner) for inner in node.value]
    try:
        value = yaml.safe_load(yaml.serialize(node))
    except ValueError:  # a date of no calendar, a number with too many digits
        return node.value
    is_plain_text = isinstance(value, str) and not node.style
    if is_plain_text and EXPONENT.fullmatch(value):
        return float(value)
    return value


def _unit(key: str) -> str:
    """Unit of a key as engineers write it; empty for a plain number, text or flag."""
    if key.endswith("_m_per_s2"):
        return "m/s2"
    suffix = split_unit(key)[1] or ""
    return WRITTEN.get(suffix, suffix)


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith("#")


def _is_separate(lines: Sequence[str]) -> bool:
    """True where the comment that ends ``lines`` continues no comment after a value.

    False for the head of the file.
    """
    first = len(lines)
    while first and _is_comment(lines[first - 1]):
        first -= 1
    if first == 0:
        return False
    has_comment = re.search(r"\S\s+#", lines[first - 1]) is not None
    return not (has_comment and _indent(lines[first]) > 0)
