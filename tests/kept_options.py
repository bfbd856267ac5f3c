"""Option files of the package as Hydra reads them, each once a process."""

import pickle

from hydra._internal.sources_registry import SourcesRegistry
from hydra.core.plugins import Plugins


def keep() -> None:
    """Keep what Hydra reads of packages: a composition takes half the time.

    These files do not change while tests run; those of a user's own folder have another source.
    """
    Plugins.instance()  # registers the sources
    source = SourcesRegistry.instance().resolve("pkg")
    read, kept = source.load_config, {}

    def load_config(self, config_path):
        key = (self.provider, self.path, config_path)
        if key not in kept:
            kept[key] = pickle.dumps(read(self, config_path))
        return pickle.loads(kept[key])

    source.load_config = load_config
