"""A recording over the angle of the input shaft, by tachometer or by the mesh of any stage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnose.data.tracking import Tracked, track_by_tacho
from diagnose.detection.gear_stages import GearStages
from diagnose.detection.stage_comb import Candidate, SpeedSearch, search_speed
from diagnose.recordings.source import Source, read_source
from gensig.errors import ConfigError, TooShortError
from gensig.signals.averaging import samples_per_turn_for
from gensig.signals.mesh_motion import Teeth, find_motion, in_hertz
from gensig.signals.recording import Recording, recording_of
from gensig.signals.resampling import PASS_SHARE
from gensig.signals.rotation import resample_by_angle
from gensig.signals.speed_ridge import wandering_mesh_cycles

FloatArray = NDArray[np.floating]

LEAST_RATE = 5000.0  # Hz, as documented: below it few harmonics of a mesh are left
LEAST_TURNS = 4.0  # of the slowest shaft: its sidebands are resolved from the mesh
LEAST_DECADES = 2.5  # of the lines of all stages; noise reaches 0.7
AMBIGUOUS = 0.7  # share of the best candidate's decades that another one must not reach
# a mesh elsewhere counts where it has so many decades, and the stated one less than this share;
# half the true speed has all its lines, and up to 0.97 of its decades
LEAST_ELSEWHERE, NEAR_SHARE = 6.0, 0.5
FINER = 2  # upsampling before the interpolation to angle
OPTIONS = "--teeth, --speed-rpm and --sampling-rate"


@dataclass(frozen=True, slots=True, kw_only=True)
class FollowedRecording:
    """Signals over the angle of the input shaft.

    Attributes
    ----------
    name : of the recording, for messages
    sensors : names of the channels
    signal : (channel, sample) m/s2, evenly sampled in angle, whole turns of the input shaft
    samples_per_turn : of the input shaft
    speed_rpm : r/min of the input shaft, mean
    sampling_rate : Hz, as recorded
    by : "tacho", or the stage whose mesh was followed
    """

    name: str
    sensors: tuple[str, ...]
    signal: FloatArray
    samples_per_turn: int
    speed_rpm: float
    sampling_rate: float
    by: str

    @property
    def n_turns(self) -> float:
        """Turns of the input shaft."""
        return self.signal.shape[-1] / self.samples_per_turn


@dataclass(frozen=True, slots=True, kw_only=True)
class Tacho:
    """Pulses of the input shaft beside a recording.

    Attributes
    ----------
    name : of the channel
    signal : (sample,)
    pulses_per_turn : of the input shaft
    """

    name: str
    signal: FloatArray
    pulses_per_turn: int = 1


def follow_shafts(
    recording: Recording,
    stages: GearStages,
    speed_rpm: float | None,
    *,
    name: str,
    tacho: Tacho | None = None,
) -> FollowedRecording:
    """Follow the input shaft of a recording.

    Parameters
    ----------
    speed_rpm : r/min    of the input shaft, within `stage_comb.NEAR`; not needed with a tacho
    name : of the recording, for messages

    Raises
    ------
    TooShortError    for fewer than `LEAST_TURNS` turns of the slowest shaft
    ConfigError    for a rate below `LEAST_RATE`, and where no mesh, another one, or several
        are found
    """
    rate = recording.sampling_rate
    if rate < LEAST_RATE:
        raise ConfigError(
            f"{name}: {rate:g} samples a second; at least {LEAST_RATE:g} are needed"
        )
    if tacho is not None:
        tracked = track_by_tacho(
            recording, tacho.signal, tacho.name, pulses_per_turn=tacho.pulses_per_turn
        )
        followed = _of_tacho(recording, tracked, name)
        speed = followed.speed_rpm
        check_turns(followed.n_turns * 60.0 / speed, speed, stages, name)
        return followed
    if speed_rpm is None or not speed_rpm > 0.0:
        raise ConfigError(
            f"{name}: the speed must be known within 3 %: give --speed-rpm, or --tacho"
        )
    check_turns(recording.duration, speed_rpm, stages, name)
    search = search_speed(recording.acceleration, rate, stages, speed_rpm)
    _check_place(search, stages, speed_rpm, name)
    stage, cycles = _followed_cycles(recording, stages, speed_rpm, search, name)
    turned = cycles / stages.mesh_orders[stage]
    by = f"the mesh of stage {stage + 1}" if stages.n_stages > 1 else "the mesh"
    return _over_angle(recording, turned, name, by)


def follow_file(source: Source, stages: GearStages) -> FollowedRecording:
    """Read a recording and follow its input shaft.

    Raises
    ------
    ConfigError    for a file that cannot be used, and as `follow_shafts`
    """
    content, pulses = read_source(source)
    recording = recording_of(content, unit=source.unit, channels=source.channels)
    tacho = None
    if pulses is not None and source.tacho is not None:
        tacho = Tacho(
            name=source.tacho, signal=pulses, pulses_per_turn=source.pulses_per_turn
        )
    return follow_shafts(
        recording, stages, source.speed_rpm, name=source.file, tacho=tacho
    )


def check_turns(
    duration: float, speed_rpm: float, stages: GearStages, name: str
) -> None:
    """Refuse a recording of fewer turns of the slowest shaft than are needed.

    Parameters
    ----------
    duration : s
    speed_rpm : r/min    of the input shaft

    Raises
    ------
    TooShortError    with the turns that there are and the duration needed
    """
    per_turn = 60.0 / (speed_rpm * stages.slowest)
    turns = duration / per_turn
    if turns < LEAST_TURNS * 0.97:  # the stated speed is known within 3 %
        raise TooShortError(
            f"{name} is too short: {duration:.3g} s are {turns:.2g} turns of the slowest shaft, at "
            f"least {LEAST_TURNS:g} are needed; record {LEAST_TURNS * per_turn:.3g} s or longer"
            f"{in_hertz(speed_rpm)}"
        )


def _check_place(
    search: SpeedSearch, stages: GearStages, speed_rpm: float, name: str
) -> None:
    """Refuse several speeds near the stated one, and a mesh that stands elsewhere."""
    best, *others = search.near
    said = f"--teeth {stages.said} at {speed_rpm:g} r/min"
    far = search.elsewhere
    if (
        far is not None
        and far.decades >= LEAST_ELSEWHERE
        and best.decades < NEAR_SHARE * far.decades
    ):
        raise ConfigError(
            f"{name}: no mesh of {said}, but one as of {far.speed_rpm:.5g} r/min with these "
            f"teeth: another machine or speed? check {OPTIONS}"
        )
    rivals = [other for other in others if other.decades >= AMBIGUOUS * best.decades]
    if rivals and best.decades >= LEAST_DECADES:
        speeds = ", ".join(f"{one.speed_rpm:.5g}" for one in (best, *rivals))
        raise ConfigError(
            f"{name}: the mesh of {said} fits several speeds alike, {speeds} r/min: record longer, "
            "say --speed-rpm more exactly, or give --tacho"
        )


def _followed_cycles(
    recording: Recording,
    stages: GearStages,
    speed_rpm: float,
    search: SpeedSearch,
    name: str,
) -> tuple[int, FloatArray]:
    """Stage that was followed and its mesh cycles at every sample, (sample,)."""
    best: Candidate = search.near[0]
    order = np.argsort(best.by_stage)[::-1]
    highest = PASS_SHARE * recording.sampling_rate
    is_steady = best.decades >= LEAST_DECADES
    for stage in map(int, order):
        driving, driven = stages.pairs[stage]
        teeth = Teeth(driving=driving, driven=driven)
        ratio = stages.shaft_orders[stage]
        try:
            if is_steady:
                motion = find_motion(
                    recording,
                    teeth,
                    best.speed_rpm * ratio,
                    highest=highest,
                    options=OPTIONS,
                    least_turns=0.9 * LEAST_TURNS,
                    search=min(2.0 * search.width, 0.01),
                )
                return stage, motion.cycles
            cycles = wandering_mesh_cycles(
                recording,
                teeth,
                speed_rpm * ratio,
                highest=highest,
                options=OPTIONS,
                longer="record longer",
            )
        except ConfigError:
            continue
        return stage, cycles
    meshes = ", ".join(f"{o * speed_rpm / 60.0:.4g}" for o in stages.mesh_orders)
    raise ConfigError(
        f"{name}: no mesh found near {meshes} Hz, where --teeth {stages.said} at {speed_rpm:g} "
        f"r/min put it: another machine or speed? check {OPTIONS}{in_hertz(speed_rpm)}"
    )


def _over_angle(
    recording: Recording, turned: FloatArray, name: str, by: str
) -> FollowedRecording:
    """A recording over the angle of the input shaft, whose turns at every sample are known."""
    from scipy.signal import resample_poly

    rate = recording.sampling_rate
    sample = np.arange(turned.size)
    fine_sample = np.arange(FINER * (turned.size - 1) + 1) / FINER
    fine = np.interp(fine_sample, sample, turned)
    signal = resample_poly(recording.acceleration, FINER, 1, axis=-1)
    frequency = float((turned[-1] - turned[0]) / (turned.size - 1) * rate)
    per_turn = samples_per_turn_for(rate, frequency)
    turns = resample_by_angle(signal[:, : fine.size], 2.0 * np.pi * fine, per_turn)
    return FollowedRecording(
        name=name,
        sensors=recording.sensors,
        signal=turns.reshape(turns.shape[0], -1),
        samples_per_turn=per_turn,
        speed_rpm=60.0 * frequency,
        sampling_rate=rate,
        by=by,
    )


def _of_tacho(recording: Recording, tracked: Tracked, name: str) -> FollowedRecording:
    """A recording that a tachometer has put over the angle."""
    return FollowedRecording(
        name=name,
        sensors=recording.sensors,
        signal=tracked.signal,
        samples_per_turn=tracked.samples_per_turn,
        speed_rpm=tracked.speed_rpm,
        sampling_rate=recording.sampling_rate,
        by="tacho",
    )
