"""The only door to Hydra: overrides in, a `Configuration` out, mistakes as one line.

Nothing of Hydra's own (working directories, logs, ``outputs/``) is created, and nothing is
instantiated.
"""

from __future__ import annotations

import copy
import difflib
import functools
import itertools
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hydra import compose as hydra_compose
from hydra.core.override_parser.types import Glob, OverrideType
from hydra.errors import HydraException
from omegaconf import DictConfig, ListConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from gensig.errors import ConfigError
from gensig.options import files as option_files
from gensig.options.configuration import Configuration
from gensig.options.groups import (
    HydraState,
    first_line,
    group_names,
    options,
    parse,
    plain_value,
)
from gensig.options.own_source import search_path
from gensig.options.plain_file import check_choice
from gensig.options.plain_values import check_values
from gensig.options.references import check_tree, refuse_references
from gensig.options.several_values import (
    MOST_ADVISED,
    interval_text,
    list_text,
    several_values_text,
)
from gensig.options.whole_numbers import with_whole_numbers
from gensig.text import nearest

# names under which faults of rolling bearings are looked for
BEARING_FAULT = r"(?i)bearing|ball|roller|cage|(inner|outer)_?(race|ring)|bp[fs]|ftf"


def compose(
    config_name: str,
    overrides: Sequence[str] = (),
    *,
    config_dir: str | Path | None = None,
) -> Configuration:
    """Compose one configuration.

    Compositions of the package's files alone are kept: these files do not change while it runs.

    Parameters
    ----------
    config_name : the primary file, for instance ``"generate"``
    overrides : Hydra overrides as typed, ``group=option`` and ``key=value``
    config_dir : folder with a user's own groups and options, searched after the package's

    Returns
    -------
    Configuration, every interpolation resolved

    Raises
    ------
    ConfigError    for an unknown key or option, a value of the wrong form, or a missing folder
    """
    words = in_digits(overrides)
    if config_dir is None:
        return Configuration(_packaged(config_name, words))
    return Configuration(_composed(config_name, words, config_dir))


def in_digits(overrides: Sequence[str]) -> tuple[str, ...]:
    """Overrides in which a count such as ``plan.n_records=1e3`` is typed as 1000."""
    return with_whole_numbers(overrides, lambda key: _default(key, overrides)[1])


@functools.lru_cache(maxsize=256)
def _packaged(config_name: str, words: tuple[str, ...]) -> dict[str, Any]:
    """Composition of the package's files; not to be changed."""
    try:
        return _set_in_options(config_name, words)
    except (ConfigError, HydraException, OmegaConfBaseException, ValueError):
        return _composed(config_name, words, None)


def _set_in_options(config_name: str, words: tuple[str, ...]) -> dict[str, Any]:
    """Values set in a copy of the chosen options, as Hydra sets them.

    Reading the options takes a hundred times longer.

    Raises
    ------
    ConfigError    for words other than ``group=option`` and ``key=value``; Hydra's errors
    """
    chosen, changes = [], []
    for word, override in zip(words, parse(words), strict=True):
        is_change = override.type is OverrideType.CHANGE and override.package is None
        if not is_change or override.is_sweep_override():
            raise ConfigError(f"'{word}' is not only a change of a value")
        key, value = override.key_or_group, override.value()
        is_group = key in group_names() or "/" in key
        if is_group and isinstance(value, dict):
            raise ConfigError(f"'{word}' changes values of a group")
        if is_group:
            chosen.append(word)
        else:
            changes.append((key, value))
    config = copy.deepcopy(_chosen_options(config_name, tuple(chosen)))
    for key, value in changes:
        OmegaConf.update(config, key, value, merge=True)
    return _resolved(config)


@functools.lru_cache(maxsize=64)
def _chosen_options(config_name: str, words: tuple[str, ...]) -> DictConfig:
    """Composition of the package's options, interpolations unresolved; not to be changed."""
    with HydraState():
        return hydra_compose(config_name=config_name, overrides=list(words))


