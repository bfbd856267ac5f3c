"""Implants: healthy recordings of a machine plus residuals of simulated faults, with labels.

A residual is a simulated record less its healthy twin: what the fault alone adds. It is played by
the carrier's shaft, so that it turns with it, wanders with its speed, and gets the level that was
drawn. A healthy implant carries the difference of two healthy records in the same way.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Array, Integers
from gensig.errors import DatasetError
from gensig.implants.blocks import Block, Cut, cut_blocks
from gensig.implants.carrier_path import (
    carrier_lines,
    path_response,
    through,
)
from gensig.implants.carriers import (
    Carrier,
    HealthyRecording,
    follow_all,
    healthy_recording,
    read_healthy,
)
from gensig.implants.controls import noise_bursts, shuffled
from gensig.implants.gearing import Gearing
from gensig.implants.implant_plan import (
    RECORD_STREAM,
    Draw,
    ImplantPlan,
    make_implant_plan,
    random_stream,
)
from gensig.implants.options import ImplantOptions
from gensig.implants.simulated_pairs import HEALTHY, TWIN, SimulatedPairs
from gensig.implants.stretching import Played, samples_a_turn
from gensig.signals.recording import Recording
from gensig.signals.resampling import PASS_SHARE
from gensig.signals.transfer.order_lines import Lines

if TYPE_CHECKING:
    from gensig.dataset.reader import Dataset

Given = str | Path | Recording | HealthyRecording


@dataclass(frozen=True, slots=True, kw_only=True)
class Implants:
    """Implants in memory.

    Attributes
    ----------
    acceleration : (record, channel, sample) float32, m/s^2
    label : (record,) index into `class_names`
    class_names : classes of which there are records
    gain_db : (record,) dB    level of the residual over the carrier's; NaN where there is none
    block : (record,) number of the block that carries
    blocks : all blocks, those held out among them
    draws : everything drawn for each record
    sampling_rate : Hz
    channel_names : as in the recordings
    """

    acceleration: NDArray[np.float32]
    label: Integers
    class_names: tuple[str, ...]
    gain_db: Array
    block: Integers
    blocks: tuple[Block, ...]
    draws: tuple[Draw, ...]
    sampling_rate: float
    channel_names: tuple[str, ...]


class Implanter:
    """Records of a set of implants, each made when it is asked for.

    Parameters
    ----------
    data : open data set of noise-free records with healthy twins
    recordings : healthy recordings of one machine
    gearing : its gears
    speed_rpm : r/min of its driving shaft: one, or one a recording
    options : choices

    Attributes
    ----------
    pairs : of the simulated set
    carriers : recordings with the angle of the driving shaft
    cut : blocks, and samples of a record
    plan : of all records

    Raises
    ------
    ConfigError, DatasetError    with one line, for what cannot be used
    """

    def __init__(
        self,
        data: Dataset,
        recordings: Sequence[HealthyRecording],
        gearing: Gearing,
        speed_rpm: Sequence[float],
        options: ImplantOptions,
        *,
        pulses_per_turn: int = 1,
    ) -> None:
        self.gearing, self.options = gearing, options
        self.pairs = SimulatedPairs(data)
        self.carriers: list[Carrier] = follow_all(
            recordings, gearing, speed_rpm, pulses_per_turn=pulses_per_turn
        )
        self.cut: Cut = cut_blocks(
            self.carriers, gearing, duration=options.duration, held_out=options.held_out
        )
        self.plan: ImplantPlan = make_implant_plan(
            self.pairs, self.carriers, gearing, self.cut, options
        )
        self._measured: dict[int, Lines] = {}

    def record(self, index: int) -> NDArray[np.float32]:
        """One record, (channel, sample) m/s^2; it depends on nothing but the plan."""
        draw = self.plan.draws[index]
        carrier = self.stretch(index)
        if np.isnan(draw.gain_db):
            return carrier.astype(np.float32)
        rng = random_stream(self.options.seed, RECORD_STREAM, index)
        residual = self._residual(draw, rng)
        return (carrier + self._at_level(residual, carrier, draw)).astype(np.float32)

    def stretch(self, index: int) -> Array:
        """Samples of the carrier under one record, (channel, sample) m/s^2."""
        draw = self.plan.draws[index]
        samples = slice(draw.start, draw.start + self.cut.n_samples)
        return self.carriers[draw.block.recording].recording.acceleration[:, samples]

    def speed_rpm(self, index: int) -> float:
        """Mean speed of the driving shaft in one record, r/min."""
        draw = self.plan.draws[index]
        carrier = self.carriers[draw.block.recording]
        return carrier.speed_rpm(draw.start, draw.start + self.cut.n_samples)

    def records(self) -> Iterator[NDArray[np.float32]]:
        """All records in turn."""
        for index in range(len(self.plan.draws)):
            yield self.record(index)

    def _turns(self, draw: Draw) -> Array:
        """Turns of the gear under the implant since the begin of the record, (sample,)."""
        carrier = self.carriers[draw.block.recording]
        turned = carrier.turned[draw.start : draw.start + self.cut.n_samples]
        return (turned - turned[0]) * self.gearing.turns(draw.gear)

    def _residual(self, draw: Draw, rng: np.random.Generator) -> Array:
        """The residual of one record before its level is set, (channel, sample)."""
        carrier, turns = self.carriers[draw.block.recording], self._turns(draw)
        rate = carrier.recording.sampling_rate
        n_channels = len(carrier.recording.sensors)
        if self.options.residual == "noise_bursts":
            return noise_bursts(draw.name, turns, rate, n_channels, rng)
        if draw.name == HEALTHY:
            first = self._played(draw.source, draw, turns, draw.shift, TWIN)
            residual = first - self._played(
                draw.second, draw, turns, draw.second_shift, TWIN
            )
        else:
            residual = self._played(draw.source, draw, turns, draw.shift, "residual")
        if self.options.path == "twin":
            residual = through(residual, self._response(draw, carrier, turns))
        if self.options.residual == "shuffled_phases":
            residual = shuffled(residual, rng)
        return residual - residual.mean(axis=-1, keepdims=True)

    def _channels(self, draw: Draw) -> list[int]:
        """Simulated channels for those of the carrier, in turn from the one drawn."""
        known = self.pairs.channels
        first = known.index(draw.channel)
        n_channels = len(self.carriers[0].recording.sensors)
        return [known[(first + k) % len(known)] for k in range(n_channels)]

    def _played(
        self, record: int, draw: Draw, turns: Array, shift: float, name: str
    ) -> Array:
        """A signal of a simulated record, as the carrier's shaft plays it, (channel, sample)."""
        channels = self._channels(draw)
        if name == "residual":
            signal = self.pairs.residual(record, channels)
        else:
            signal = self.pairs.signal(record, channels, name=name)
        turned = self.pairs.turned(record, draw.source_gear)
        played = Played(signal, turned, samples_a_turn(turns))
        return played.at(turns + shift * played.n_turns)

    def _response(self, draw: Draw, carrier: Carrier, turns: Array) -> Array:
        """Impulse responses from the simulated sensors to the carrier's."""
        number = draw.block.recording
        if number not in self._measured:
            blocks = [each for each in self.cut.carrying if each.recording == number]
            stop = max(each.stop for each in blocks)
            self._measured[number] = carrier_lines(carrier, stop, self.gearing)
        sound = self._played(draw.source, draw, turns, draw.shift, TWIN)
        turned = self.pairs.turned(draw.source, draw.source_gear)
        ratio = samples_a_turn(turned) / samples_a_turn(turns)
        highest = PASS_SHARE * carrier.recording.sampling_rate * ratio
        return path_response(self._measured[number], sound, carrier, highest=highest)

    def _at_level(self, residual: Array, carrier: Array, draw: Draw) -> Array:
        """The residual at its level over the carrier's RMS.

        Without a path every channel has that level; behind one the mean square over channels has.
        """
        level = _rms(residual) / _rms(carrier)
        if not np.all(level > 0.0):
            raise DatasetError(
                f"record {self.pairs.data.column('record_id')[draw.source]} of "
                f"{self.pairs.data.folder} adds nothing to the carrier in the band of both; "
                "give a set of a higher sampling rate or speed"
            )
        if self.options.path == "twin" and self.options.residual != "noise_bursts":
            level = np.sqrt(np.mean(np.square(level), axis=0, keepdims=True))
        return 10.0 ** (draw.gain_db / 20.0) / level * residual


