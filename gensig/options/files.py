"""What can be chosen and set: groups, their options, and the keys of an option with value, unit
and comment.

Read from the text of the configuration files, comments included, without Hydra, so that it is
quick enough for a key press. A group's own line stands behind it in the defaults list of the
primary file.
"""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import yaml

from gensig.errors import ConfigError
from gensig.units import split_unit

PRIMARY = ("generate", "train")
OWN = "configs"  # folder of a user's own options, unless told otherwise
# suffix of a key as engineers write the unit; what is not here is written as it is
WRITTEN = {
    "mpa_sqrt_m": "MPa sqrt(m)", "kg_m2": "kg m2", "w_per_m2k": "W/(m2 K)", "w_per_mk": "W/(m K)",
    "j_per_kgk": "J/(kg K)", "per_k": "1/K", "degc": "degC", "n_per_m": "N/m", "ns_per_m": "N s/m",
    "nm_per_rad": "N m/rad", "knm_per_rad": "kN m/rad", "mnm_per_rad": "MN m/rad", "nms_per_rad": "N m s/rad",
    "rpm": "r/min", "nm": "N m", "n": "N", "hz": "Hz", "gpa": "GPa", "mpa": "MPa", "hbs": "HBS", "db": "dB",
}  # fmt: skip
SENTENCE_END = re.compile(r"(?<!\bal)(?<!\beq)\.\s+(?=[A-Z<0-9]|docs/)")
LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass(frozen=True, slots=True, kw_only=True)
class Key:
    """One key.

    Dotted name, value as the file writes it and as it is read, unit or empty, comment or empty.
    """

    name: str
    text: str
    value: Any
    unit: str
    comment: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """One group.

    What it is about, the option taken where none is typed, and the primary files that have it.
    """

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


class _File:
    """One configuration file.

    Its tree with the places of everything, and its lines for the comments.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.source = path.read_text(encoding="utf-8")
        self.lines = self.source.splitlines()

    @cached_property
    def tree(self) -> Any:
        try:
            return yaml.compose(self.source, Loader=LOADER)
        except yaml.YAMLError as error:
            raise ConfigError(
                f"{self.path} is no YAML: {' '.join(str(error).split())}"
            ) from None

    @property
    def is_global(self) -> bool:
        return any(
            line.replace(" ", "") == "#@package_global_" for line in self.lines[:3]
        )

    def about(self) -> str:
        """The first sentence of the comment at the top."""
        words: list[str] = []
        for line in self.lines:
            if not line.startswith("#"):
                break
            if not line.lstrip("# ").startswith("@package"):
                words.append(line.lstrip("# ").strip())
        return SENTENCE_END.split(" ".join(words))[0].rstrip(".")

    def defaults(self) -> list[tuple[str | None, Any, str]]:
        """The entries of its defaults list.

        Group (None for an option of its own group), option, comment.
        """
        for key, value in (
            self.tree.value if isinstance(self.tree, yaml.MappingNode) else ()
        ):
            if key.value == "defaults" and isinstance(value, yaml.SequenceNode):
                return [self._entry(node) for node in value.value]
        return []

    def _entry(self, node: Any) -> tuple[str | None, Any, str]:
        if isinstance(node, yaml.MappingNode):
            group, option = node.value[0]
            return (
                group.value,
                None if option.value == "null" else option.value,
                self._comment(group, option),
            )
        return None, node.value, ""

    def entries(self, prefix: str = "") -> Iterator[Key]:
        """Every key that holds a value; what is nested is dotted."""
        if isinstance(self.tree, yaml.MappingNode):
            yield from self._keys(self.tree, prefix, top=True)

    def _keys(self, mapping: Any, prefix: str, *, top: bool = False) -> Iterator[Key]:
        for key, value in mapping.value:
            if top and key.value == "defaults":
                continue
            name = f"{prefix}{key.value}"
            if (
                isinstance(value, yaml.MappingNode)
                and not value.flow_style
                and key.value != "vary"
            ):
                yield from self._keys(value, f"{name}.")
                continue
            plain = _value(value)
            text = self.source[value.start_mark.index : value.end_mark.index]
            if isinstance(value, yaml.CollectionNode):
                text = yaml.safe_dump(
                    plain, default_flow_style=True, sort_keys=False, width=10**6
                ).strip()
            yield Key(
                name=name,
                text=text,
                value=plain,
                unit=_unit(str(key.value)),
                comment=self._comment(key, value),
            )

    def _comment(self, key: Any, value: Any) -> str:
        """What is written behind a value and goes on below it, else right above its key."""
        block = isinstance(value, yaml.CollectionNode) and not value.flow_style
        mark = key.end_mark if block else value.end_mark
        behind = re.search(r"(?:^|\s)#\s*(.*)$", self.lines[mark.line][mark.column :])
        parts = [behind.group(1)] if behind else []
        for line in self.lines[mark.line + 1 :]:
            if not (
                line.lstrip().startswith("#") and _indent(line) > key.start_mark.column
            ):
                break
            parts.append(line.lstrip().lstrip("# "))
        above = self.lines[: key.start_mark.line]
        while not behind and above and above[-1].lstrip().startswith("#"):
            if _indent(above[-1]) != key.start_mark.column or not _is_on_its_own(above):
                break
            parts.insert(0, above.pop().lstrip().lstrip("# "))
        return " ".join(parts)


def groups(config_dir: str | Path | None = None) -> list[Group]:
    """Every group of the package and of a user's folder, in the order of the primary files."""
    found: dict[str, Group] = {}
    for primary in PRIMARY:
        for name, option, comment in _primary(primary).defaults():
            if name is not None and name not in found:
                found[name] = Group(
                    name=name, about=comment, default=option, primary=primary
                )
    for folder in _folders(config_dir)[1:]:
        for path in sorted(folder.iterdir()):
            if path.is_dir() and path.name not in found and any(path.glob("*.yaml")):
                found[path.name] = Group(
                    name=path.name,
                    about="of your own",
                    default=None,
                    primary=PRIMARY[0],
                )
    return list(found.values())


