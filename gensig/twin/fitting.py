"""From a healthy recording to the values of a configuration.

Speed and drift, grade, transfer path, noise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError
from gensig.signals.mesh_motion import Motion, Teeth
from gensig.signals.recording import Recording
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
from gensig.twin.lines import Lines, band_centers, band_sums, find_lines
from gensig.twin.speed import find_motion
from gensig.units import from_si, to_si

Array = NDArray[np.float64]

# the driving gear's bearing along the line of action, where the path begins
SOURCE_CHANNEL = "pinion_y"
INTERNAL_RATE = (
    256_000.0  # Hz; least rate of the integration, that of the default configuration
)
SIMULATED_TURNS = (
    12,
    32,
)  # of the slower gear, in each simulated record: as many as measured, within these
SEED = 0
LOWEST_NOISE = 20.0  # Hz
THIRD = (
    1.0 / 6.0
)  # octaves to either side over which a density is averaged, and at least some bins
FINE = (
    1.0 / 24.0
)  # where lines are counted too: those of shafts stand far above what is beside them
LEAST_FREE, LEAST_ALL = 20, 2
# a drift is written where the speed scatters this many times as much as pitch errors make it
CLEAR = 2.0
LEAST_SHARE = (
    0.1  # of the floor, left as noise where the model alone explains the power
)
SURE = 3.0  # standard deviations above the floor from which the power of lines counts


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """What a recording tells of its machine.

    ``own_scatter`` is the scatter of the speed, over its mean, that the pitch errors of the
    fitted grade make by themselves: the same estimate of simulated records that have no other.
    ``gain`` (sensor, band) is the size of the transfer path at ``gain_frequency`` (band,) Hz,
    ``heard`` (sensor, band) where it was measured rather than filled in; ``density`` (sensor,
    line) (m/s2)^2/Hz the noise at ``noise_frequency`` (line,) Hz; ``snr`` (sensor,) dB over the
    whole band.
    """

    sensors: tuple[str, ...]
    sampling_rate: float
    motion: Motion
    own_scatter: float
    grade: Grade
    gain_frequency: Array
    gain: Array
    heard: NDArray[np.bool_]
    noise_frequency: Array
    density: Array
    snr: Array

    @property
    def drift(self) -> float | None:
        """Scatter of the speed beyond that of the pitch errors.

        None where there is none to be seen.
        """
        scatter, correlation = self.motion.scatter, self.motion.correlation_time
        if scatter is None or scatter < CLEAR * self.own_scatter:
            return None
        if correlation is None or correlation < self.motion.followed_time:
            return None
        return math.sqrt(scatter**2 - self.own_scatter**2)


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
    grade = fit_grade(
        measured,
        [[simulated_lines(one, model) for one in row] for row in graded],
        teeth,
    )
    tell(f"grade {grade.grade:.1f}; simulating that grade")
    (records,) = simulated_records(model, [grade.grade], 2 * N_SPECIMENS, SEED + 1)
    simulated = [simulated_lines(one, model) for one in records]
    frequency, gain, heard = fit_path(measured, simulated, recording)
    lines, density, snr = fit_noise(measured, simulated, recording, frequency, gain)
    return Fit(
        sensors=recording.sensors,
        sampling_rate=recording.sampling_rate,
        motion=motion,
        own_scatter=_own_scatter(records, model, teeth),
        grade=grade,
        gain_frequency=frequency,
        gain=gain,
        heard=heard,
        noise_frequency=lines,
        density=density,
        snr=snr,
    )


def _own_scatter(records: Sequence[CleanRecord], model: Machine, teeth: Teeth) -> float:
    rate, speed_rpm = (
        model.sensing.sampling_rate,
        from_si("speed_rpm", model.operating.speed),
    )
    found = []
    for record in records:
        heard = Recording(
            sensors=(SOURCE_CHANNEL,),
            acceleration=record.acceleration,
            sampling_rate=rate,
        )
        found.append(find_motion(heard, teeth, speed_rpm).scatter or 0.0)
    return float(np.median(found))


def oversampling(sampling_rate: float, at_least: int) -> int:
    """Steps per sample at which the integration is as fine as that of the default configuration."""
    return max(at_least, math.ceil(INTERNAL_RATE / sampling_rate))


def fitting_system(
    system: Machine, recording: Recording, mesh_frequency: float, teeth: Teeth
) -> Machine:
    """The machine at the speed that was found, heard by one ideal sensor at the recording's
    rate."""
    sampling_rate, solver = recording.sampling_rate, system.solver
    least, most = (turns * teeth.most / mesh_frequency for turns in SIMULATED_TURNS)
    duration = min(max(recording.duration, least), most)
    return replace(
        system,
        operating=replace(
            system.operating,
            speed=to_si("speed_rpm", 60.0 * mesh_frequency / teeth.driving),
            duration=math.ceil(duration * sampling_rate) / sampling_rate,
        ),
        sensing=replace(
            system.sensing,
            sampling_rate=sampling_rate,
            channels=(SOURCE_CHANNEL,),
            sensors=None,
            path=None,
        ),
        solver=replace(
            solver,
            oversampling=oversampling(sampling_rate, solver.oversampling),
            max_error=None,
        ),
    )


def fit_path(
    measured: Lines, simulated: Sequence[Lines], recording: Recording
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Gain from the simulated bearing to each sensor, from half the mesh frequency up.

    Root of the measured over the simulated power of the shafts' orders, in sixths of an octave.
    Where the orders are not heard the gain is interpolated, but not above what would have been
    heard.

    Returns
    -------
    frequency (band,) Hz, gain (sensor, band), heard (sensor, band)
    """
    centers = band_centers(0.5 * measured.mesh_frequency, recording.sampling_rate)
    power = band_sums(measured.synchronous, measured.frequency, centers)
    n_bins = np.maximum(
        band_sums(measured.is_line[None].astype(float), measured.frequency, centers),
        1.0,
    )
    floor = band_sums(
        np.where(measured.is_line, measured.floor, 0.0), measured.frequency, centers
    )
    spread = floor / np.sqrt(
        n_bins / 2.0
    )  # two bins of a Hann window are about one of their own
    model = _mean(
        [band_sums(one.synchronous, one.frequency, centers)[0] for one in simulated]
    )
    heard = (power > SURE * spread) & (model > 0.0)
    gain = np.empty_like(power)
    for sensor, (row, noise, known) in enumerate(
        zip(power, spread, heard, strict=True)
    ):
        if not known.any():
            name = recording.sensors[sensor]
            raise ConfigError(
                f"{name} hears nothing of the gears; leave it out with --channels"
            )
        squared = row[known] / model[known]
        filled = np.exp(
            np.interp(np.log(centers), np.log(centers[known]), np.log(squared))
        )
        most = (np.maximum(row, 0.0) + SURE * noise) / np.maximum(model, 1e-300)
        gain[sensor] = np.sqrt(np.where(known, filled, np.minimum(filled, most)))
    return centers, gain, heard


