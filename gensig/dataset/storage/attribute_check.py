"""Root attributes of shards of others: their kinds, lengths and ranges."""

from collections.abc import Mapping
from typing import Any

from gensig.dataset.columns import (
    GEAR_COLUMNS,
    GEAR_NAMES,
    GEAR_PINION_TURNS,
    GEAR_TEETH,
)
from gensig.dataset.schema import IDENTITY

TEXT, TEXTS = "text", "a list of text"
WHOLE, WHOLES = "a whole number above 0", "a list of whole numbers above 0"
NUMBER, NUMBERS = "a finite number", "a list of finite numbers"
TEETH_LIMIT = 100_000  # of a gear, and of the marks of an encoder or a tachometer

KINDS = {
    "channel_names": TEXTS,
    "class_names": TEXTS,
    "channel_units": TEXTS,
    "source_names": TEXTS,
    GEAR_NAMES: TEXTS,
    GEAR_TEETH: WHOLES,
    GEAR_PINION_TURNS: NUMBERS,
    "usable_band_hz": NUMBERS,
    IDENTITY: TEXT,
    "generator_version": TEXT,
    "config_json": TEXT,
    "torque_of": TEXT,
    "tacho_shaft": TEXT,
    "encoder_shaft": TEXT,
    "tacho_pulses_per_turn": WHOLE,
    "encoder_lines_per_turn": WHOLE,
} | {name: WHOLE if name.startswith("n_teeth_") else NUMBER for name in GEAR_COLUMNS}
# attribute -> what has as many values
AS_MANY = {
    "channel_names": "channel",
    "channel_units": "channel",
    "source_names": "source",
    GEAR_TEETH: GEAR_NAMES,
    GEAR_PINION_TURNS: GEAR_NAMES,
}


def attribute_problem(attributes: Mapping[str, Any], lengths: Mapping[str, int]) -> str:
    """One line on the first known attribute that cannot be what it must be; '' for none.

    Parameters
    ----------
    attributes : of the root, as `read_attributes` gives them; unknown ones are left alone
    lengths : of the axes 'channel' and 'source', as far as the shard has them
    """
    for name in KINDS.keys() & attributes.keys():
        if not _IS[KINDS[name]](attributes[name]):
            shown = repr(attributes[name])[:60]
            return f"attribute {name} is {shown}; it must be {KINDS[name]}"
    lengths = {**lengths, **_length(attributes, GEAR_NAMES)}
    for name, other in AS_MANY.items():
        n_values = _length(attributes, name).get(name)
        if None not in (n_values, lengths.get(other)) and n_values != lengths[other]:
            return (
                f"attribute {name} has {n_values} values for {lengths[other]} "
                f"{other.removesuffix('_names')}s"
            )
    band = attributes.get("usable_band_hz", [0, 1])
    if len(band) != 2 or not 0 <= band[0] < band[1]:
        return f"attribute usable_band_hz is {band[:3]}; it must be its lower and upper end"
    return ""


def _length(attributes: Mapping[str, Any], name: str) -> dict[str, int]:
    if name not in attributes:
        return {}
    return {name: len(attributes[name])}


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and abs(value) < float("inf")


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and 0 < value <= TEETH_LIMIT


_IS = {
    TEXT: lambda value: isinstance(value, str),
    TEXTS: lambda value: isinstance(value, list) and {*map(type, value)} <= {str},
    WHOLE: _is_whole,
    WHOLES: lambda value: isinstance(value, list) and all(map(_is_whole, value)),
    NUMBER: _is_number,
    NUMBERS: lambda value: isinstance(value, list) and all(map(_is_number, value)),
}