def _resolved(config: DictConfig) -> dict[str, Any]:
    """A composition with its references resolved, which may be those to keys alone."""
    check_tree(plain_tree(config))
    plain = plain_tree(config, resolve=True, throw_on_missing=True)
    refuse_references(plain, "a composed configuration")
    check_values(plain)
    return plain


def plain_tree(config: DictConfig, **how: Any) -> dict[str, Any]:
    """A composition as plain nested dictionaries; ``how`` goes to ``OmegaConf.to_container``."""
    tree = OmegaConf.to_container(config, **how)
    assert isinstance(tree, dict)
    return {str(key): value for key, value in tree.items()}


def composed_groups(
    config_name: str, words: Sequence[str], *, config_dir: str | Path | None
) -> dict[str, Any]:
    """A composition as plain nested dictionaries whose references are not resolved yet.

    Raises
    ------
    ConfigError    for an unknown group or option
    """
    return plain_tree(_hydra_composed(config_name, tuple(words), config_dir))


def _composed(
    config_name: str, words: tuple[str, ...], config_dir: str | Path | None
) -> dict[str, Any]:
    config = _hydra_composed(config_name, words, config_dir)
    try:
        return _resolved(config)
    except (OmegaConfBaseException, ValueError, RecursionError) as error:
        text = _explain(error, config_name, words, config_dir)
        raise ConfigError(text) from None


def _hydra_composed(
    config_name: str, words: tuple[str, ...], config_dir: str | Path | None
) -> DictConfig:
    """A composition whose references are not resolved yet."""
    check_choice(config_name, "the name of an option")
    parse(words)  # refuses words that Hydra must not see
    searched = list(words)
    if config_dir is not None:
        folder = Path(config_dir).expanduser().resolve()
        if not folder.is_dir():
            raise ConfigError(f"--config-dir {config_dir} is not a folder")
        searched.append(search_path(folder))
    with HydraState():
        try:
            return hydra_compose(config_name=config_name, overrides=searched)
        except (
            HydraException,
            OmegaConfBaseException,
            ValueError,
            RecursionError,
        ) as error:
            text = _explain(error, config_name, words, config_dir)
            raise ConfigError(text) from None


def sweep(
    overrides: Sequence[str], *, config_dir: str | Path | None = None
) -> list[list[str]]:
    """Expand sweeps into one list of overrides a job.

    The jobs are the Cartesian product of the values, the first key slowest. ``glob(...)`` stands
    for the options of a group whose names match, those of ``config_dir`` or ./configs included.

    Raises
    ------
    ConfigError    for a sweep without end, one that matches nothing, or one that Hydra refuses
    """
    jobs: list[list[str]] = [[]]
    for override in parse(overrides):
        key = override.get_key_element()
        if override.is_sweep_override():
            values = [f"{key}={text}" for text in _swept(override, config_dir)]
        else:
            values = [override.input_line or key]
        jobs = [[*job, value] for job in jobs for value in values]
    return jobs


def _swept(override: Any, config_dir: str | Path | None) -> list[str]:
    """Values of a sweep as they are typed."""
    key, line, value = str(override.key_or_group), override.input_line, override.value()
    if override.is_interval_sweep():
        primary = _default(key, [])[0]
        text = interval_text(key, line, value.start, value.end, primary)
        raise ConfigError(text)
    if isinstance(value, Glob):
        folder = config_dir or option_files.user_folder()
        known = [option.name for option in option_files.options(key, folder)]
        names = value.filter(known)
        if not known:
            raise ConfigError(
                f"{line}: glob(...) stands for options of a group; '{key}' is none"
            )
        if not names:
            raise ConfigError(f"{line} matches no option; there is {', '.join(known)}")
        return names
    return [
        str(value) for value in _sweep_values(override, override.sweep_string_iterator)
    ]


