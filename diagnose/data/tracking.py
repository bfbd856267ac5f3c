"""Order tracking: a recording as it would be at constant speed, by tachometer or by mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from diagnose.data.windows import FloatArray
from gensig.errors import ConfigError
from gensig.signals.mesh_motion import Teeth
from gensig.signals.recording import Recording
from gensig.signals.resampling import PASS_SHARE, rate_change
from gensig.signals.rotation import resample_by_angle
from gensig.signals.speed_ridge import wandering_mesh_cycles
from gensig.signals.tacho import pulse_times, resample_by_pulses, speed_of_pulses

FINER = 2  # upsampling before the interpolation to angle, whose error grows towards half the rate
MOST_JUMP = 1.5  # from one interval between pulses to the next; a lost or false pulse makes it 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Tracked:
    """Signals over the angle of the driving shaft.

    Attributes
    ----------
    by : "tacho" or "mesh"
    signal : (channel, sample) m/s2, evenly sampled in angle, whole turns
    samples_per_turn : of `signal`
    speed_rpm : r/min, mean over the turns
    speed_range_rpm : least and greatest mean speed of a turn, r/min
    """

    by: str
    signal: FloatArray
    samples_per_turn: int
    speed_rpm: float
    speed_range_rpm: tuple[float, float]


def track_by_tacho(
    recording: Recording, tacho: FloatArray, name: str, *, pulses_per_turn: int
) -> Tracked:
    """Track the pulses of a tachometer on the driving shaft, from the first to the last pulse.

    Parameters
    ----------
    tacho : (sample,)    as recorded with the accelerations
    name : of the tachometer's channel

    Raises
    ------
    ConfigError    for pulses that span no two turns or are not even enough to be those of a shaft
    """
    rate = recording.sampling_rate
    if not np.all(np.isfinite(tacho)):
        wrong = int(np.argmin(np.isfinite(tacho)))
        raise ConfigError(f"--tacho {name}: sample {wrong} is no finite number")
    times = pulse_times(tacho, rate)
    if len(times) < 2 * pulses_per_turn + 1:
        raise ConfigError(
            f"--tacho {name}: {len(times)} pulses at {pulses_per_turn} a turn "
            "span no two turns; check channel and --pulses-per-turn, or leave --tacho out"
        )
    between = np.diff(times)
    jump = np.maximum(between[1:] / between[:-1], between[:-1] / between[1:])
    if jump.max() > MOST_JUMP:
        instant = times[1 + int(jump.argmax())]
        raise ConfigError(
            f"--tacho {name}: at {instant:.4g} s the time between pulses "
            f"jumps by {jump.max():.3g}, a pulse too few or too many; "
            "mend the channel, or leave --tacho out"
        )
    turns = resample_by_pulses(
        _finer(recording), FINER * rate, times, pulses_per_turn=pulses_per_turn
    )
    n_turns = turns.shape[-2]
    speed = 60.0 * speed_of_pulses(times[::pulses_per_turn])[1]
    mean = 60.0 * n_turns / (times[n_turns * pulses_per_turn] - times[0])
    return _tracked("tacho", turns, float(mean), speed)


def track_by_mesh(recording: Recording, teeth: Teeth, speed_rpm: float) -> Tracked:
    """Track the harmonics of the mesh.

    The speed must stay within 3 % of the stated one and change slowly, over many turns.

    Raises
    ------
    ConfigError    where the recording is too short or there is no sign of the mesh
    """
    rate = recording.sampling_rate
    cycles = wandering_mesh_cycles(
        recording,
        teeth,
        speed_rpm,
        highest=PASS_SHARE * rate,
        options="--teeth, --speed-rpm and --sampling-rate",
        longer="record longer, or give --as-recorded",
    )
    turned = cycles / teeth.driving
    sample = np.arange(turned.size)
    fine_sample = np.arange(FINER * (turned.size - 1) + 1) / FINER
    fine = np.interp(fine_sample, sample, turned)
    turns = resample_by_angle(_finer(recording)[:, : fine.size], 2.0 * np.pi * fine)
    passed = np.interp(np.arange(turns.shape[-2] + 1), turned, sample / rate)
    mean = 60.0 * turned[-1] / (turned.size - 1) * rate
    return _tracked("mesh", turns, float(mean), 60.0 / np.diff(passed))


@dataclass(frozen=True, slots=True, kw_only=True)
class ConstantSpeed:
    """Signal that the machine would give at constant speed, if it held the gears' orders alone.

    Attributes
    ----------
    signal : (channel, sample) m/s2
    speed_rpm : r/min, exact. Rates change by ratios of whole numbers, so that it is up to 0.05 %
        from the one that was asked for: half a tooth in a second
    """

    signal: FloatArray
    speed_rpm: float


def at_constant_speed(
    tracked: Tracked, sampling_rate: float, speed_rpm: float
) -> ConstantSpeed:
    """The tracked recording, played at a constant speed.

    Parameters
    ----------
    sampling_rate : Hz     of the signal made
    speed_rpm : r/min      wanted; all frequencies are scaled by its ratio to the true one, those
        of resonances too
    """
    change = rate_change(tracked.samples_per_turn, sampling_rate * 60.0 / speed_rpm)
    per_turn = tracked.samples_per_turn * change.ratio
    return ConstantSpeed(
        signal=change.apply(tracked.signal), speed_rpm=sampling_rate * 60.0 / per_turn
    )


def _finer(recording: Recording) -> FloatArray:
    from scipy.signal import resample_poly

    return resample_poly(recording.acceleration, FINER, 1, axis=-1)


def _tracked(
    by: str, turns: FloatArray, mean_rpm: float, turn_rpm: FloatArray
) -> Tracked:
    return Tracked(
        by=by,
        signal=turns.reshape(turns.shape[0], -1),
        samples_per_turn=turns.shape[-1],
        speed_rpm=mean_rpm,
        speed_range_rpm=(float(turn_rpm.min()), float(turn_rpm.max())),
    )
