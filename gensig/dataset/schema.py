"""The data sets of a shard, versions 1 and 2.

`docs/format.md` describes these tables.
"""

from collections.abc import Collection, Mapping
from typing import Any

from gensig.dataset.columns import COLUMNS, GEAR_COLUMNS, Column, columns_of_axes
from gensig.errors import DatasetError

SCHEMA_VERSION = 1
# of sets whose units differ in their gears: readers of version 1 would take the attributes of one
# design for those of all records
GEARS_VERSION = 2
READABLE_VERSIONS = (SCHEMA_VERSION, GEARS_VERSION)

SIGNALS = (
    columns_of_axes(
        "channel sample",
        (
            "acceleration",
            "float32",
            "m/s^2",
            "result",
            "what the sensors report, noise included",
        ),
        (
            "acceleration_clean",
            "float32",
            "m/s^2",
            "result",
            "the same without noise, offset and converter (optional)",
        ),
        (
            "healthy_twin",
            "float32",
            "m/s^2",
            "result",
            "acceleration of the same record without its faults, with noise of its own "
            "(optional)",
        ),
    )
    | columns_of_axes(
        "source sample",
        (
            "acceleration_source",
            "float32",
            "m/s^2",
            "result",
            "accelerations at the bearings, before path and sensor, by source_names (optional)",
        ),
        (
            "healthy_twin_source",
            "float32",
            "m/s^2",
            "result",
            "the same of the record without its faults (optional)",
        ),
    )
    | columns_of_axes(
        "channel",
        (
            "acceleration_scale",
            "float64",
            "m/s^2",
            "result",
            "value of one count of acceleration, NaN in a failed record (only where that is "
            "int16)",
        ),
        (
            "acceleration_clean_scale",
            "float64",
            "m/s^2",
            "result",
            "the same for acceleration_clean",
        ),
        (
            "healthy_twin_scale",
            "float64",
            "m/s^2",
            "result",
            "the same for healthy_twin",
        ),
    )
    | columns_of_axes(
        "sample",
        (
            "tacho",
            "float32",
            "1",
            "result",
            "tachometer: 1 in a pulse, 0 between, at an edge the share of the sample (optional)",
        ),
        (
            "encoder_angle",
            "float64",
            "rad",
            "result",
            "angle that the encoder reads, from its index mark on, errors included (optional)",
        ),
        (
            "shaft_angle",
            "float64",
            "rad",
            "result",
            "angle of the driving shaft (optional)",
        ),
        (
            "shaft_speed",
            "float32",
            "rad/s",
            "result",
            "actual speed of the driving shaft, central difference of its angle (optional)",
        ),
        (
            "torque_set",
            "float32",
            "N m",
            "condition",
            "set torque over time, as torque_nm (optional)",
        ),
    )
    | columns_of_axes(
        "pair sample",
        (
            "mesh_pinion_tooth",
            "int16",
            "1",
            "fault",
            "pinion tooth of each pair that carries load, from 0; -1 where it does not "
            "(optional)",
        ),
        ("mesh_wheel_tooth", "int16", "1", "fault", "the same of the wheel (optional)"),
        (
            "mesh_load_share",
            "float32",
            "1",
            "fault",
            "normal force of each pair over that of all (optional)",
        ),
    )
    | columns_of_axes(
        "sample",
        (
            "mesh_force",
            "float32",
            "N",
            "fault",
            "normal force of all pairs, negative on the back flanks (optional)",
        ),
        (
            "contact_lost",
            "int8",
            "1",
            "fault",
            "1 where no tooth touches another (optional)",
        ),
        (
            "fault_engaged",
            "int8",
            "1",
            "fault",
            "1 where a faulty tooth carries load or stands on the path of contact (optional)",
        ),
    )
    | columns_of_axes(
        "class",
        (
            "fault_multihot",
            "int8",
            "1",
            "label",
            "1 for the record's class and those of a compound fault's parts, by class_names "
            "(optional)",
        ),
    )
    | columns_of_axes(
        "channel",
        (
            "signal_power",
            "float64",
            "(m/s^2)^2",
            "result",
            "mean square of the signal without noise, in the band of snr_db (optional)",
        ),
        (
            "noise_power",
            "float64",
            "(m/s^2)^2",
            "noise",
            "mean square of the noise, in the band of snr_db (optional)",
        ),
    )
)