def _sweep_values(
    override: Any, values: Callable[[], Iterable[Any]], most: int | None = None
) -> list[Any]:
    """Values of a choice or a range, at most so many; ConfigError for one without values."""
    try:
        return list(itertools.islice(values(), most))
    except (HydraException, ValueError, TypeError) as error:
        text = f"{override.input_line}: {first_line(error)}"
        raise ConfigError(f"{text}; give values A,B,C") from None


def job_folders(jobs: Sequence[Sequence[str]]) -> list[str]:
    """Folder names of the jobs of a sweep: number and the values that differ between jobs."""
    varied = [{job[index] for job in jobs} for index in range(len(jobs[0]))]
    names = []
    for number, job in enumerate(jobs):
        text = ",".join(
            word for word, values in zip(job, varied, strict=True) if len(values) > 1
        )
        safe = re.sub(r"[^A-Za-z0-9_.,=+-]+", "_", text)[:120]
        names.append(f"{number}-{safe}" if safe else str(number))
    return names


def override_keys(overrides: Sequence[str]) -> dict[str, str]:
    """Keys and groups that were typed, each with its value as text.

    Raises
    ------
    ConfigError    for several values of a key that takes one; says what to type instead
    """
    keys: dict[str, str] = {}
    for override in parse(overrides):
        key, line = str(override.key_or_group), str(override.input_line)
        if override.is_sweep_override():
            raise ConfigError(_several_values(key, line, override, overrides))
        value = override.value()
        if isinstance(value, list):
            default = _default(key, overrides)[1]
            if text := list_text(key, line, plain_value(value), default):
                raise ConfigError(text)
        keys[key] = override.get_value_element_as_str()
    return keys


def _several_values(
    key: str, line: str, override: Any, overrides: Sequence[str]
) -> str:
    """Advice for a sweep without ``-m``."""
    value = override.value()
    if override.is_interval_sweep():
        primary = _default(key, overrides)[0]
        return interval_text(key, line, value.start, value.end, primary)
    if isinstance(value, Glob):
        values = _swept(override, None)
    else:
        items = _sweep_values(override, override.sweep_iterator, MOST_ADVISED + 1)
        values = [plain_value(item) for item in items]
    primary, default = _default(key, overrides)
    return several_values_text(key, line, values, default, primary)


def _default(key: str, overrides: Sequence[str]) -> tuple[str, Any]:
    """Primary file of a dotted key, and its value in the packaged options that were chosen.

    A group is an empty mapping, and an unknown key None, of the first primary file.
    """
    primaries = {group.name: group.primary for group in option_files.groups()}
    if key in primaries:
        return primaries[key], {}
    heads = {word: word.partition("=")[0] for word in overrides}
    chosen = [
        word for word, head in heads.items() if head in group_names() and head != key
    ]
    for primary in option_files.PRIMARY:
        for words in (tuple(chosen), ()):
            try:
                config = _chosen_options(primary, words)
                value = OmegaConf.select(config, key)
            except (HydraException, OmegaConfBaseException, ValueError):
                continue
            if isinstance(value, ListConfig):
                return primary, list(value)
            known = dotted_keys(OmegaConf.to_container(config, resolve=False))
            if value is not None or key in known:
                return primary, value
    return primaries.get(key.partition(".")[0], option_files.PRIMARY[0]), None


def typed_mapping(overrides: Sequence[str], key: str) -> dict[str, Any]:
    """Mapping that was typed as ``key={name: value, ...}``.

    Such a mapping may have names that no option has yet.
    """
    result: dict[str, Any] = {}
    for override in parse([word for word in overrides if word.startswith(f"{key}=")]):
        value = override.value()
        if not isinstance(value, dict):
            raise ConfigError(
                f"{key} must be a mapping, for instance '{key}={{name: value}}'"
            )
        result.update({str(name): plain_value(item) for name, item in value.items()})
    return result


