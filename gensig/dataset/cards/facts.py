"""Facts of a data set that its cards and its page state in words."""

from contextlib import suppress

import numpy as np

from gensig.arrays import Flags
from gensig.dataset.columns import GEAR_COLUMNS, GEAR_NAMES, GEAR_PINION_TURNS
from gensig.dataset.reader import Dataset
from gensig.dataset.splitting.dealing import GROUP_NAMES
from gensig.errors import DatasetError
from gensig.text.escaping import plain

GEOMETRY = (*GEAR_COLUMNS, "usable_band_hz")


def n_designs(data: Dataset) -> int:
    """Number of different gear designs; 1 where they are in the root attributes."""
    varied = [name for name in GEAR_COLUMNS if name in data.column_names]
    if not varied:
        return 1
    designs = np.stack([data.column(name) for name in varied], axis=1)
    return len(np.unique(designs, axis=0))


def channel_units(data: Dataset) -> dict[str, str]:
    """Unit of each channel by its name, m/s^2 where the data set does not say."""
    names = data.channel_names
    told = zip(names, map(str, data.attributes.get("channel_units", [])), strict=False)
    return {**dict.fromkeys(names, "m/s^2"), **dict(told)}


def gear_turns(data: Dataset) -> dict[str, float]:
    """Turns of the driving shaft during one turn of each gear of a drive line; {} for a pair."""
    names = data.attributes.get(GEAR_NAMES, [])
    turns = data.attributes.get(GEAR_PINION_TURNS, [])
    if not isinstance(names, list) or not isinstance(turns, list):
        return {}
    return dict(zip(map(str, names), map(float, turns), strict=False))


def gear_facts(data: Dataset) -> dict[str, object]:
    """All gears of a drive line with their teeth, and the records with faults of each."""
    names = gear_turns(data)
    if not names:
        return {}
    listed = [f"{name} {data.n_teeth(name)[0]}" for name in names]
    facts: dict[str, object] = {"gears": f"{', '.join(listed)} teeth"}
    if "fault_gear" in data.column_names:
        faulty = data.column("fault_gear")
        counts = {name: int(np.count_nonzero(faulty == name)) for name in names}
        shown = [f"{name} {counts[name]}" for name in counts if counts[name]]
        facts["faults on"] = "no gear"
        if shown:
            facts["faults on"] = f"{', '.join(shown)} records"
    return facts


def geometry_facts(data: Dataset) -> dict[str, object]:
    """Geometry of the gears by name; the number of designs and ranges where units differ."""
    facts: dict[str, object] = {}
    if GEAR_COLUMNS[0] in data.column_names:
        facts["designs of gears"] = n_designs(data)
    for name in GEOMETRY:
        if name in data.column_names:
            facts[name] = value_range(data.column(name), "")
        elif name in data.attributes:
            facts[name] = rounded(data.attributes[name])
    return facts | gear_facts(data)


def class_examples(data: Dataset) -> dict[str, Flags]:
    """(record,) by class name: the records of each class that are no reference.

    The classes of the data set stand first, in their order.
    """
    label, is_example = data.column("label_name"), ~data.is_reference
    names = dict.fromkeys([*data.class_names, *np.unique(label[is_example]).tolist()])
    return {name: is_example & (label == name) for name in names}


def running_facts(data: Dataset) -> dict[str, object]:
    """Groups of machines by name, and ranges of speed, torque and signal-to-noise ratio."""
    facts: dict[str, object] = {
        plural: len(np.unique(data.column(column)))
        for column, (_, plural) in GROUP_NAMES.items()
    }
    # for a drive line the torque of its load
    turned = plain(data.attributes.get("torque_of", "driving shaft"))
    ranges = {
        "speed_rpm": ("speed of the driving shaft", "r/min"),
        "torque_nm": (f"torque of the {turned}", "N m"),
        "snr_db": ("signal-to-noise ratio", "dB"),
    }
    for column, (name, unit) in ranges.items():
        if column in data.column_names:
            facts[name] = value_range(data.column(column), unit)
    return facts


def kind_of_machine(data: Dataset) -> str:
    """Designs and teeth of a data set in words."""
    numbers = []
    for gear in ("pinion", "wheel"):
        number = "?"
        with suppress(DatasetError):
            number = value_range(data.n_teeth(gear), "")
        numbers.append(number)
    teeth = f"{' and '.join(numbers)} teeth"
    if GEAR_COLUMNS[0] in data.column_names:
        return f"One kind of machine in {n_designs(data)} designs: {teeth}"
    return f"One kind of machine: {teeth}"


def rounded(value: object) -> object:
    """A number to the fourth decimal, anything else as it is."""
    return round(value, 4) if isinstance(value, float) else value


def value_range(values: np.ndarray, unit: str) -> str:
    """'1200 to 1800 r/min', over the finite values."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return "none"
    ends = dict.fromkeys((f"{finite.min():.6g}", f"{finite.max():.6g}"))
    return f"{' to '.join(ends)} {unit}".rstrip()
