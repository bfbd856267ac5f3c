"""A folder of a user's options as Hydra reads it: each file is checked before it is composed."""

from __future__ import annotations

from pathlib import Path

import yaml
from hydra.core.object_type import ObjectType
from hydra.core.plugins import Plugins
from hydra.plugins.config_source import ConfigLoadError, ConfigResult, ConfigSource
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from gensig.errors import ConfigError
from gensig.options.defaults_lists import OptionCounts
from gensig.options.plain_file import HEADER_CHARACTERS

SCHEME = "own-options"


class OwnOptionsSource(ConfigSource):
    """Folder of a user's options; a file that is refused raises ConfigError."""

    def __init__(self, provider: str, path: str) -> None:
        super().__init__(provider, path)
        self._counts = OptionCounts(Path(self.path))

    @staticmethod
    def scheme() -> str:
        """Beginning of the paths that Hydra gives to this source."""
        return SCHEME

    def load_config(self, config_path: str) -> ConfigResult:
        """Content of one option."""
        file = self._file(config_path)
        if not file.exists():
            raise ConfigLoadError(f"Config not found : {file}")
        text = self._counts.check(file)
        try:
            config = OmegaConf.create(text)
        except (yaml.YAMLError, OmegaConfBaseException, ValueError) as error:
            # keys given twice, a number with too many digits
            reason = " ".join(str(error).split())
            raise ConfigError(f"{file} cannot be used: {reason}") from None
        return ConfigResult(
            config=config,
            path=self.full_path(),
            provider=self.provider,
            header=ConfigSource._get_header_dict(text[:HEADER_CHARACTERS]),
        )

    def available(self) -> bool:
        """True where the folder exists."""
        return self.is_group("")

    def is_group(self, config_path: str) -> bool:
        """True for a folder of options."""
        return (Path(self.path) / config_path).is_dir()

    def is_config(self, config_path: str) -> bool:
        """True for an option."""
        return self._file(config_path).is_file()

    def list(self, config_path: str, results_filter: ObjectType | None) -> list[str]:
        """Names of groups and options of a folder, sorted."""
        names: list[str] = []
        for path in (Path(self.path) / config_path).iterdir():
            self._list_add_result(
                files=names,
                file_path=str(Path(config_path) / path.name),
                file_name=path.name,
                results_filter=results_filter,
            )
        return sorted(set(names))

    def _file(self, config_path: str) -> Path:
        return Path(self.path) / self._normalize_file_name(config_path)


def search_path(folder: Path) -> str:
    """Override that adds a folder of a user's options to those that Hydra reads.

    Parameters
    ----------
    folder : absolute path

    Raises
    ------
    ConfigError    for a path with signs that Hydra would read otherwise
    """
    Plugins.instance().register(OwnOptionsSource)
    text = str(folder)
    if set(text) & set("'\"\\${}\n"):
        raise ConfigError(
            f"--config-dir {text!r}: a path with quotes, braces, $ or \\ cannot be used; rename it"
        )
    return f"hydra.searchpath=['{SCHEME}://{text}']"
