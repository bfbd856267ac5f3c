"""Types, finiteness and ranges of the values in ``model.json``, which may be a stranger's.

Ranges bound memory before any tensor is made; they are far beyond what trainings write.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from diagnose.scoring.hours import LIFE_COLUMNS, LifeFacts

Reader = Callable[[str, Any], Any]  # name and value -> typed value, or ValueError

MOST_CHANNELS, MOST_CLASSES, MOST_TEETH = 256, 1000, 5000
MOST_SAMPLES = 2**20  # of a window
MOST_PARAMETER = 2048  # of whole numbers of a network: channels, kernels, layers
MOST_BLOCKS = 64  # entries of a list of a network
MOST_HOURS = 1e9
LONGEST_TEXT = 500
NORMALISATIONS = ("rms", "none")
SCHEDULE = "training"  # of a network's parameters; builds nothing


def whole(low: int, high: int) -> Reader:
    """Reader of whole numbers within bounds, both included."""

    def read(name: str, value: Any) -> int:
        if type(value) is not int or not low <= value <= high:
            raise ValueError(
                f"{name} {_shown(value)} is no whole number from {low} to {high}"
            )
        return value

    return read


def number(low: float, high: float) -> Reader:
    """Reader of finite numbers within bounds, both included."""

    def read(name: str, value: Any) -> float:
        if type(value) not in (int, float) or not low <= value <= high:
            raise ValueError(
                f"{name} {_shown(value)} is no number from {low:g} to {high:g}"
            )
        return float(value)

    return read


def text(name: str, value: Any) -> str:
    """A text of bounded length."""
    if not isinstance(value, str) or not 0 < len(value) <= LONGEST_TEXT:
        raise ValueError(f"{name} {_shown(value)} is no text of 1 to {LONGEST_TEXT}")
    return value


def choice(*allowed: str) -> Reader:
    """Reader of one of some texts."""

    def read(name: str, value: Any) -> str:
        if value not in allowed:
            raise ValueError(f"{name} {_shown(value)}; allowed: {', '.join(allowed)}")
        return str(value)

    return read


def texts(most: int, *, least: int = 1) -> Reader:
    """Reader of a list of different texts."""

    def read(name: str, value: Any) -> tuple[str, ...]:
        if not isinstance(value, list) or not least <= len(value) <= most:
            raise ValueError(f"{name} is no list of {least} to {most} texts")
        result = tuple(text(name, entry) for entry in value)
        if len(set(result)) < len(result):
            raise ValueError(f"{name} names one thing twice")
        return result

    return read


def pair(reader: Reader, *, ordered: bool = False) -> Reader:
    """Reader of two values, the first at most the second if they are ordered."""

    def read(name: str, value: Any) -> tuple[Any, Any]:
        if not isinstance(value, list) or len(value) != 2:
            raise ValueError(f"{name} {_shown(value)} is no list of two")
        first, second = (reader(name, entry) for entry in value)
        if ordered and first > second:
            raise ValueError(f"{name} {_shown(value)} is not in order")
        return first, second

    return read


def optional(reader: Reader) -> Reader:
    """Reader that lets null through."""

    def read(name: str, value: Any) -> Any:
        return None if value is None else reader(name, value)

    return read


def flag(name: str, value: Any) -> bool:
    """True or false."""
    if not isinstance(value, bool):
        raise ValueError(f"{name} {_shown(value)} is not true or false")
    return value


def mapping(name: str, value: Any) -> dict[str, Any]:
    """A group of values, whatever they are."""
    if not isinstance(value, dict):
        raise ValueError(f"{name} {_shown(value)} is no group of values")
    return dict(value)


def group(readers: Mapping[str, Reader]) -> Reader:
    """Reader of a group that has some keys; others are left as they are."""

    def read(name: str, value: Any) -> dict[str, Any]:
        given = mapping(name, value)
        if missing := [key for key in readers if key not in given]:
            raise ValueError(f"{name} has no {', '.join(missing)}")
        typed = {
            key: reader(f"{name}.{key}", given[key]) for key, reader in readers.items()
        }
        return given | typed

    return read


def parameters(name: str, value: Any) -> dict[str, Any]:
    """Parameters of a network: flat, with short lists and small whole numbers."""
    given = mapping(name, value)
    for key, entry in given.items():
        if key == SCHEDULE:
            mapping(f"{name}.{key}", entry)
        elif isinstance(entry, list):
            if len(entry) > MOST_BLOCKS:
                raise ValueError(f"{name}.{key} has more than {MOST_BLOCKS} entries")
            for part in entry:
                _parameter(f"{name}.{key}", part)
        else:
            _parameter(f"{name}.{key}", entry)
    return given


def _parameter(name: str, value: Any) -> None:
    if value is None or isinstance(value, bool):
        return
    if isinstance(value, str):
        text(name, value)
    elif isinstance(value, int):
        whole(0, MOST_PARAMETER)(name, value)
    else:
        number(0.0, float(MOST_PARAMETER))(name, value)


def _shown(value: Any) -> str:
    return repr(value)[:60]


_rate = number(1.0, 1e8)
_score = optional(number(-1e9, 1e9))
_tooth_count = whole(1, MOST_TEETH)

# Values that every description has.
REQUIRED: Mapping[str, Reader] = {
    "model": parameters,
    "class_names": texts(MOST_CLASSES),
    "channel_names": texts(MOST_CHANNELS),
    "sampling_rate_hz": _rate,
    "window_samples": whole(1, MOST_SAMPLES),
    "stride_samples": whole(1, MOST_SAMPLES),
    "normalise": choice(*NORMALISATIONS),
    "data_schema_version": optional(whole(0, 10**6)),
    "data_fingerprint": text,
    "protocol": text,
    "seed": whole(0, 2**63 - 1),
    "best_epoch": whole(0, 10**9),
    "n_bootstrap": whole(1, 10**6),
}
LIFE_RANGE = pair(number(-1e12, 1e12), ordered=True)


def _life_ranges(name: str, value: Any) -> dict[str, tuple[float, float]]:
    ranges = mapping(name, value)
    return {key: LIFE_RANGE(name, ends) for key, ends in ranges.items()}


LIFE: Reader = group(
    {
        "method": text,
        "early_life_h": number(1e-9, MOST_HOURS),
        "half_width_h": number(0.0, MOST_HOURS),
        "coverage": number(0.0, 1.0),
        "n_calibration_lives": whole(0, 10**12),
        "told": texts(len(LIFE_COLUMNS), least=0),
        "told_range": _life_ranges,
    }
)


def life_facts(name: str, value: Any) -> LifeFacts:
    """Facts of the content of ``model.json``."""
    return LifeFacts(**LIFE(name, value))


# Values that older models lack, and some that are null.
OPTIONAL: Mapping[str, Reader] = {
    "speed_rpm_range": pair(number(0.0, 1e9), ordered=True),
    "out_of_distribution": mapping,
    "n_teeth": pair(_tooth_count),
    "n_teeth_range": pair(pair(_tooth_count, ordered=True)),
    "temperature": number(1e-3, 1e3),
    "test_channel_names": texts(MOST_CHANNELS),
    "adaptation": mapping,
    "remaining_life": life_facts,
    "test_score": group(
        {
            "balanced_accuracy": group(
                {
                    "mean": _score,
                    "low": _score,
                    "high": _score,
                }
            ),
            "chance": number(0.0, 1.0),
            "n_records": whole(0, 10**12),
            "n_units": whole(0, 10**12),
            "leaky": flag,
        }
    ),
}