def fit_noise(
    measured: Lines,
    simulated: Sequence[Lines],
    recording: Recording,
    frequency: Array,
    gain: Array,
) -> tuple[Array, Array, Array]:
    """Density of what does not turn with the gears, and the signal-to-noise ratio.

    Above half the mesh frequency that is the mean between the shafts' orders, less what the model
    has there (orders that both gears make together). Below, the model has next to nothing of what
    a machine does (unbalance, alignment, couplings): all that it lacks is counted as noise. Where
    the model explains all, a tenth of the floor is left.

    Returns
    -------
    frequency (line,) Hz, density (sensor, line) (m/s2)^2/Hz, snr (sensor,) dB
    """
    own = [_through(one, frequency, gain) for one in simulated]
    n_octaves = math.log2(0.5 * recording.sampling_rate / LOWEST_NOISE)
    lines = LOWEST_NOISE * 2.0 ** np.linspace(0.0, n_octaves, round(24 * n_octaves))

    def between(one: Lines, power: Array) -> Array:
        counted = (~one.is_line).astype(float)
        return _mean_density(one, power * counted, counted, lines, THIRD, LEAST_FREE)

    def all_of(one: Lines, power: Array) -> Array:
        return _mean_density(
            one, power, np.ones(len(one.frequency)), lines, FINE, LEAST_ALL
        )

    def lacking(density: Callable[[Lines, Array], Array]) -> Array:
        explained = _mean(
            [density(one, values) for one, values in zip(simulated, own, strict=True)]
        )
        return np.maximum(
            density(measured, measured.power) - explained,
            LEAST_SHARE * between(measured, measured.floor),
        )

    low = lines < 0.5 * measured.mesh_frequency
    density = lacking(between)
    density[:, low] = np.maximum(density, lacking(all_of))[:, low]
    signal = _mean([values.sum(axis=1) for values in own])
    grid = np.linspace(0.0, 0.5 * recording.sampling_rate, 8192)
    noise = (
        np.array([np.interp(grid, lines, row).mean() for row in density])
        * 0.5
        * recording.sampling_rate
    )
    return lines, density, 10.0 * np.log10(signal / noise)


