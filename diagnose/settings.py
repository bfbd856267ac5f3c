"""Settings of a training run, checked once; the values live in ``configs/train.yaml``."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from diagnose.baselines.base import Role
from diagnose.baselines.features import FEATURES
from diagnose.baselines.minirocket import KERNELS
from diagnose.baselines.registry import baseline_names
from gensig.errors import ConfigError
from gensig.options.configuration import Configuration, Section

DEVICES = ("auto", "cpu", "cuda")
HEADS = ("severity", "gear")
TASKS = ("classes", "remaining_life")
BOTH = (
    "both"  # of normalise: without the level, and beside it a second training with it
)


@dataclass(frozen=True, slots=True, kw_only=True)
class LifeSettings:
    """What ``task=remaining_life`` is told beside.

    Each key is explained in ``configs/train.yaml``.
    """

    early_life_h: float | None
    early_life_share: float
    coverage: float
    with_age: bool

    def __post_init__(self) -> None:
        if self.early_life_h is not None:
            _check_between(
                "remaining_life.early_life_h", self.early_life_h, most=float("inf")
            )
        _check_between("remaining_life.early_life_share", self.early_life_share, most=1)
        _check_between("remaining_life.coverage", self.coverage, most=1)
        if not isinstance(self.with_age, bool):
            raise ConfigError(
                f"remaining_life.with_age must be true or false, not {self.with_age!r}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainSettings:
    """What ``diagnose train`` is told; each key is explained in ``configs/train.yaml``."""

    data: str
    out: str
    task: str
    model: Section
    protocols: tuple[str, ...] | None
    classes: tuple[str, ...] | None
    channels: tuple[str, ...] | None
    test_channels: tuple[str, ...] | None
    seeds: tuple[int, ...]
    sampling_rate_hz: float | None
    window_samples: int | None  # None: see `diagnose.data.window_choice`
    stride_samples: int | None  # None: as long as a window
    normalise: str
    epochs: int
    patience: int
    batch_size: int
    learning_rate: float
    weight_decay: float
    epoch_fraction: float
    heads: tuple[str, ...]
    shuffle_control: bool
    n_seeds_control: int
    metadata_probe: bool
    oracle: str | bool
    sham: str | None
    baselines: tuple[str, ...]
    features: str
    minirocket_features: int
    n_bootstrap: int
    n_threads: int | None
    device: str
    tensorboard: bool
    remaining_life: LifeSettings

    def __post_init__(self) -> None:
        if self.task not in TASKS:
            raise ConfigError(
                f"task must be one of {', '.join(TASKS)}, not {self.task!r}"
            )
        for name in ("epochs", "patience", "n_seeds_control", "n_bootstrap"):
            _check_whole(name, getattr(self, name), least=1)
        for name in ("window_samples", "stride_samples"):
            if getattr(self, name) is not None:
                _check_whole(name, getattr(self, name), least=1)
        _check_whole("batch_size", self.batch_size, least=2)
        _check_whole(
            "minirocket_features", self.minirocket_features, least=len(KERNELS)
        )
        if self.n_threads is not None:
            _check_whole("n_threads", self.n_threads, least=1)
        if self.sampling_rate_hz is not None:
            _check_rate("sampling_rate_hz", self.sampling_rate_hz)
        for name in ("learning_rate", "weight_decay", "epoch_fraction"):
            _check_number(name, getattr(self, name))
        for name in ("protocols", "classes", "channels", "test_channels", "seeds"):
            values = getattr(self, name)
            if values is not None and (not values or len(set(values)) < len(values)):
                raise ConfigError(
                    f"{name} must be a list of different values, at least one"
                )
        for seed in self.seeds:
            _check_whole("seeds", seed, least=0)
        for name in ("shuffle_control", "tensorboard", "metadata_probe"):
            if not isinstance(getattr(self, name), bool):
                raise ConfigError(
                    f"{name} must be true or false, not {getattr(self, name)!r}"
                )
        if self.oracle not in ("auto", False):
            raise ConfigError(f"oracle must be auto or false, not {self.oracle!r}")
        if self.sham is not None and (not isinstance(self.sham, str) or not self.sham):
            raise ConfigError(
                f"sham must be the folder of a data set made with plan.sham=true, not {self.sham!r}"
            )
        self._check_list("baselines", baseline_names(Role.RIVAL))
        self._check_list("heads", HEADS)
        if self.features not in tuple(FEATURES):
            raise ConfigError(
                f"features must be {' or '.join(FEATURES)}, not {self.features!r}"
            )
        if self.device not in DEVICES:
            raise ConfigError(
                f"device must be one of {', '.join(DEVICES)}, not {self.device!r}"
            )

    def _check_list(self, key: str, allowed: Sequence[str]) -> None:
        """Refuse a list with a name twice or one that is not allowed."""
        names = getattr(self, key)
        if len(set(names)) < len(names) or not set(names) <= set(allowed):
            raise ConfigError(
                f"{key} must be false or a list of different names out of {', '.join(allowed)}, "
                f"not {', '.join(str(name) for name in names)}"
            )


def settings_from(config: Configuration) -> TrainSettings:
    """Settings of a composed configuration.

    Raises
    ------
    ConfigError    for a key too many or a value out of range
    """
    known = {field.name for field in dataclasses.fields(TrainSettings)}
    if unknown := sorted(set(config) - known):
        raise ConfigError(f"diagnose train knows no key '{unknown[0]}'")
    values = config.plain()
    values["model"] = config.section("model")
    for name in ("protocols", "classes", "channels", "test_channels", "seeds"):
        values[name] = _as_tuple(name, values[name])
    if values["seeds"] is None:
        raise ConfigError("seeds must be a list of different values, at least one")
    values["baselines"] = (
        ()
        if values["baselines"] is False
        else _as_tuple("baselines", values["baselines"]) or ()
    )
    values["heads"] = (
        () if values["heads"] is False else _as_tuple("heads", values["heads"]) or ()
    )
    values["remaining_life"] = _life_settings(values["remaining_life"])
    values["data"], values["out"] = str(values["data"]), str(values["out"])
    return TrainSettings(**values)


def _life_settings(value: Any) -> LifeSettings:
    known = [field.name for field in dataclasses.fields(LifeSettings)]
    if not isinstance(value, Mapping) or set(value) != set(known):
        raise ConfigError(
            f"remaining_life must hold {', '.join(known)} and nothing else"
        )
    return LifeSettings(**{str(key): given for key, given in value.items()})


def _as_tuple(name: str, value: Any) -> tuple[Any, ...] | None:
    """None stays, one value becomes a list of one."""
    if value is None:
        return None
    if isinstance(value, Mapping):
        raise ConfigError(f"{name} must be a list, for instance {name}=[a,b]")
    return tuple(value) if isinstance(value, list) else (value,)


def _check_whole(name: str, value: Any, *, least: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise ConfigError(
            f"{name} must be a whole number of at least {least}, not {value!r}"
        )


def _check_rate(name: str, value: Any) -> None:
    if (
        isinstance(value, bool)
        or not isinstance(value, int | float)
        or not 0 < value < float("inf")
    ):
        raise ConfigError(
            f"{name} must be null or a number of samples a second, not {value!r}"
        )


def _check_number(name: str, value: Any) -> None:
    if (
        isinstance(value, bool)
        or not isinstance(value, int | float)
        or not 0 <= value <= 1
    ):
        raise ConfigError(f"{name} must be a number from 0 to 1, not {value!r}")


def _check_between(name: str, value: Any, *, most: float) -> None:
    """Refuse what is not above 0 and below `most`; for 1 that is a share."""
    if (
        isinstance(value, bool)
        or not isinstance(value, int | float)
        or not 0 < value < most
    ):
        raise ConfigError(
            f"{name} must be a number above 0{' and below 1' if most == 1 else ''}, not {value!r}"
        )
