"""Fit of configuration values to a healthy recording: speed and drift, grade, path, noise."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array, Flags
from gensig.signals.mesh_motion import Motion, Teeth
from gensig.signals.recording import Recording
from gensig.signals.transfer.order_lines import Lines, find_lines
from gensig.signals.transfer.path_gain import fit_path, gain_at
from gensig.systems.base import Machine
from gensig.systems.run import CleanRecord
from gensig.twin.grade import (
    GRADES,
    N_SPECIMENS,
    Grade,
    fit_grade,
    simulated_lines,
    simulated_records,
)
from gensig.twin.speed import find_motion
from gensig.units import from_si, to_si

# the driving gear's bearing along the line of action, where the path begins
SOURCE_CHANNEL = "pinion_y"
# Hz; least rate of the integration, that of the default configuration
INTERNAL_RATE = 256_000.0
# of the slower gear, in each simulated record: as many as measured, within these
SIMULATED_TURNS = (12, 32)
SEED = 0
LOWEST_NOISE = 20.0  # Hz
# octaves to either side over which a density is averaged, and at least some bins
THIRD = 1.0 / 6.0
# where lines are counted too: those of shafts stand far above their surroundings
FINE = 1.0 / 24.0
LEAST_FREE, LEAST_ALL = 20, 2
# a drift is written where the speed scatters this many times as much as pitch errors make it
CLEAR = 2.0
# of the floor, left as noise where the model alone explains the power
LEAST_SHARE = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """Values of a machine that were fitted to its recording.

    ``pitch_error_scatter`` is the scatter of the speed, over its mean, that the pitch errors of the
    fitted grade make alone: the same estimate of simulated records that have no other scatter.
    ``gain`` (sensor, band) is the size of the transfer path at ``gain_frequency`` (band,) Hz.
    ``heard`` (sensor, band) is True where it was measured rather than filled in. ``density``
    (sensor, line) (m/s2)^2/Hz is the noise at ``noise_frequency`` (line,) Hz. ``snr`` (sensor,)
    is in dB over the whole band.
    """

    sensors: tuple[str, ...]
    sampling_rate: float
    motion: Motion
    pitch_error_scatter: float
    grade: Grade
    gain_frequency: Array
    gain: Array
    heard: Flags
    noise_frequency: Array
    density: Array
    snr: Array

    @property
    def drift(self) -> float | None:
        """Scatter of the speed beyond that of the pitch errors; None where none is visible."""
        scatter, correlation = self.motion.scatter, self.motion.correlation_time
        if scatter is None or scatter < CLEAR * self.pitch_error_scatter:
            return None
        if correlation is None or correlation < self.motion.followed_time:
            return None
        return math.sqrt(scatter**2 - self.pitch_error_scatter**2)


def fit(
    recording: Recording,
    system: Machine,
    speed_rpm: float,
    tell: Callable[[str], None] = lambda text: None,
) -> Fit:
    """Fit speed, drift, grade, path and noise to a healthy recording.

    Parameters
    ----------
    system : the machine as far as it is known; its speed, rate, channels, grade and scatter are
        replaced
    speed_rpm : r/min of the driving gear, within 3 %
    tell : takes a line on what is done, while it is done

    Raises
    ------
    ConfigError    where the recording is too short, or shows no mesh
    """
    teeth = Teeth(driving=system.pair.pinion.n_teeth, driven=system.pair.wheel.n_teeth)
    motion = find_motion(recording, teeth, speed_rpm)
    measured = find_lines(
        recording.acceleration, motion.cycles, recording.sampling_rate, teeth
    )
    model = fitting_system(system, recording, motion.mesh_frequency, teeth)
    tell(
        f"speed {60.0 * motion.mesh_frequency / teeth.driving:.3f} r/min; simulating grades"
    )
    graded = simulated_records(model, GRADES, N_SPECIMENS, SEED)
    lines_of = [[simulated_lines(record, model) for record in row] for row in graded]
    grade = fit_grade(measured, lines_of, teeth)
    tell(f"grade {grade.grade:.1f}; simulating that grade")
    (records,) = simulated_records(model, [grade.grade], 2 * N_SPECIMENS, SEED + 1)
    simulated = [simulated_lines(record, model) for record in records]
    frequency, gain, heard = fit_path(measured, simulated, recording)
    lines, density, snr = fit_noise(measured, simulated, recording, frequency, gain)
    return Fit(
        sensors=recording.sensors,
        sampling_rate=recording.sampling_rate,
        motion=motion,
        pitch_error_scatter=_grade_scatter(records, model, teeth),
        grade=grade,
        gain_frequency=frequency,
        gain=gain,
        heard=heard,
        noise_frequency=lines,
        density=density,
        snr=snr,
    )


def _grade_scatter(
    records: Sequence[CleanRecord], model: Machine, teeth: Teeth
) -> float:
    speed_rpm = from_si("speed_rpm", model.operating.speed)
    scatters = []
    for record in records:
        recording = Recording(
            sensors=(SOURCE_CHANNEL,),
            acceleration=record.acceleration,
            sampling_rate=model.sensing.sampling_rate,
        )
        scatters.append(find_motion(recording, teeth, speed_rpm).scatter or 0.0)
    return float(np.median(scatters))


def oversampling(sampling_rate: float, at_least: int) -> int:
    """Steps per sample at which the integration is as fine as that of the default configuration."""
    return max(at_least, math.ceil(INTERNAL_RATE / sampling_rate))


def fitting_system(
    system: Machine, recording: Recording, mesh_frequency: float, teeth: Teeth
) -> Machine:
    """Machine at the fitted speed, with one ideal sensor at the recording's rate."""
    rate, solver = recording.sampling_rate, system.solver
    least, most = (turns * teeth.most / mesh_frequency for turns in SIMULATED_TURNS)
    duration = min(max(recording.duration, least), most)
    operating = replace(
        system.operating,
        speed=to_si("speed_rpm", 60.0 * mesh_frequency / teeth.driving),
        duration=math.ceil(duration * rate) / rate,
    )
    sensing = replace(
        system.sensing,
        sampling_rate=rate,
        channels=(SOURCE_CHANNEL,),
        sensors=None,
        path=None,
    )
    steps = oversampling(rate, solver.oversampling)
    return replace(
        system,
        operating=operating,
        sensing=sensing,
        solver=replace(solver, oversampling=steps, max_error=None),
    )