def options(group: str, config_dir: str | Path | None = None) -> list[Option]:
    """The options of a group; where both have one of a name it is the package's, as in Hydra."""
    found: dict[str, Option] = {}
    for folder in _folders(config_dir):
        for path in sorted((folder / group).glob("*.yaml")):
            found.setdefault(
                path.stem, Option(name=path.stem, about=_File(path).about(), file=path)
            )
    return [found[name] for name in sorted(found)]


def sections() -> dict[str, str]:
    """Parts of the primary files that offer no choice, each with its primary file.

    Mesh, solver, quality, ...
    """
    found: dict[str, str] = {}
    for primary in PRIMARY:
        for key in _primary(primary).entries():
            head, dot, _ = key.name.partition(".")
            found.setdefault(head if dot else primary, primary)
    return found


def section_keys(name: str) -> list[Key]:
    """Keys of one part of a primary file; of those at its top where ``name`` is that file's."""
    keys = list(_primary(sections()[name]).entries())
    return [
        key
        for key in keys
        if (
            key.name.startswith(f"{name}.")
            if name not in PRIMARY
            else "." not in key.name
        )
    ]


def option_keys(
    group: str, option: str, config_dir: str | Path | None = None
) -> list[Key]:
    """Keys of one option, with those of the options that it builds on."""
    found: dict[str, Key] = {}
    for key in _option_keys(group, option, group, config_dir):
        before = found.get(key.name)
        if before is not None and not key.comment:
            key = Key(
                name=key.name,
                text=key.text,
                value=key.value,
                unit=key.unit,
                comment=before.comment,
            )
        for outer in [name for name in found if key.name.startswith(f"{name}.")]:
            del found[outer]  # null there, a group of keys here
        found[key.name] = key
    return list(found.values())


def chosen_beside(
    group: str, option: str, config_dir: str | Path | None = None
) -> dict[str, str]:
    """Options of other groups that an option chooses too."""
    entries = _find(group, option, config_dir).defaults()
    return {
        name.removeprefix("override /"): str(other)
        for name, other, _ in entries
        if name and name[:8] == "override"
    }


def _option_keys(
    group: str, option: str, package: str, config_dir: str | Path | None
) -> Iterator[Key]:
    file = _find(group, option, config_dir)
    for name, other, _ in file.defaults():
        if name is None and other != "_self_":
            yield from _option_keys(group, other, package, config_dir)
        elif name is not None and not name.startswith("override") and other is not None:
            inner, _, place = name.partition("@")
            yield from _option_keys(
                f"{group}/{inner}", other, f"{package}.{place or inner}", config_dir
            )
    yield from file.entries("" if file.is_global else f"{package}.")


def elsewhere(group: str, option: str) -> str | None:
    """How to take an option that lies in the folder where gensig new writes, for who forgot to
    name it.
    """
    if not (Path(OWN) / group / f"{option}.yaml").is_file():
        return None
    return f"it is in ./{OWN}: add --config-dir {OWN}, in Python config_dir='{OWN}'"


def _find(group: str, option: str, config_dir: str | Path | None) -> _File:
    for folder in _folders(config_dir):
        if (folder / group / f"{option}.yaml").is_file():
            return _File(folder / group / f"{option}.yaml")
    raise ConfigError(f"no option '{option}' of {group}")


@lru_cache(maxsize=len(PRIMARY))
def _primary(name: str) -> _File:
    return _File(_folders(None)[0] / f"{name}.yaml")


def _folders(config_dir: str | Path | None) -> Sequence[Path]:
    """The package's folder of configurations, and the user's."""
    spec = importlib.util.find_spec("gensig.configs")
    places = list(spec.submodule_search_locations or ()) if spec is not None else []
    if not places:
        raise ConfigError(
            "gensig's own configuration files are missing; install gensig again"
        )
    if config_dir is None:
        return [Path(places[0])]
    own = Path(config_dir).expanduser()
    if not own.is_dir():
        raise ConfigError(f"--config-dir {config_dir} is not a folder")
    return [Path(places[0]), own]


def _value(node: Any) -> Any:
    """A node as plain Python; 3e3 is a number, as Hydra reads it."""
    if isinstance(node, yaml.MappingNode):
        return {key.value: _value(one) for key, one in node.value}
    if isinstance(node, yaml.SequenceNode):
        return [_value(one) for one in node.value]
    value = yaml.safe_load(yaml.serialize(node))
    if (
        isinstance(value, str)
        and not node.style
        and re.fullmatch(r"[-+]?[0-9.]+[eE][-+]?[0-9]+", value)
    ):
        return float(value)
    return value


def _unit(key: str) -> str:
    """Unit of a key as engineers write it; empty for a plain number, text or flag."""
    if key.endswith("_m_per_s2"):
        return "m/s2"
    suffix = split_unit(key)[1]
    return "" if suffix is None else WRITTEN.get(suffix, suffix)


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def _is_on_its_own(lines: Sequence[str]) -> bool:
    """Whether the comment that ends ``lines`` goes on from none behind a value, and is not the
    head of the file.
    """
    place = len(lines)
    while place and lines[place - 1].lstrip().startswith("#"):
        place -= 1
    return place > 0 and not re.search(
        r"\S\s+#", lines[place - 1] if _indent(lines[place]) else ""
    )
