"""Settings of a training run, checked once; the values live in ``configs/train.yaml``."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from diagnose.baselines.base import Role
from diagnose.baselines.features import FEATURES
from diagnose.baselines.registry import baseline_names
from gensig.errors import ConfigError
from gensig.options.configuration import Configuration, Section
from gensig.text.nearest import hint

DEVICES = ("auto", "cpu", "cuda")
HEADS = ("severity", "gear")
REFERENCES = (
    "auto",
    "none",
    "other_condition",
    "same_condition",
    "every_condition",
)
TASKS = ("classes", "remaining_life")
BOTH = (
    "both"  # value of normalise: one training without the level, a second one with it
)
# Least values of whole numbers.
LEAST = {
    "n_seeds_control": 1,
    "n_bootstrap": 1,
    "batch_size": 2,
}
OWN = "training"  # section of a network's file that gives a `Schedule`
LISTS = ("protocols", "classes", "channels", "test_channels", "seeds")
CHOICES = ("baselines", "heads")  # lists that may be false or empty


def _check_whole(name: str, value: Any, *, least: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise ConfigError(
            f"{name} must be a whole number of at least {least}, not {value!r}"
        )


def _check_share(name: str, value: Any) -> None:
    if not (_is_number(value) and 0 <= value <= 1):
        raise ConfigError(f"{name} must be a number from 0 to 1, not {value!r}")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_positive(value: Any, *, below: float = float("inf")) -> bool:
    return _is_number(value) and 0 < value < below


@dataclass(frozen=True, slots=True, kw_only=True)
class LifeSettings:
    """Settings of ``task=remaining_life``; each key is explained in ``configs/train.yaml``."""

    early_life_h: float | None
    early_life_share: float
    coverage: float
    with_age: bool

    def __post_init__(self) -> None:
        if self.early_life_h is not None and not _is_positive(self.early_life_h):
            raise ConfigError(
                "remaining_life.early_life_h must be a number above 0, "
                f"not {self.early_life_h!r}"
            )
        for name in ("early_life_share", "coverage"):
            value = getattr(self, name)
            if not _is_positive(value, below=1):
                raise ConfigError(
                    f"remaining_life.{name} must be a number above 0 and below 1, "
                    f"not {value!r}"
                )
        if not isinstance(self.with_age, bool):
            raise ConfigError(
                f"remaining_life.with_age must be true or false, not {self.with_age!r}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Schedule:
    """Length of a training.

    Attributes
    ----------
    epochs : most epochs
    examples : examples after which no further epoch begins once `LEAST_EPOCHS` are done; None sets
        no such end
    patience : epochs without a better validation loss before stopping; 0 never stops, and keeps
        the weights of the last epoch
    epoch_fraction : share of the training signal that is drawn as windows in one epoch
    """

    epochs: int
    patience: int
    epoch_fraction: float
    examples: int | None = None

    def __post_init__(self) -> None:
        _check_whole("epochs", self.epochs, least=1)
        if self.examples is not None:
            _check_whole("examples", self.examples, least=1)
        _check_whole("patience", self.patience, least=0)
        _check_share("epoch_fraction", self.epoch_fraction)

    def epochs_of(self, n_drawn: int) -> int:
        """Most epochs of a training that draws so many examples in each."""
        if self.examples is None:
            return self.epochs
        enough = max(math.ceil(self.examples / n_drawn), LEAST_EPOCHS)
        return min(self.epochs, enough)


LEAST_EPOCHS = 8  # of a training that has shown its network enough examples; assumed
GIVEN = (
    "epochs",
    "patience",
    "epoch_fraction",
)  # keys of a schedule in ``configs/train.yaml``
USUAL = Schedule(epochs=14, patience=5, epoch_fraction=0.25)


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainSettings:
    """Settings of ``diagnose train``; each key is explained in ``configs/train.yaml``."""

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
    epochs: int | None  # None, as of the next two: see `schedule`
    patience: int | None
    epoch_fraction: float | None
    batch_size: int
    learning_rate: float
    weight_decay: float
    heads: tuple[str, ...]
    shuffle_control: bool
    n_seeds_control: int
    metadata_probe: bool
    oracle: str | bool
    reference: str
    sham: str | None
    baselines: tuple[str, ...]
    features: str
    n_bootstrap: int
    n_threads: int | None
    device: str
    tensorboard: bool
    remaining_life: LifeSettings

    def __post_init__(self) -> None:
        for name, least in LEAST.items():
            _check_whole(name, getattr(self, name), least=least)
        for name in ("window_samples", "stride_samples", "n_threads"):
            if getattr(self, name) is not None:
                _check_whole(name, getattr(self, name), least=1)
        if self.sampling_rate_hz is not None and not _is_positive(
            self.sampling_rate_hz
        ):
            raise ConfigError(
                "sampling_rate_hz must be null or a number of samples a second, "
                f"not {self.sampling_rate_hz!r}"
            )
        for name in ("learning_rate", "weight_decay"):
            _check_share(name, getattr(self, name))
        _ = self.schedule  # refuses what is no length of a training
        for name in LISTS:
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
        if self.sham is not None and (not isinstance(self.sham, str) or not self.sham):
            raise ConfigError(
                "sham must be the folder of a data set made with plan.sham=true, "
                f"not {self.sham!r}"
            )
        self._check_list("baselines", baseline_names(Role.RIVAL))
        self._check_list("heads", HEADS)
        self._check_one("task", TASKS, f"one of {', '.join(TASKS)}")
        self._check_one("reference", REFERENCES, f"one of {', '.join(REFERENCES)}")
        self._check_one("oracle", ("auto", False), "auto or false")
        self._check_one("features", tuple(FEATURES), " or ".join(FEATURES))
        self._check_one("device", DEVICES, f"one of {', '.join(DEVICES)}")

    @property
    def schedule(self) -> Schedule:
        """Length of the network's training: as given, else of its file, else `USUAL`."""
        own = self.model.get(OWN) or {}
        known = [field.name for field in dataclasses.fields(Schedule)]
        if not isinstance(own, Mapping) or not set(own) <= set(known):
            raise ConfigError(
                f"model.{OWN} must hold keys out of {', '.join(known)} and nothing else"
            )
        return self._given(dataclasses.replace(USUAL, **own))

    @property
    def usual_schedule(self) -> Schedule:
        """Length of a training of another network: as given, else `USUAL`."""
        return self._given(USUAL)

    def _given(self, otherwise: Schedule) -> Schedule:
        """The keys of a schedule that are given, the others of another one.

        A given number of epochs takes the place of a number of examples.
        """
        given = {name: getattr(self, name) for name in GIVEN}
        given = {name: value for name, value in given.items() if value is not None}
        if "epochs" in given:
            given["examples"] = None
        return dataclasses.replace(otherwise, **given)

    def _check_one(self, key: str, allowed: Sequence[Any], text: str) -> None:
        """Refuse a value that is not allowed."""
        if getattr(self, key) not in allowed:
            raise ConfigError(f"{key} must be {text}, not {getattr(self, key)!r}")

    def _check_list(self, key: str, allowed: Sequence[str]) -> None:
        """Refuse a list with a name twice or one that is not allowed."""
        names = getattr(self, key)
        unknown = [name for name in names if name not in allowed]
        if unknown and isinstance(unknown[0], str):
            one = key.removesuffix("s")
            raise ConfigError(f"no {one} '{unknown[0]}'; {hint(unknown[0], allowed)}")
        if len(set(names)) < len(names) or not set(names) <= set(allowed):
            raise ConfigError(
                f"{key} must be false or a list of different names "
                f"out of {', '.join(allowed)}, not {', '.join(map(str, names))}"
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
    if isinstance(seed := values["seeds"], int) and not isinstance(seed, bool):
        raise ConfigError(
            f"seeds={seed} is one number, and seeds is a list: 'seeds=[{seed}]' trains once, with "
            f"seed {seed}; 'seeds=[0,1,2]' trains three times"
        )
    for name in LISTS:
        values[name] = _as_tuple(name, values[name])
    if values["seeds"] is None:
        raise ConfigError("seeds must be a list of different values, at least one")
    for name in CHOICES:
        if values[name] is False:
            values[name] = None
        values[name] = _as_tuple(name, values[name]) or ()
    values["remaining_life"] = _life_settings(values["remaining_life"])
    values["data"], values["out"] = str(values["data"]), str(values["out"])
    return TrainSettings(**values)


def _life_settings(value: Any) -> LifeSettings:
    known = [field.name for field in dataclasses.fields(LifeSettings)]
    if not isinstance(value, Mapping) or set(value) != set(known):
        raise ConfigError(
            f"remaining_life must hold {', '.join(known)} and nothing else"
        )
    return LifeSettings(**value)


def _as_tuple(name: str, value: Any) -> tuple[Any, ...] | None:
    """A list as a tuple, and a single value as a tuple of one; None stays None."""
    if value is None:
        return None
    if isinstance(value, Mapping):
        raise ConfigError(f"{name} must be a list, for instance {name}=[a,b]")
    if isinstance(value, list):
        return tuple(value)
    return (value,)