def fit_noise(
    measured: Lines,
    simulated: Sequence[Lines],
    recording: Recording,
    frequency: Array,
    gain: Array,
) -> tuple[Array, Array, Array]:
    """Density of what does not turn with the gears, and the signal-to-noise ratio.

    Above half the mesh frequency the density is the mean between the shafts' orders, less that of
    the model (orders that both gears make together). Below, the model has next to nothing of a
    machine's vibration (unbalance, alignment, couplings): all that it lacks is counted as noise.
    Where the model explains all, a tenth of the floor is left.

    Returns
    -------
    frequency (line,) Hz, density (sensor, line) (m/s2)^2/Hz, snr (sensor,) dB
    """
    model = [_through(spectrum, frequency, gain) for spectrum in simulated]
    half = 0.5 * recording.sampling_rate
    n_octaves = math.log2(half / LOWEST_NOISE)
    lines = LOWEST_NOISE * 2.0 ** np.linspace(0.0, n_octaves, round(24 * n_octaves))

    def between(spectrum: Lines, power: Array) -> Array:
        counted = (~spectrum.is_line).astype(float)
        weighted = power * counted
        return _mean_density(spectrum, weighted, counted, lines, THIRD, LEAST_FREE)

    def all_of(spectrum: Lines, power: Array) -> Array:
        counted = np.ones(len(spectrum.frequency))
        return _mean_density(spectrum, power, counted, lines, FINE, LEAST_ALL)

    def lacking(density: Callable[[Lines, Array], Array]) -> Array:
        explained = _mean(list(map(density, simulated, model)))
        rest = density(measured, measured.power) - explained
        return np.maximum(rest, LEAST_SHARE * between(measured, measured.floor))

    low = lines < 0.5 * measured.mesh_frequency
    density = lacking(between)
    density[:, low] = np.maximum(density, lacking(all_of))[:, low]
    signal = _mean([power.sum(axis=1) for power in model])
    grid = np.linspace(0.0, half, 8192)
    mean_density = [np.interp(grid, lines, row).mean() for row in density]
    noise = np.array(mean_density) * 0.5 * recording.sampling_rate
    return lines, density, 10.0 * np.log10(signal / noise)


def _through(simulated: Lines, frequency: Array, gain: Array) -> Array:
    """Power of simulated lines at the sensors, (sensor, bin)."""
    bins, power = simulated.frequency, simulated.power[0]
    return np.stack([gain_at(bins, frequency, row) ** 2 * power for row in gain])


def _mean_density(
    lines: Lines, power: Array, counted: Array, wanted: Array, half: float, least: int
) -> Array:
    """Mean over ``half`` octaves and ``least`` bins to either side, (sensor, line) 1/Hz.

    It is that of the bins counted.
    """
    reach, bins = least * lines.width, lines.frequency
    low = np.minimum(wanted * 2.0**-half, wanted - reach)
    high = np.maximum(wanted * 2.0**half, wanted + reach)
    ends = np.stack([np.searchsorted(bins, low), np.searchsorted(bins, high)])

    def between(row: Array) -> Array:
        sums = np.concatenate([[0.0], np.cumsum(row)])
        return np.diff(sums[ends], axis=0)[0]

    n_bins = between(counted)
    known = n_bins > 0
    means = [between(row)[known] / n_bins[known] for row in power]
    density = np.stack([np.interp(wanted, wanted[known], mean) for mean in means])
    return density / lines.width


def _mean(powers: Sequence[Array]) -> Array:
    return np.asarray(np.mean(powers, axis=0))
