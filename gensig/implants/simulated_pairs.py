"""Records of a simulated set with their healthy twins, as sources of residuals."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gensig.arrays import Array, Flags, Integers
from gensig.dataset.columns import GEAR_PINION_TURNS
from gensig.errors import DatasetError
from gensig.implants.gearing import DRIVEN, DRIVING

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset


HEALTHY, ONE_TOOTH, MANY_TEETH = "healthy", "one_tooth", "many_teeth"
CLASSES = (HEALTHY, ONE_TOOTH, MANY_TEETH)
TWIN = "healthy_twin"
# errors of form, of a gear that is made so: no damage of teeth
FORMS = ("pitch_error", "profile_error", "runout", "misalignment", "tip_relief")
ALL_TEETH = "all"
MAKE_ONE = "gensig generate ... sensing.snr_db=null dataset.store_healthy_twin=true"
# of the twin's RMS: below, a residual is the rounding of stored samples
LEAST_RESIDUAL = {"float32": 1e-6, "int16": 1e-3}


def class_of(faults: str) -> str | None:
    """Class of a record by the teeth that its faults are on; None for errors of form alone.

    Parameters
    ----------
    faults : the column ``faults_json``

    Returns
    -------
    "healthy" without a fault, "one_tooth" where all damage is on one tooth of one gear,
    "many_teeth" for more
    """
    parts = json.loads(faults)
    if not parts:
        return HEALTHY
    teeth: set[tuple[str, int]] = set()
    for part in parts:
        if part["kind"] in FORMS:
            continue
        tooth = part.get("tooth", ALL_TEETH)
        if isinstance(tooth, int):
            tooth = [tooth]
        if not isinstance(tooth, list):
            return MANY_TEETH
        teeth |= {(str(part.get("gear")), int(each)) for each in tooth}
    if not teeth:
        return None
    return ONE_TOOTH if len(teeth) == 1 else MANY_TEETH


class SimulatedPairs:
    """Records of a data set less their healthy twins.

    Parameters
    ----------
    data : open data set, with noise-free records and twins

    Attributes
    ----------
    label : (record,) number of the class in `CLASSES`; -1 for a record that is no source
    group : (record,) number of the set of gears
    channels : numbers of the channels that are accelerations along a line

    Raises
    ------
    DatasetError    with one line, for a set without twins, with noise, of one class, or whose
        classes are no damage
    """

    def __init__(self, data: Dataset) -> None:
        self.data = data
        _check(data)
        units = data.attributes.get("channel_units")
        n_channels = len(data.channel_names)
        units = units or ["m/s^2"] * n_channels
        self.channels = [k for k in range(n_channels) if units[k] == "m/s^2"]
        if not self.channels:
            raise DatasetError(
                f"{data.folder}: none of its channels is an acceleration in m/s^2; make a set with "
                "sensing=bearing or sensing=housing"
            )
        self.label = self._labels()
        specimens = data.column("specimen_id")
        self.group = np.unique(specimens, return_inverse=True)[1].astype(np.int64)

    def signal(self, record: int, channels: Sequence[int], *, name: str) -> Array:
        """Stored signal of a record, (channel, sample) m/s^2."""
        return self.data.signals(record, channels=channels, name=name).astype(float)

    def residual(self, record: int, channels: Sequence[int]) -> Array:
        """Record less its healthy twin, (channel, sample) m/s^2."""
        faulty = self.signal(record, channels, name="acceleration")
        return faulty - self.signal(record, channels, name=TWIN)

    def fault_gear(self, record: int) -> str:
        """Gear with the (first) fault; the empty text for a healthy record."""
        return str(self.data.column("fault_gear")[record])

    def role(self, gear: str) -> str:
        """'pinion' for a driving, 'wheel' for a driven gear; the empty text where not known."""
        if gear in (DRIVING, DRIVEN):
            return gear
        return ""

    def turned(self, record: int, gear: str) -> Array:
        """Turns of a gear since the first sample, (sample,)."""
        n_samples, rate = self.data.n_samples, self.data.sampling_rate
        if "shaft_angle" in self.data.signal_names:
            angle = np.asarray(self.data.trace(record, "shaft_angle"), dtype=float)
            driving = (angle - angle[0]) / (2.0 * np.pi)
        else:
            speed = float(self.data.column("speed_rpm")[record]) / 60.0
            driving = speed * np.arange(n_samples) / rate
        return driving * self._ratio(record, gear)

    def _ratio(self, record: int, gear: str) -> float:
        """Turns of a gear during one turn of the driving shaft."""
        data = self.data
        if gear in data.gear_names and GEAR_PINION_TURNS in data.attributes:
            turns = data.attributes[GEAR_PINION_TURNS][data.gear_names.index(gear)]
            return 1.0 / float(turns)
        if gear != DRIVEN:
            return 1.0
        pinion, wheel = data.n_teeth(DRIVING)[record], data.n_teeth(DRIVEN)[record]
        return float(pinion / wheel)

    def _labels(self) -> Integers:
        data, classes, unknown = self.data, dict[str, int](), set[str]()
        for faults in np.unique(data.column("faults_json")).tolist():
            name = class_of(faults)
            classes[faults] = -1 if name is None else CLASSES.index(name)
        label = np.array([classes[faults] for faults in data.column("faults_json")])
        unknown = set(data.column("label_name")[label < 0].tolist())
        if unknown:
            raise DatasetError(
                f"{data.folder}: {', '.join(sorted(unknown))} is no damage of one tooth or of "
                "many; leave it out of plan.classes"
            )
        label[~data.usable] = -1
        faulty = np.flatnonzero(label > 0)
        label[faulty[~self._is_heard(faulty)]] = -1
        if not np.any(label > 0):
            raise DatasetError(
                f"{data.folder}: no record differs from its healthy twin; give a set with faults"
            )
        return label.astype(np.int64)

    def _is_heard(self, records: Integers) -> Flags:
        """Records whose residual is more than the rounding of stored samples, (record,)."""
        least = LEAST_RESIDUAL.get(self.data.sample_type, 1e-6)
        heard = np.zeros(len(records), dtype=bool)
        for row, record in enumerate(records.tolist()):
            twin = self.signal(record, self.channels, name=TWIN)
            rest = self.residual(record, self.channels)
            heard[row] = bool(np.all(rest.std(axis=1) > least * twin.std(axis=1)))
        return heard


def _check(data: Dataset) -> None:
    """Refuse a set without twins, labels of teeth, or with noise."""
    if TWIN not in data.signal_names:
        raise DatasetError(
            f"{data.folder} stores no healthy twins; make a set with {MAKE_ONE}"
        )
    for name in ("faults_json", "fault_gear"):
        if name not in data.column_names:
            raise DatasetError(
                f"{data.folder} has no column {name}; make a set with {MAKE_ONE}"
            )
    usable = data.usable
    is_noisy = (
        np.isfinite(data.column("snr_db")) if "snr_db" in data.column_names else ~usable
    )
    if "noise_power" in data.column_names:
        is_noisy = np.any(data.column("noise_power") > 0.0, axis=-1)
    if np.any(is_noisy & usable):
        raise DatasetError(
            f"{data.folder}: its records have noise, and their twins another, which would be "
            f"implanted; make a set with {MAKE_ONE}"
        )
