"""Channels of a file for those of a network."""

from __future__ import annotations

from collections.abc import Sequence

from gensig.errors import ConfigError
from gensig.signals.recording import RecordingFile, without_unit


def chosen_channels(
    content: RecordingFile,
    wanted: Sequence[str],
    given: Sequence[str] | None,
) -> tuple[str, ...]:
    """Channels of the file for those of the network.

    As given, by name, or in order where no name says otherwise.

    Raises
    ------
    ConfigError    for another number of channels, or names that say nothing
    """
    needs = f"the model takes {len(wanted)}, {', '.join(wanted)}"
    if given is not None:
        if len(given) != len(wanted):
            raise ConfigError(
                f"--channels names {len(given)} channel(s); {needs}: name as many, in this order",
            )
        return tuple(given)
    by_name = {without_unit(name): name for name in content.channels}
    if all(name in by_name for name in wanted):
        return tuple(by_name[name] for name in wanted)
    names = ", ".join(content.channels)
    has = f"{content.file} has {len(content.channels)} channel(s), {names}"
    if len(content.channels) != len(wanted):
        raise ConfigError(f"{has}; {needs}: choose with --channels, in this order")
    if content.named and len(wanted) > 1:
        raise ConfigError(
            f"{has}; {needs}: say which is which with --channels, in this order"
        )
    return content.channels
