"""Sources of a request: the option files, or the stored configuration of a data set."""

from __future__ import annotations

import copy
import functools
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

from gensig.dataset.folder.layout import CONFIG, read_config_file
from gensig.dataset.folder.manifest import SINCE_0_9
from gensig.errors import ConfigError, DatasetError
from gensig.faults.registry import with_later_keys
from gensig.options import files as option_files
from gensig.options.compose import compose
from gensig.options.stored import changed_content
from gensig.plan.words import Words

CONFIG_NAME = "generate"
FAULT, CLASSES, EXPERIMENT = "fault", "classes", "experiment"
SEED_KEY = "course_seed"  # of the group operating


@dataclass(frozen=True, slots=True, kw_only=True)
class Source(ABC):
    """Origin of the values that are not typed.

    Attributes
    ----------
    words : the typed words
    config_dir : folder of a user's own options; None for the package alone
    """

    words: Words
    config_dir: str | Path | None

    @abstractmethod
    def base(self) -> dict[str, Any]:
        """The configuration with all typed words but those of keys of the fault."""

    @abstractmethod
    def fault_option(
        self, name: str | None, fault_words: tuple[str, ...] = ()
    ) -> dict[str, Any]:
        """A fault option by its name, with words that its keys are given by.

        ``name`` None for the fault of the whole configuration.
        """

    def pinned_keys(self) -> frozenset[str]:
        """Dotted keys that are given, though perhaps not typed now."""
        return frozenset(self.words.keys)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class OptionFiles(Source):
    """The options of the package and of the user."""

    def base(self) -> dict[str, Any]:
        """See `Source`."""
        others = self.words.others
        return compose(CONFIG_NAME, others, config_dir=self.config_dir).plain()

    def fault_option(
        self, name: str | None, fault_words: tuple[str, ...] = ()
    ) -> dict[str, Any]:
        """See `Source`.

        An option's file is composed alone, which takes a third of the time. The whole
        configuration is composed where the name is not known, where an experiment sets keys of
        the fault, and where composing alone fails: for an option of one's own that refers to
        another group, and for its message where no such option exists.
        """
        words = self.words
        removed = tuple(word for word in words.others if word.startswith("~fault."))
        if name is not None and not self._experiment_sets_fault():
            try:
                return option_alone(name, (*removed, *fault_words), self.config_dir)
            except ConfigError:
                pass
        others = [
            word
            for word in words.others
            if name is None or not word.startswith("fault=")
        ]
        chosen = [] if name is None else [f"fault={name}"]
        whole = compose(
            CONFIG_NAME,
            [*others, *chosen, *fault_words],
            config_dir=self.config_dir,
        )
        return whole[FAULT].plain()

    def _experiment_sets_fault(self) -> bool:
        """True where an experiment's file sets keys of any chosen fault, such as its gear."""
        experiment = self.words.keys.get(EXPERIMENT)
        if experiment in (None, "null"):
            return False
        keys = option_files.option_keys(EXPERIMENT, experiment, self.config_dir)
        return any(key.name.startswith("fault.") for key in keys)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class StoredConfiguration(Source):
    """The configuration of a data set, with typed words on top.

    A typed group replaces that group of keys; all others stay as they are stored.

    Attributes
    ----------
    content : the stored configuration
    """

    content: Mapping[str, Any]

    def base(self) -> dict[str, Any]:
        """See `Source`."""
        if EXPERIMENT in self.words.keys:
            raise ConfigError(
                "an experiment chooses a whole configuration: leave out --config or "
                f"experiment={self.words.keys[EXPERIMENT]}"
            )
        kept = {key: value for key, value in self.content.items() if key != CLASSES}
        others, folder = self.words.others, self.config_dir
        return changed_content(kept, CONFIG_NAME, others, config_dir=folder)

    def fault_option(
        self, name: str | None, fault_words: tuple[str, ...] = ()
    ) -> dict[str, Any]:
        """See `Source`; a class that the data set does not have is that of the option files."""
        classes = self.content[CLASSES]
        typed = self.words.keys.get(FAULT)
        if name is None:
            stored = self.content[FAULT]
        elif name in classes and name != typed:
            stored = classes[name]
        else:
            return option_alone(name, fault_words, self.config_dir)
        content = {FAULT: copy.deepcopy(stored)}
        return dict(changed_content(content, CONFIG_NAME, fault_words)[FAULT])

    def pinned_keys(self) -> frozenset[str]:
        """See `Source`; a stored seed of courses that the plan does not draw is given."""
        keys = Source.pinned_keys(self)
        key = f"operating.{SEED_KEY}"
        is_kept = "operating" not in keys and SEED_KEY in self.content["operating"]
        if is_kept and key not in self.content["plan"]["vary"]:
            keys |= {key}
        return keys


def read_stored(path: str | Path) -> dict[str, Any]:
    """The stored configuration of a data set, from its ``config.yaml`` or its folder.

    Raises
    ------
    ConfigError    for a file that is none
    """
    file = Path(path).expanduser()
    is_folder = file.is_dir()
    if is_folder:
        file /= CONFIG
    if not file.exists():
        raise ConfigError(
            f"--config {path} does not exist; give the {CONFIG} of a data set, or what "
            "gensig plan --show-config prints"
        )
    try:
        content = read_config_file(file, follow_links=not is_folder)
    except DatasetError as error:
        raise ConfigError(f"--config {error}") from None
    if not isinstance(content.get(CLASSES), dict):
        raise ConfigError(
            f"--config {path} has no group '{CLASSES}'; give the {CONFIG} of a data set, or "
            "what gensig plan --show-config prints"
        )
    for dotted, default in SINCE_0_9.items():
        section, _, key = dotted.partition(".")
        if isinstance(content.get(section), dict):
            content[section].setdefault(key, default)
    if isinstance(content.get(FAULT), dict):
        content[FAULT] = with_later_keys(content[FAULT])
    for name, fault in content[CLASSES].items():
        if isinstance(fault, dict):
            content[CLASSES][name] = with_later_keys(fault)
    return content


def option_alone(
    name: str, words: tuple[str, ...], config_dir: str | Path | None
) -> dict[str, Any]:
    """A fault option whose file is composed alone."""
    if config_dir is None:
        return copy.deepcopy(_packaged_option(name, words))
    return compose(f"fault/{name}", words, config_dir=config_dir)[FAULT].plain()


@functools.lru_cache(maxsize=64)
def _packaged_option(name: str, words: tuple[str, ...]) -> dict[str, Any]:
    return compose(f"fault/{name}", words)[FAULT].plain()