def _through(simulated: Lines, frequency: Array, gain: Array) -> Array:
    """Power of simulated lines at the sensors, (sensor, bin)."""
    return np.stack(
        [
            gain_at(simulated.frequency, frequency, row) ** 2 * simulated.power[0]
            for row in gain
        ]
    )


def gain_at(wanted: Array, frequency: Array, gain: Array) -> Array:
    """A gain between the frequencies at which it is known.

    Straight in the logarithms, held beyond them.
    """
    axis = np.log(np.maximum(wanted, 1e-3))
    return np.asarray(
        np.exp(np.interp(axis, np.log(frequency), np.log(np.maximum(gain, 1e-300))))
    )


def _mean_density(
    lines: Lines, power: Array, counted: Array, wanted: Array, half: float, least: int
) -> Array:
    """Mean over ``half`` octaves and ``least`` bins to either side of the bins counted, (sensor,
    line) 1/Hz.
    """
    reach = least * lines.width
    first = np.searchsorted(
        lines.frequency, np.minimum(wanted * 2.0**-half, wanted - reach)
    )
    last = np.searchsorted(
        lines.frequency, np.maximum(wanted * 2.0**half, wanted + reach)
    )

    def between(row: Array) -> Array:
        return np.diff(
            np.concatenate([[0.0], np.cumsum(row)])[np.stack([first, last])], axis=0
        )[0]

    n_bins = between(counted)
    known = n_bins > 0
    means = [between(row)[known] / n_bins[known] for row in power]
    return (
        np.stack([np.interp(wanted, wanted[known], mean) for mean in means])
        / lines.width
    )


def _mean(powers: Sequence[Array]) -> Array:
    return np.asarray(np.mean(powers, axis=0))


def minimum_phase(
    frequency: Array, gain: Array, sampling_rate: float, step: float
) -> tuple[Array, NDArray[np.complex128]]:
    """Causal response with the given gain and the least delay, at even frequencies from 0 to half
    the rate.

    Returns
    -------
    frequency (line,) Hz, response (line,)

    Source: A. V. Oppenheim & R. W. Schafer, "Discrete-time signal processing", real cepstrum
    folded to positive times.
    """
    n_lines = math.floor(0.5 * sampling_rate / step)
    n_fft = (
        2 * 8 * n_lines
    )  # eight lines between those given, so that the cepstrum does not fold
    logarithm: Array = np.log(
        gain_at(
            np.arange(n_fft // 2 + 1) * (0.5 * sampling_rate) / (n_fft // 2),
            frequency,
            gain,
        )
    )
    cepstrum: Array = np.fft.irfft(logarithm, n_fft)
    fold = np.zeros(n_fft)
    fold[0] = fold[n_fft // 2] = 1.0
    fold[1 : n_fft // 2] = 2.0
    response = np.exp(np.fft.rfft(cepstrum * fold))[::8]
    even: Array = np.arange(n_lines + 1, dtype=np.float64) * (
        0.5 * sampling_rate / n_lines
    )
    return even, np.asarray(response, dtype=np.complex128)
