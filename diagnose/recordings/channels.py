"""Channels of a file for those of a network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError
from gensig.signals.recording import RecordingFile, without_unit


def tacho_apart(
    content: RecordingFile, tacho: str | None
) -> tuple[RecordingFile, NDArray[np.float64] | None]:
    """A file without the channel of its tachometer, and that channel; None where none is named.

    Raises
    ------
    ConfigError    for a channel that is not there, or is the only one
    """
    if tacho is None:
        return content, None
    if tacho not in content.channels:
        raise ConfigError(
            f"{content.file}: no channel {tacho}; it has {', '.join(content.channels)}",
        )
    index = content.channels.index(tacho)
    names = tuple(name for name in content.channels if name != tacho)
    if not names:
        raise ConfigError(f"{content.file}: there is no channel beside {tacho}")
    others = np.delete(content.values, index, axis=0)
    return replace(content, channels=names, values=others), content.values[index]


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