def _rms(signal: Array) -> Array:
    """RMS of each channel, (channel, 1)."""
    return np.asarray(np.sqrt(np.mean(np.square(signal), axis=-1, keepdims=True)))


def taken_recordings(
    recordings: Sequence[Given],
    *,
    sampling_rate: float | None = None,
    channels: Sequence[str] | None = None,
    unit: str = "m/s2",
    array: str | None = None,
    tacho: str | None = None,
) -> list[HealthyRecording]:
    """Healthy recordings of files, or as they were loaded elsewhere.

    Parameters
    ----------
    recordings : files, or recordings, which are named by their number
    sampling_rate, channels, unit, array, tacho : of files, see `read_healthy`
    """
    taken = []
    for number, given in enumerate(recordings):
        if isinstance(given, HealthyRecording):
            taken.append(given)
        elif isinstance(given, Recording):
            taken.append(healthy_recording(given, f"recording_{number}"))
        else:
            healthy = read_healthy(
                str(given),
                rate=sampling_rate,
                channels=channels,
                unit=unit,
                array=array,
                tacho=tacho,
            )
            taken.append(healthy)
    return taken


def speeds_of(speed_rpm: float | Sequence[float]) -> list[float]:
    """One speed, or those of several recordings, as a list, r/min."""
    if isinstance(speed_rpm, Sequence):
        return [float(speed) for speed in speed_rpm]
    return [float(speed_rpm)]


def implant_records(
    data: Dataset,
    recordings: Sequence[Given],
    *,
    teeth: Sequence[int],
    speed_rpm: float | Sequence[float],
    options: ImplantOptions | None = None,
) -> Implants:
    """Implants in memory, of files or of recordings that were loaded elsewhere.

    Parameters
    ----------
    data : open data set of noise-free records with healthy twins (``sensing.snr_db=null
        dataset.store_healthy_twin=true``)
    recordings : healthy recordings of one machine, with the same channels and rate
    teeth : driving and driven gear of each stage in turn
    speed_rpm : r/min of the driving shaft, within 3 %: one, or one a recording
    options : None takes the defaults

    Returns
    -------
    Implants

    Raises
    ------
    ConfigError    for recordings that differ, are too short, or show no mesh near the speed
    DatasetError    for a data set without twins, with noise, or of classes that are no damage
    """
    implanter = Implanter(
        data,
        taken_recordings(recordings),
        Gearing(teeth=tuple(teeth)),
        speeds_of(speed_rpm),
        options or ImplantOptions(),
    )
    draws, first = implanter.plan.draws, implanter.carriers[0].recording
    names = implanter.plan.class_names
    return Implants(
        acceleration=np.stack(list(implanter.records())),
        label=np.array([names.index(draw.name) for draw in draws]),
        class_names=names,
        gain_db=np.array([draw.gain_db for draw in draws]),
        block=np.array([draw.block.number for draw in draws]),
        blocks=implanter.cut.blocks,
        draws=draws,
        sampling_rate=first.sampling_rate,
        channel_names=first.sensors,
    )
