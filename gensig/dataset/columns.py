"""The columns of a shard with one row a record: names, types, units, roles and meaning."""

from dataclasses import dataclass

import numpy as np

from gensig.errors import DatasetError

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
        if self.is_text:
            return int(self.dtype[3:])
        return np.dtype(self.dtype).itemsize

    @property
    def storage_dtype(self) -> np.dtype:
        """Type of the HDF5 data set.

        Text is marked as ASCII, because Octave reads none that is marked as UTF-8.
        """
        if self.is_text:
            return np.dtype(f"S{self.n_bytes}")
        return np.dtype(self.dtype).newbyteorder("<")

    @property
    def is_bulk(self) -> bool:
        """True for time signals, which are chunked by record and never read as a column."""
        return "sample" in self.axes


def columns_of_axes(
    axes: str, *rows: tuple[str, str, str, str, str]
) -> dict[str, Column]:
    """Columns of the same axes by name, from rows of name, type, unit, role and description."""
    columns: dict[str, Column] = {}
    for name, dtype, unit, role, text in rows:
        columns[name] = Column(
            name=name,
            dtype=dtype,
            unit=unit,
            role=role,
            description=text,
            axes=tuple(axes.split()),
        )
    return columns


COLUMNS = columns_of_axes(
    "",
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
    ("unit_id", "str64", "", "unit", "one set of gears in one gearbox"),
    (
        "condition_id",
        "str64",
        "",
        "condition",
        "one machine at one set-point; its records share one noise level",
    ),
    (
        "repeat",
        "int32",
        "1",
        "condition",
        "number among the records of the same condition_id and class, from 0",
    ),
    (
        "is_reference",
        "int8",
        "1",
        "id",
        "1: a healthy record for comparison, no example and in no split; 0: an example (only where "
        "plan.n_reference is above 0)",
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
        "the life that the record is a snapshot of, one a machine (run to failure only)",
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
    (
        "n_teeth_pinion",
        "int32",
        "1",
        "unit",
        "teeth of the pinion (only where machines differ in their gears; else a root attribute)",
    ),
    ("n_teeth_wheel", "int32", "1", "unit", "teeth of the wheel (likewise)"),
    ("normal_module_mm", "float64", "mm", "unit", "normal module (likewise)"),
    (
        "pressure_angle_deg",
        "float64",
        "deg",
        "unit",
        "pressure angle of the basic rack (likewise)",
    ),
    (
        "helix_angle_deg",
        "float64",
        "deg",
        "unit",
        "helix angle of the pinion (likewise)",
    ),
    (
        "face_width_pinion_mm",
        "float64",
        "mm",
        "unit",
        "face width of the pinion (likewise)",
    ),
    (
        "face_width_wheel_mm",
        "float64",
        "mm",
        "unit",
        "face width of the wheel (likewise)",
    ),
    ("center_distance_mm", "float64", "mm", "unit", "centre distance (likewise)"),
    (
        "transverse_contact_ratio",
        "float64",
        "1",
        "unit",
        "transverse contact ratio (likewise)",
    ),
    ("overlap_ratio", "float64", "1", "unit", "overlap ratio (likewise)"),
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
# Root attributes of drive lines: names of all gears, their teeth, and the turns of the pinion
# during one turn of each.
GEAR_NAMES, GEAR_TEETH = "gear_names", "gear_teeth"
GEAR_PINION_TURNS = "gear_pinion_turns"
# Type of the column fault_gear in such sets, whose gears have names of their tables.
LINE_FAULT_GEAR = "str64"
# Columns that only sets of version 2 have, whose units differ in their gears.
GEAR_COLUMNS = (
    "n_teeth_pinion",
    "n_teeth_wheel",
    "normal_module_mm",
    "pressure_angle_deg",
    "helix_angle_deg",
    "face_width_pinion_mm",
    "face_width_wheel_mm",
    "center_distance_mm",
    "transverse_contact_ratio",
    "overlap_ratio",
)
# Column that only sets with reference records have.
IS_REFERENCE = "is_reference"
