"""Keys that a user types and no file sets: the folder to write, the scheduler to reach."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from gensig.errors import ConfigError
from gensig.options.compose import override_keys
from gensig.options.references import shortened


def refuse_untyped(config: Mapping[str, Any], overrides: Sequence[str]) -> None:
    """Refuse what leads out of this folder and this machine, and was not typed.

    Option files and stored configurations may be a stranger's. The folder to write and the address
    of a scheduler, which gets code to run, are the user's own words.

    Raises
    ------
    ConfigError    for ``out`` that is not typed, and for ``executor.address`` where neither it nor
        an executor is typed
    """
    typed = override_keys(overrides)
    out, executor = config.get("out"), config.get("executor")
    if out is not None and "out" not in typed:
        raise ConfigError(
            f"out = {shortened(str(out))} comes from a file; type the folder to write: "
            "out=DIR, or leave it out there"
        )
    address = executor.get("address") if isinstance(executor, Mapping) else None
    if address is not None and not {"executor", "executor.address"} & typed.keys():
        raise ConfigError(
            f"executor.address = {shortened(str(address))} comes from a file; type "
            "executor.address=... yourself, or executor=local"
        )
