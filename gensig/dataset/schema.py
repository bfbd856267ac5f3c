"""The columns of a data set, version 1.

Names, types, units, meaning. `docs/format.md` is written from these tables.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gensig.errors import DatasetError

SCHEMA_VERSION = 1

ROLES = ("id", "label", "fault", "unit", "condition", "result", "noise", "age")


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """One HDF5 data set of a shard, with one row a record.

    Parameters
    ----------
    name : str           name of the HDF5 data set
    dtype : str          numpy type, or 'str<n>' for ASCII text of at most n bytes
    unit : str           unit of the values; '' for text, '1' for pure numbers
    role : str           one of `ROLES`: what a learner may do with it
    description : str    the meaning, one sentence
    axes : tuple         names of the axes after the record axis; () for one value a record
    """

    name: str
    dtype: str
    unit: str
    role: str
    description: str
    axes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.role not in ROLES:
            raise DatasetError(
                f"column {self.name}: role '{self.role}' is unknown; allowed are {', '.join(ROLES)}"
            )

    @property
    def is_text(self) -> bool:
        """True for text."""
        return self.dtype.startswith("str")

    @property
    def n_bytes(self) -> int:
        """Bytes of one value in the file."""
        return int(self.dtype[3:]) if self.is_text else np.dtype(self.dtype).itemsize

    @property
    def storage_dtype(self) -> np.dtype:
        """Type of the HDF5 data set.

        Text is marked as ASCII, because Octave reads none that is marked as UTF-8.
        """
        return (
            np.dtype(f"S{self.n_bytes}")
            if self.is_text
            else np.dtype(self.dtype).newbyteorder("<")
        )

    @property
    def is_bulk(self) -> bool:
        """True for time signals, which are chunked by record and never read as a column."""
        return "sample" in self.axes


def _table(*rows: tuple[str, str, str, str, str]) -> dict[str, Column]:
    return {
        n: Column(name=n, dtype=d, unit=u, role=r, description=text)
        for n, d, u, r, text in rows
    }


COLUMNS: dict[str, Column] = _table(
    ("record_id", "str32", "", "id", "name of the record, unique in the data set"),
    (
        "label",
        "int16",
        "1",
        "label",
        "class number, index into the attribute class_names",
    ),
    ("label_name", "str64", "", "label", "class name"),
    (
        "faults_json",
        "str4096",
        "",
        "fault",
        "JSON list, one object a fault: kind, gear, tooth, sizes in millimetres",
    ),
    (
        "severity",
        "float64",
        "1",
        "fault",
        "0 healthy to 1: relative size of the fault, the largest when compound",
    ),
    (
        "fault_gear",
        "str16",
        "",
        "fault",
        "gear that carries the (first) fault; empty when healthy",
    ),
    (
        "fault_tooth",
        "int32",
        "1",
        "fault",
        "lowest tooth with the (first) fault, counted from 0; -1: all or none",
    ),
    (
        "start_tooth_pinion",
        "int32",
        "1",
        "condition",
        "pinion tooth in mesh at the first sample",
    ),
    (
        "start_tooth_wheel",
        "int32",
        "1",
        "condition",
        "wheel tooth in mesh at the first sample",
    ),
    (
        "start_phase",
        "float64",
        "1",
        "condition",
        "mesh phase at the first sample, as a fraction of a base pitch",
    ),
    (
        "speed_rpm",
        "float64",
        "r/min",
        "result",
        "actual mean speed of the driving shaft",
    ),
    (
        "speed_set_rpm",
        "float64",
        "r/min",
        "condition",
        "speed set-point of the driving shaft",
    ),
    (
        "torque_nm",
        "float64",
        "N m",
        "condition",
        "torque set-point of the driving shaft, or of what `torque_of` says",
    ),
    (
        "mesh_frequency_hz",
        "float64",
        "Hz",
        "result",
        "mean tooth-mesh frequency of the faulted mesh, the first when healthy",
    ),
    (
        "snr_db",
        "float64",
        "dB",
        "noise",
        "signal-to-noise ratio asked for; NaN without noise",
    ),
    ("gearbox_id", "str64", "", "unit", "housing, transfer path and bearings"),
    ("specimen_id", "str64", "", "unit", "set of gears with its manufacturing errors"),
    ("unit_id", "str64", "", "unit", "one specimen in one gearbox"),
    (
        "condition_id",
        "str64",
        "",
        "condition",
        "one unit at one set-point; its records share one noise level",
    ),
    (
        "repeat",
        "int32",
        "1",
        "condition",
        "number among the records of the same condition_id and class, from 0",
    ),
    (
        "status",
        "str16",
        "",
        "result",
        "'ok' or 'failed'; a failed record keeps its parameters, its signals may be NaN",
    ),
    (
        "status_reason",
        "str256",
        "",
        "result",
        "why the record failed, cut to 256 bytes; empty when ok",
    ),
    (
        "integration_error",
        "float64",
        "1",
        "result",
        "relative error of the time integration; NaN where not measured",
    ),
    (
        "integration_check",
        "str16",
        "",
        "result",
        "'error': below its limit; 'levels': teeth bounce, third-octave levels agree within 0.5 "
        "dB and indicators within 5 %; 'unresolved'; 'none': not looked for; 'energy': a drive "
        "line's energy residual",
    ),
    (
        "contact_loss_fraction",
        "float64",
        "1",
        "result",
        "share of the time without tooth contact; NaN where not measured",
    ),
    (
        "detectability",
        "float64",
        "1",
        "fault",
        "d' of the best detector, which knows what the fault adds, in the record's noise; NaN "
        "where not asked for, and where the noise is not white over the whole band",
    ),
    (
        "clipped_fraction",
        "float64",
        "1",
        "result",
        "share of the samples of all channels outside the converter's range; 0 without one, NaN "
        "in a failed record",
    ),
    (
        "clipped",
        "int8",
        "1",
        "result",
        "1 where that is above sensing.sensor.max_clipped_fraction",
    ),
    (
        "dropped_fraction",
        "float64",
        "1",
        "noise",
        "share of the samples that were lost and filled in all channels; 0 where none can be, "
        "NaN in a failed record",
    ),
    (
        "life_id",
        "str64",
        "",
        "unit",
        "the life that the record is a snapshot of, one a unit (run to failure only)",
    ),
    (
        "life_time_h",
        "float64",
        "h",
        "age",
        "clock time since the machine was new, standstills included (likewise)",
    ),
    (
        "life_cycles",
        "float64",
        "1",
        "age",
        "turns of the driving shaft since the machine was new (likewise)",
    ),
    (
        "remaining_life_h",
        "float64",
        "h",
        "label",
        "clock time until the end of the life, a lower bound where life_failed is 0 (likewise)",
    ),
    (
        "life_failed",
        "int8",
        "1",
        "label",
        "1: the life ends in failure; 0: it is censored at the horizon (likewise)",
    ),
    (
        "life_growing",
        "int8",
        "1",
        "fault",
        "1 where the damage grows at this record's load, 0 where not (likewise)",
    ),
)

# Columns that only the snapshots of lives have.
LIFE_COLUMNS = (
    "life_id",
    "life_time_h",
    "life_cycles",
    "remaining_life_h",
    "life_failed",
    "life_growing",
)

SIGNALS: dict[str, Column] = {
    column.name: column
    for column in (
        Column(name="acceleration", dtype="float32", unit="m/s^2", role="result", axes=("channel", "sample"),
               description="what the sensors report, noise included"),
        Column(name="acceleration_clean", dtype="float32", unit="m/s^2", role="result", axes=("channel", "sample"),
               description="the same without noise, offset and converter (optional)"),
        Column(name="healthy_twin", dtype="float32", unit="m/s^2", role="result", axes=("channel", "sample"),
               description="acceleration of the same record without its faults, with noise of its own "
                   "(optional)"),
        Column(name="acceleration_source", dtype="float32", unit="m/s^2", role="result", axes=("source", "sample"),
               description="accelerations at the bearings, before path and sensor, by source_names "
                   "(optional)"),
        Column(name="acceleration_scale", dtype="float64", unit="m/s^2", role="result", axes=("channel",),
               description="value of one count of acceleration, NaN in a failed record (only where that "
                   "is int16)"),
        Column(name="acceleration_clean_scale", dtype="float64", unit="m/s^2", role="result", axes=("channel",),
               description="the same for acceleration_clean"),
        Column(name="healthy_twin_scale", dtype="float64", unit="m/s^2", role="result", axes=("channel",),
               description="the same for healthy_twin"),
        Column(name="tacho", dtype="float32", unit="1", role="result", axes=("sample",),
               description="tachometer: 1 in a pulse, 0 between, at an edge the share of the sample "
                   "(optional)"),
        Column(name="encoder_angle", dtype="float64", unit="rad", role="result", axes=("sample",),
               description="angle that the encoder reads, from its index mark on, errors included "
                   "(optional)"),
        Column(name="shaft_angle", dtype="float64", unit="rad", role="result", axes=("sample",),
               description="angle of the driving shaft (optional)"),
        Column(name="shaft_speed", dtype="float32", unit="rad/s", role="result", axes=("sample",),
               description="actual speed of the driving shaft, central difference of its angle "
                   "(optional)"),
        Column(name="torque_set", dtype="float32", unit="N m", role="condition", axes=("sample",),
               description="set torque over time, as torque_nm (optional)"),
        Column(name="mesh_pinion_tooth", dtype="int16", unit="1", role="fault", axes=("pair", "sample"),
               description="pinion tooth of each pair that carries load, from 0; -1 where it does not "
                   "(optional)"),
        Column(name="mesh_wheel_tooth", dtype="int16", unit="1", role="fault", axes=("pair", "sample"),
               description="the same of the wheel (optional)"),
        Column(name="mesh_load_share", dtype="float32", unit="1", role="fault", axes=("pair", "sample"),
               description="normal force of each pair over that of all (optional)"),
        Column(name="mesh_force", dtype="float32", unit="N", role="fault", axes=("sample",),
               description="normal force of all pairs, negative on the back flanks (optional)"),
        Column(name="contact_lost", dtype="int8", unit="1", role="fault", axes=("sample",),
               description="1 where no tooth touches another (optional)"),
        Column(name="fault_engaged", dtype="int8", unit="1", role="fault", axes=("sample",),
               description="1 where a faulty tooth carries load or stands on the path of contact "
                   "(optional)"),
        Column(name="fault_multihot", dtype="int8", unit="1", role="label", axes=("class",),
               description="1 for the record's class and those of a compound fault's parts, by "
                   "class_names (optional)"),
        Column(name="signal_power", dtype="float64", unit="(m/s^2)^2", role="result", axes=("channel",),
               description="mean square of the signal without noise, in the band of snr_db (optional)"),
        Column(name="noise_power", dtype="float64", unit="(m/s^2)^2", role="noise", axes=("channel",),
               description="mean square of the noise, in the band of snr_db (optional)"),
    )
}  # fmt: skip

# How time signals with a scale may be stored, and the column that holds the scale of each.
SAMPLE_TYPES = ("float32", "int16")
SCALES = {
    "acceleration": "acceleration_scale",
    "acceleration_clean": "acceleration_clean_scale",
    "healthy_twin": "healthy_twin_scale",
}

# What a reader of version 1 may rely on; this list never grows, so that adding a column is no new
# version.
REQUIRED = (
    "acceleration", "record_id", "label", "label_name", "severity", "gearbox_id", "specimen_id", "unit_id",
    "condition_id", "speed_rpm", "torque_nm", "status",
)  # fmt: skip
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


def kind_of(name: str) -> str | None:
    """The kind of values a named column holds.

    'str', 'int', 'float', or None for a name the schema does not know.
    """
    if name.startswith(f"{PARAMS}/"):
        return "float"
    column = COLUMNS.get(name)
    if column is None:
        return "int" if name in ("shard", "row") else None
    if column.is_text:
        return "str"
    return "int" if np.dtype(column.dtype).kind == "i" else "float"


def stored_reason(reason: str | float) -> str:
    """`status_reason` as far as a shard holds it."""
    return (
        str(reason)
        .encode("ascii", "backslashreplace")[: COLUMNS["status_reason"].n_bytes]
        .decode()
    )


def unit_in_file(column: Column, attributes: Mapping[str, Any]) -> str:
    """Unit of a column in a data set with these root attributes.

    Rotations among the channels are in rad/s^2.
    """
    units = (
        set(attributes.get("channel_units") or [ACCELERATION])
        if {"channel", "source"} & set(column.axes)
        else set()
    )
    if ACCELERATION not in column.unit or units <= {ACCELERATION}:
        return column.unit
    return (
        column.unit.replace(ACCELERATION, units.pop())
        if len(units) == 1
        else "by channel_units"
    )


def column_table() -> str:
    """The Markdown table of all data sets of a shard, as it stands in `docs/format.md`."""
    lines = [
        "| name | shape | type | unit | role | meaning |",
        "|---|---|---|---|---|---|",
    ]
    for column in (*SIGNALS.values(), *COLUMNS.values()):
        shape = ", ".join(("record", *column.axes))
        kind = f"ASCII, {column.n_bytes} bytes" if column.is_text else column.dtype
        if column.name in SCALES:
            kind = " or ".join(SAMPLE_TYPES)
        name = f"`{column.name}`" + (" *" if column.name in REQUIRED else "")
        lines.append(
            f"| {name} | ({shape}) | {kind} | {column.unit} | {column.role} | "
            f"{column.description} |"
        )
    lines.append(
        f"| `{PARAMS}/<name>` | (record) | float64 | in the name | | a drawn or swept value; NaN "
        "where it does not apply |"
    )
    return "\n".join(lines) + "\n"
