"""Speed from the mesh: the position of its harmonics, and the drift of their phase.

Search over a comb of harmonics, then demodulation of the phase: R. B. Randall (2011),
"Vibration-based condition monitoring", Wiley, sections 3.3 and 3.6.2. Several harmonics are
weighted as by F. Bonnardot, M. El Badaoui, R. B. Randall, J. Daniere & F. Guillet (2005),
Mechanical Systems and Signal Processing 19 (4), 766-785.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Array
from gensig.errors import ConfigError, TooShortError
from gensig.signals.recording import Recording

SEARCH = 0.03  # the mesh frequency is looked for this far from the stated one, relative
MOST_HARMONICS = 10
FIRST_HARMONICS = 5  # a line of these must stand out ...
LEAST_LINE_DB = 6.0  # ... by this much above what is around it,
FALSE_ALARM = 1e-6  # and by more than noise would at one line with this probability
# of the slower gear, so that its sidebands are resolved from the mesh
TURNS_A_SEGMENT = 4
LEAST_TURNS = 8
LOW_SPEED_RPM = 100.0  # assumed: a stated speed below is asked back
# share of the slower shaft's frequency up to which the speed is followed
FOLLOWED = 0.4
# harmonics followed in each round: a coarse phase first, then a fine one
PASSES = (1, 2, 4, 8)


@dataclass(frozen=True, slots=True, kw_only=True)
class Teeth:
    """Teeth of the driving and the driven gear."""

    driving: int
    driven: int

    @property
    def most(self) -> int:
        """Teeth of the slower gear: mesh cycles in its turn."""
        return max(self.driving, self.driven)


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """Motion of the mesh in a recording.

    ``mesh_frequency`` Hz, mean; ``cycles`` (sample,) mesh cycles since the first sample.
    ``scatter`` is the standard deviation of the speed over its mean, ``correlation_time`` s. Both
    are None where the speed is steadier than ``detection_limit``, the least visible scatter, which
    is None where only one harmonic is visible. ``followed_time`` s is the correlation time that
    noise has after the lines are followed: a drift has a longer one. ``line_db`` (harmonic,) dB
    is the height of the lines over their surroundings, at the best sensor for each.
    """

    mesh_frequency: float
    cycles: Array
    scatter: float | None
    correlation_time: float | None
    detection_limit: float | None
    followed_time: float
    line_db: Array


def find_motion(
    recording: Recording,
    teeth: Teeth,
    speed_rpm: float,
    *,
    highest: float,
    options: str,
    least_turns: float = LEAST_TURNS,
    longer: str = "record longer",
    search: float = SEARCH,
) -> Motion:
    """Speed and its drift in a recording, from the harmonics of the mesh.

    Parameters
    ----------
    speed_rpm : r/min    of the driving gear, known within `search`
    highest : Hz         end of the band in which the recording can be trusted
    options : what the user's command calls teeth, speed and rate, for the line that a mistake gets
    least_turns : of the slower gear; more for a motion without doubt
    longer : what the user can do about a short recording
    search : share of the mesh frequency, looked at on either side

    Raises
    ------
    TooShortError    for a recording that is too short
    ConfigError    where there is no sign of the mesh
    """
    nominal = speed_rpm / 60.0 * teeth.driving
    if nominal * (1.0 + search) > highest:
        raise ConfigError(
            f"the mesh frequency of {nominal:.5g} Hz lies above the usable band of "
            f"{highest:.5g} Hz of this recording; record faster, or check {options}"
        )
    turns = recording.duration * nominal / teeth.most
    if turns < least_turns:
        raise TooShortError(
            f"too short: {recording.duration:.3g} s are {turns:.1f} turns of the slower gear, "
            f"at least {least_turns:g} are needed; {longer}{in_hertz(speed_rpm)}"
        )
    mesh, line_db = _search(recording, teeth, nominal, highest, search)
    least = _least_line_db(turns)
    visible = np.flatnonzero(line_db >= least) + 1
    if not np.any(visible <= FIRST_HARMONICS):
        raise ConfigError(
            f"no sign of the mesh: none of its first {FIRST_HARMONICS} harmonics within "
            f"{100 * search:.2g} % of {nominal:.5g} Hz stands {least:.1f} dB above its "
            f"surroundings; check {options}{in_hertz(speed_rpm)}"
        )
    return _follow(recording, teeth, mesh, visible, line_db)


def in_hertz(speed_rpm: float) -> str:
    """Question at the end of a message, where a speed in r/min looks like one in Hz."""
    if speed_rpm > LOW_SPEED_RPM:
        return ""
    return f"; is {speed_rpm:g} r/min in Hz? Then say {60.0 * speed_rpm:.5g}"


def _least_line_db(turns: float) -> float:
    """Least height of a line above the median of its surroundings, dB.

    In few segments noise alone reaches it too.
    """
    from scipy.stats import gamma

    n_segments = max(1.0, 2.0 * turns / TURNS_A_SEGMENT - 1.0)
    by_chance = gamma.isf(FALSE_ALARM, n_segments) / gamma.median(n_segments)
    return max(LEAST_LINE_DB, 10.0 * math.log10(by_chance))


def _search(
    recording: Recording, teeth: Teeth, nominal: float, highest: float, search: float
) -> tuple[float, Array]:
    """Mesh frequency to a fraction of a line, and height of its harmonics, (harmonic,) dB."""
    from scipy.ndimage import median_filter
    from scipy.signal import welch

    rate, signal = recording.sampling_rate, recording.acceleration
    length = min(signal.shape[1], round(TURNS_A_SEGMENT * teeth.most / nominal * rate))
    padded = 8 * length
    frequency, density = welch(
        signal, rate, nperseg=length, noverlap=length // 2, nfft=padded, axis=1
    )
    floor = median_filter(
        density, size=(1, 8 * 4 * TURNS_A_SEGMENT + 1), mode="nearest"
    )
    standing = np.max(density / np.maximum(floor, 1e-300), axis=0)
    n_harmonics = max(1, min(MOST_HARMONICS, int(highest / (nominal * (1.0 + search)))))
    candidates = np.linspace(1.0 - search, 1.0 + search, 4001) * nominal
    harmonics = np.arange(1, n_harmonics + 1)
    at_lines = np.interp(harmonics[:, None] * candidates, frequency, standing)
    best = int(np.argmax(np.log10(np.maximum(at_lines, 1.0)).sum(axis=0)))
    height = np.maximum(at_lines[:, best], 1e-300)
    return float(candidates[best]), 10.0 * np.log10(height)


def _follow(
    recording: Recording,
    teeth: Teeth,
    mesh: float,
    visible: NDArray[np.intp],
    line_db: Array,
) -> Motion:
    """Phase of the visible harmonics, followed in rounds, and its drift beyond their noise."""
    rate, n_samples = recording.sampling_rate, recording.acceleration.shape[1]
    cycles: Array = mesh * np.arange(n_samples, dtype=np.float64) / rate
    slow = mesh / teeth.most
    fast = mesh / min(teeth.driving, teeth.driven)
    groups = np.empty((0, n_samples))
    edge = min(math.ceil(1.5 / slow * rate), n_samples // 8)
    inner = slice(edge, n_samples - edge)
    for most in PASSES:
        used = visible[visible <= max(most, visible[0])].tolist()
        width = FOLLOWED * slow
        if most == PASSES[0]:
            width = FOLLOWED * fast
        groups = _deviation(recording.acceleration, cycles, used, width, rate)
        # a filter knows nothing beyond the ends
        deviation = np.pad(groups[0][inner], edge, mode="edge")
        cycles = cycles + np.concatenate([[0.0], np.cumsum(deviation[:-1])]) / rate
    mean = float((cycles[-1] - cycles[0]) * rate / (n_samples - 1))
    instantaneous: Array = np.gradient(cycles[inner]) * rate / mean - 1.0
    limit = scatter = correlation = None
    if len(groups) == 3:
        noise = 0.5 * (groups[1, inner] - groups[2, inner]) / mean
        level = float(np.sqrt(np.mean(noise**2)))
        limit = 2.0 * level
        variance = float(np.var(instantaneous))
        if variance > limit**2:
            scatter = math.sqrt(variance - level**2)
            correlation = _correlation_time(instantaneous, rate, slow)
    return Motion(
        mesh_frequency=mean,
        cycles=cycles,
        scatter=scatter,
        correlation_time=correlation,
        detection_limit=limit,
        followed_time=1.0 / (math.pi * 0.5 * FOLLOWED * slow),
        line_db=line_db,
    )


def _correlation_time(deviation: Array, rate: float, slow: float) -> float:
    """Lag at which the correlation of a deviation falls to 1/e, s."""
    step = max(1, int(rate / (20.0 * slow)))
    coarse = deviation[::step] - deviation.mean()
    n_points = len(coarse)
    sums = np.correlate(coarse, coarse, "full")[n_points - 1 :]
    lags = sums / np.arange(n_points, 0, -1)
    below = np.flatnonzero(lags[: n_points // 2] < lags[0] / math.e)
    lag = n_points // 2
    if len(below):
        lag = below[0]
    return float(lag) * step / rate


def _deviation(
    signal: Array, cycles: Array, used: list[int], width: float, rate: float
) -> Array:
    """Excess of the mesh frequency over that of ``cycles``, (group, sample) Hz.

    The groups are all lines, then every other one. Each line is shifted to rest and kept within
    ``width`` Hz; its frequency is Im(z* dz/dt) / |z|^2. Lines are averaged with the weight
    harmonic^2 power / noise, that of the least squares fit of one common frequency.
    """
    n_samples = signal.shape[1]
    frequency = np.fft.fftfreq(n_samples, 1.0 / rate)
    keep = np.exp(-0.5 * (frequency / (0.5 * width)) ** 2)
    around = (np.abs(frequency) > 1.5 * width) & (np.abs(frequency) < 2.5 * width)
    parts = []
    for harmonic in used:
        shifted = np.fft.fft(signal * np.exp(-2j * np.pi * harmonic * cycles), axis=1)
        line = np.fft.ifft(shifted * keep, axis=1)
        turning = np.fft.ifft(shifted * keep * 2j * np.pi * frequency, axis=1)
        noise = np.median(np.abs(shifted[:, around]) ** 2, axis=1) + 1e-300
        top = np.sum((line.conj() * turning).imag / noise[:, None], axis=0) * harmonic
        bottom = np.sum(np.abs(line) ** 2 / noise[:, None], axis=0) * harmonic**2
        parts.append((top, bottom))
    parts.sort(key=lambda part: -float(part[1].mean()))
    groups = [parts]
    if len(parts) > 1:
        groups += [parts[::2], parts[1::2]]
    deviations = []
    for group in groups:
        total_top = sum(top for top, _ in group)
        total_bottom = sum(bottom for _, bottom in group)
        deviations.append(total_top / total_bottom / (2.0 * np.pi))
    return np.stack(deviations)