# Signals of one mesh. Those of a mesh that records do not follow have the names of its driving and
# its driven gear before the name, which then means them by pinion and wheel.
OF_MESHES = (
    "mesh_pinion_tooth",
    "mesh_wheel_tooth",
    "mesh_load_share",
    "mesh_force",
    "contact_lost",
    "fault_engaged",
)

# How time signals with a scale may be stored, and the column that holds the scale of each.
SAMPLE_TYPES = ("float32", "int16")
SCALES = {
    "acceleration": "acceleration_scale",
    "acceleration_clean": "acceleration_clean_scale",
    "healthy_twin": "healthy_twin_scale",
}

# What a reader may rely on; this list never grows, so that adding a column is no new
# version.
REQUIRED = (
    "acceleration",
    "record_id",
    "label",
    "label_name",
    "severity",
    "gearbox_id",
    "specimen_id",
    "unit_id",
    "condition_id",
    "speed_rpm",
    "torque_nm",
    "status",
)
# What ties a shard to its data set: a root attribute, and an attribute of the data set record_id,
# the number of the shard from 0. Root attributes are the same in all shards.
IDENTITY, SHARD_INDEX = "identity", "shard_index"
REQUIRED_ATTRIBUTES = (
    "schema_version",
    "sampling_rate_hz",
    "channel_names",
    "class_names",
)

# A column left out of `ShardWriter.write` gets its value here; any other must be given.
DEFAULTS: dict[str, str | float] = {
    "repeat": 0,
    "status": "ok",
    "status_reason": "",
    "integration_error": float("nan"),
    "integration_check": "none",
    "contact_loss_fraction": float("nan"),
    "detectability": float("nan"),
    "clipped_fraction": float("nan"),
    "clipped": 0,
    "dropped_fraction": float("nan"),
}

PARAMS = "params"
ACCELERATION = "m/s^2"


def find_signal(name: str) -> Column | None:
    """The column of a signal, of any mesh; None for a name that is no signal."""
    for of_mesh in OF_MESHES:
        if name.endswith(f"_{of_mesh}"):
            return SIGNALS[of_mesh]
    return SIGNALS.get(name)


def signal_column(name: str) -> Column:
    """The column of a signal, of any mesh; DatasetError for a name that is no signal."""
    column = find_signal(name)
    if column is None:
        raise DatasetError(f"'{name}' is no signal of a data set")
    return column


def known_column(name: str) -> Column | None:
    """The column of a signal, or of one value a record; None for an unknown name."""
    return find_signal(name) or COLUMNS.get(name)


def bulk_signals(names: Collection[str]) -> list[str]:
    """Those of some names that are time signals, in the order of `SIGNALS`, further meshes last."""
    known = [name for name in SIGNALS if SIGNALS[name].is_bulk and name in names]
    further = sorted(set(names) - SIGNALS.keys())
    return [*known, *(name for name in further if find_signal(name) is not None)]


def version_of(columns: Collection[str]) -> int:
    """Version of a data set that has these columns."""
    if GEAR_COLUMNS[0] in columns:
        return GEARS_VERSION
    return SCHEMA_VERSION


def kind_of(name: str) -> str | None:
    """The kind of values a named column holds.

    'str', 'int', 'float', or None for a name the schema does not know.
    """
    if name.startswith(f"{PARAMS}/"):
        return "float"
    if name in ("shard", "row"):
        return "int"
    if name not in COLUMNS:
        return None
    return {"S": "str", "i": "int", "f": "float"}[COLUMNS[name].storage_dtype.kind]


def stored_reason(reason: str | float) -> str:
    """`status_reason` as far as a shard holds it."""
    stored = str(reason).encode("ascii", "backslashreplace")
    return stored[: COLUMNS["status_reason"].n_bytes].decode()


def unit_in_file(column: Column, attributes: Mapping[str, Any]) -> str:
    """Unit of a column in a data set with these root attributes.

    Rotations among the channels are in rad/s^2.
    """
    units = set(attributes.get("channel_units") or [ACCELERATION])
    has_channels = {"channel", "source"} & set(column.axes)
    if not has_channels or ACCELERATION not in column.unit or units == {ACCELERATION}:
        return column.unit
    if len(units) > 1:
        return "by channel_units"
    return column.unit.replace(ACCELERATION, units.pop())
