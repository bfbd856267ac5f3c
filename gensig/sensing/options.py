"""Options of the group ``sensing`` of a configuration."""

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
from gensig.units import check_choice, read

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
    rest: dict[str, Any] = {}
    if isinstance(values, Mapping):
        rest.update(values)
    kind = rest.pop("kind", None)
    check_choice("sensing.path.kind", kind, (IDENTITY, *PATHS))
    if kind != IDENTITY:
        return read(PATHS[kind], rest, "sensing.path")
    for key in rest:
        raise ConfigError(
            f"sensing.path: unknown key '{key}'; kind = identity has no other key. Where you did "
            "not type it, the file of the experiment sets it for the sensing that it chooses: "
            f"keep that one, or add '~sensing.path.{key}'"
        )
    return None