def _explain(
    error: Exception,
    config_name: str,
    words: Sequence[str],
    config_dir: str | Path | None,
) -> str:
    """One line for a failed composition, with the nearest existing names."""
    text = " ".join(str(error).split())
    if "Config group override must be" in text:
        text = _not_an_option(words) or text
    if isinstance(error, ValueError) and not isinstance(error, HydraException):
        return text
    for pattern, explanation in _EXPLANATIONS.items():
        if match := re.search(pattern, text):
            context = _Failure(match.group(1), config_name, words, config_dir)
            return explanation(context)
    if match := re.search(r"Missing mandatory value: (\S+)", text):
        key = getattr(error, "full_key", None) or match.group(1)
        return f"{key} is required: give {key}=..."
    return text.removesuffix(".")


def _not_an_option(words: Sequence[str]) -> str | None:
    """Message for the first group that was given a number or a mapping."""
    groups = group_names()
    for override in parse(words):
        key = str(override.key_or_group)
        if key in groups and not isinstance(override.value(), str | list):
            names = ", ".join(options(key))
            return f"{override.input_line}: a group takes one of its options: {names}"
    return None


@dataclass(frozen=True, slots=True)
class _Failure:
    """The name at which a composition failed, and the call that asked for it."""

    name: str
    config_name: str
    words: Sequence[str]
    config_dir: str | Path | None


def _unknown_key(failure: _Failure) -> str:
    keys = _known_keys(failure)
    return f"unknown key '{failure.name}'{nearest_key(failure.name, keys)}"


def _unknown_group(failure: _Failure) -> str:
    files = {group.name: group.primary for group in option_files.groups()}
    primary = files.get(failure.name)
    if primary is None:
        return f"unknown group '{failure.name}'{nearest_key(failure.name, list(files))}"
    return (
        f"the group '{failure.name}' is one of {primary}.yaml, "
        f"not of {failure.config_name}.yaml"
    )


def _unknown_option(failure: _Failure) -> str:
    group, _, wanted = failure.name.rpartition("/")
    names = [option.name for option in option_files.options(group, failure.config_dir)]
    if group == "fault" and re.match(BEARING_FAULT, wanted):
        return (
            f"no option '{wanted}' of fault: faults of bearings are not in this version; "
            f"there is {', '.join(names)}"
        )
    hint = nearest.hint(wanted, names)
    return f"no option '{wanted}' of {group}; {hint}"


# Words of Hydra and OmegaConf -> our explanation; the first that matches is taken.
_EXPLANATIONS: dict[str, Callable[[_Failure], str]] = {
    r"Could not override '([^']+)'\. No match in the defaults list": _unknown_group,
    r"Could not override '([^']+)'": _unknown_key,
    r"Key '([^']+)' is not in struct": _unknown_key,
    r"Could not find '([^']+)'": _unknown_option,
}


def _known_keys(failure: _Failure) -> list[str]:
    """Dotted keys of the default configuration with the groups that were chosen."""
    groups = group_names()
    words = [word for word in failure.words if word.partition("=")[0] in groups]
    try:
        config = _chosen_options(failure.config_name, tuple(words))
    except HydraException:
        config = _chosen_options(failure.config_name, ())
    return list(dotted_keys(OmegaConf.to_container(config, resolve=False)))


def dotted_keys(tree: Any, prefix: str = "") -> list[str]:
    """Keys of nested dictionaries, groups included."""
    if not isinstance(tree, dict):
        return []
    keys = []
    for key, value in tree.items():
        keys += [f"{prefix}{key}", *dotted_keys(value, f"{prefix}{key}.")]
    return keys


def nearest_key(key: str, names: Sequence[str]) -> str:
    """'; did you mean ...?' over whole keys, then over their last part."""
    close = difflib.get_close_matches(key, names, n=3, cutoff=0.6)
    if not close:
        last = {name: name.rpartition(".")[2] for name in names}
        leaf = key.rpartition(".")[2]
        leaves = difflib.get_close_matches(leaf, last.values(), n=3, cutoff=0.75)
        close = [name for name in names if last[name] in leaves][:3]
    if not close:
        return ""
    return f"; did you mean {' or '.join(repr(name) for name in close)}?"
