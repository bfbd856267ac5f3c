"""The group ``sensing`` of a configuration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gensig.errors import ConfigError
from gensig.options.configuration import Section
from gensig.sensing.accelerometer import Accelerometer
from gensig.sensing.chain import Sensing
from gensig.sensing.encoder import Encoder
from gensig.sensing.measured_path import MeasuredPath
from gensig.sensing.noise import read_noise
from gensig.sensing.nuisance import read_nuisances
from gensig.sensing.tachometer import Tachometer
from gensig.sensing.transfer_path import ModalPath
from gensig.units import read

IDENTITY = "identity"
PATHS: dict[str, type[ModalPath] | type[MeasuredPath]] = {
    "modal": ModalPath,
    "measured": MeasuredPath,
}
NESTED = ("path", "sensor", "noise", "nuisances", "tacho", "encoder")


def read_sensing(values: Section) -> Sensing:
    """Sensing of the boundary keys of a configuration.

    Raises
    ------
    ConfigError    for unknown or missing keys, kinds and values
    """
    if missing := [key for key in NESTED if key not in values]:
        raise ConfigError(f"sensing: missing {', '.join(missing)}")
    plain = {key: value for key, value in values.items() if key not in NESTED}
    return read(
        Sensing,
        plain,
        "sensing",
        path=_read_path(values["path"]),
        sensor=read(Accelerometer, values["sensor"], "sensing.sensor"),
        noise=read_noise(values["noise"]),
        nuisances=read_nuisances(values["nuisances"]),
        tacho=read(Tachometer, values["tacho"], "sensing.tacho"),
        encoder=read(Encoder, values["encoder"], "sensing.encoder"),
    )


def _read_path(values: Any) -> ModalPath | MeasuredPath | None:
    kind = values.get("kind") if isinstance(values, Mapping) else None
    own = (
        {key: value for key, value in values.items() if key != "kind"}
        if isinstance(values, Mapping)
        else {}
    )
    if kind == IDENTITY:
        if own:
            raise ConfigError(
                f"sensing.path: unknown key '{next(iter(own))}'; kind = identity has no other key. "
                "Where you did not type it, the file of the experiment sets it for the sensing that it chooses: keep "
                f"that one, or add '~sensing.path.{next(iter(own))}'"
            )
        return None
    if kind not in PATHS:
        raise ConfigError(
            f"sensing.path.kind = {kind!r}; allowed: {', '.join((IDENTITY, *PATHS))}"
        )
    return read(PATHS[kind], own, "sensing.path")
