"""A composed configuration as one read-only value, and its groups of keys.

Everything past Hydra's door takes a `Configuration` or a `Section`. The readers beside the
physics turn sections into typed values with ``section.read(cls)``.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeVar, final

from gensig.errors import ConfigError
from gensig.text import nearest
from gensig.units import read

T = TypeVar("T")

# Keys of one value for a whole data set; several values need several data sets.
FIXED_KEYS = (
    "gear.rated_",
    "system.",
    "modification.",
    "strength.",
    "wear.",
    "life.",
    "mesh.n_slices",
    "mesh.coupling_modules",
    "sensing.sampling_rate_hz",
    "sensing.path.",
    "sensing.tacho.",
    "sensing.encoder.",
    "operating.duration_s",
    "operating.turns",
    "plan.",
    "dataset.",
    "executor.",
    "seed",
)


@final
class MissingKeyError(ConfigError, KeyError):
    """A key that a group lacks, as where an option file is empty; a KeyError as of any mapping."""

    def __init__(self, where: str, key: str) -> None:
        super().__init__(
            f"{where} has no key '{key}'; complete its option file, or choose another option"
        )

    __str__ = Exception.__str__


class _Keys(Mapping[str, Any]):
    """Names and values that are not changed."""

    __slots__ = ("_values",)

    _values: Mapping[str, Any]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def plain(self) -> dict[str, Any]:
        """A deep copy as nested dictionaries, for files and for code that changes it."""
        return copy.deepcopy(dict(self._values))


@final
class Section(_Keys):
    """One group of keys of a configuration, read-only.

    Attributes
    ----------
    name : dotted path, as error messages print it, for instance ``"gear.pinion"``
    """

    __slots__ = ("name",)

    def __init__(self, name: str, values: Mapping[str, Any]) -> None:
        self.name = name
        self._values: Mapping[str, Any] = (
            values._values if isinstance(values, Section) else values
        )

    def __getitem__(self, key: str) -> Any:
        if key not in self._values:
            raise MissingKeyError(self.name, key)
        return self._values[key]

    def __repr__(self) -> str:
        return f"Section({self.name!r}, {dict(self._values)!r})"

    def section(self, key: str) -> Section:
        """The group of keys below this one.

        Raises
        ------
        ConfigError    where there is none
        """
        name = f"{self.name}.{key}"
        return Section(name, _group(name, self._values.get(key)))

    def without(self, *keys: str) -> Section:
        """The same group without some keys."""
        return Section(
            self.name,
            {key: value for key, value in self._values.items() if key not in keys},
        )

    def __or__(self, values: Mapping[str, Any]) -> Section:
        """The same group with some values replaced or added."""
        return Section(self.name, {**self._values, **values})

    def read(self, cls: type[T], **given: Any) -> T:
        """The frozen dataclass that the keys fill; see `gensig.units.read`."""
        return read(cls, self._values, self.name, **given)


@final
class Configuration(_Keys):
    """A composed configuration, read-only: groups of keys as `Section`, other keys as plain values.

    ``config["seed"]`` is a value and ``config["plan"]`` a `Section`. Changed configurations are new
    ones: `with_values`, `with_entries`. It can be pickled and compared.
    """

    __slots__ = ()

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = {
            name: dict(value._values) if type(value) is Section else value
            for name, value in values.items()
        }

    def __getitem__(self, key: str) -> Any:
        if key not in self._values:
            raise MissingKeyError("the configuration", key)
        value = self._values[key]
        return Section(key, value) if isinstance(value, Mapping) else value

    def __repr__(self) -> str:
        return f"Configuration({', '.join(self._values)})"

    @property
    def seed(self) -> int:
        """The root seed."""
        return whole_number("seed", self._values["seed"], at_least=0)

    def section(self, name: str, *path: str) -> Section:
        """A group of keys, or one below it.

        Raises
        ------
        ConfigError    where there is none
        """
        section = Section(name, _group(name, self._values.get(name)))
        for key in path:
            section = section.section(key)
        return section

    def with_entries(self, **entries: Any) -> Configuration:
        """The same configuration with whole groups or plain values replaced or added."""
        return Configuration({**self._values, **entries})

    def with_keys(self, name: str, /, **values: Any) -> Configuration:
        """The same configuration with some keys of one group replaced or added."""
        return self.with_entries(**{name: {**self.section(name), **values}})

    def with_values(self, values: Mapping[str, float]) -> Configuration:
        """The same configuration with the numbers of dotted keys replaced, as plans draw them.

        Raises
        ------
        ConfigError    for a key that does not exist, holds no number, or is fixed for a data set
        """
        changed = dict(self._values)
        for key, value in values.items():
            self._replace(changed, key, value)
        return Configuration(changed)

    def _replace(self, changed: dict[str, Any], key: str, value: float) -> None:
        """Set a dotted key that must exist and hold a number, in copies of its groups."""
        if key.startswith(FIXED_KEYS):
            raise ConfigError(
                f"plan.vary: '{key}' is one value for a whole data set; give several with "
                "-m instead"
            )
        *parents, leaf = key.split(".")
        node: Any = changed
        for name in parents:
            below = node.get(name) if isinstance(node, dict) else None
            if isinstance(below, dict):
                below = node[name] = dict(below)
            node = below
        if not isinstance(node, dict) or not _is_number(node.get(leaf, "")):
            known = [
                name
                for name in _numeric_keys(self._values)
                if not name.startswith(FIXED_KEYS)
            ]
            near = nearest.near(key, known)
            hint = f"; did you mean {' or '.join(map(repr, near))}?" if near else ""
            raise ConfigError(
                f"plan.vary: '{key}' is no key of the configuration that holds a number{hint}"
            )
        is_count = isinstance(node[leaf], int) and float(value).is_integer()
        node[leaf] = int(value) if is_count else value


def whole_number(key: str, value: Any, *, at_least: int, also: str = "") -> int:
    """A count of a configuration, checked; ``also`` names what else its key takes."""
    if isinstance(value, bool) or not isinstance(value, int) or value < at_least:
        raise ConfigError(
            f"{key} = {value!r} must be a whole number of at least {at_least}{also}"
        )
    return value


def _group(name: str, value: Any) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise ConfigError(
            f"{name} = {value!r} must be a group of keys; choose an option or leave it alone"
        )
    return value


def _is_number(value: Any) -> bool:
    """True for a value that may be varied: a number, or null where a number can stand."""
    return not isinstance(value, dict | list | str | bool)


def _numeric_keys(tree: Mapping[str, Any], prefix: str = "") -> Sequence[str]:
    """Dotted keys that hold numbers."""
    keys: list[str] = []
    for name, value in tree.items():
        if isinstance(value, dict):
            keys += _numeric_keys(value, f"{prefix}{name}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            keys.append(f"{prefix}{name}")
    return keys
