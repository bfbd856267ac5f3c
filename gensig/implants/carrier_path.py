"""Path from a simulated sensor to one of the carrier, by the sound of both machines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError, TooShortError
from gensig.implants.carriers import Carrier
from gensig.implants.gearing import Gearing
from gensig.signals.resampling import PASS_SHARE
from gensig.signals.transfer.order_lines import Lines, find_lines
from gensig.signals.transfer.path_gain import fit_path, minimum_phase

N_LINES = 2048  # of the response; the impulse response has twice as many samples
FEWEST_TURNS = 8.0  # of the slowest shaft, so that its orders are resolved
# of the strongest band: what the low-pass leaves of a simulated signal is no model
LEAST_MODEL = 1e-9


def carrier_lines(carrier: Carrier, stop: int, gearing: Gearing) -> Lines:
    """Order spectrum of a carrier up to a sample, by the gears of its first stage.

    Raises
    ------
    TooShortError    for a stretch of too few turns
    """
    signal, turned = carrier.recording.acceleration[:, :stop], carrier.turned[:stop]
    turns = float(turned[-1]) * gearing.slowest
    if turns < FEWEST_TURNS:
        raise TooShortError(
            f"{carrier.name}: its blocks that carry have {turns:.1f} turns of the slowest shaft, "
            f"a path needs {FEWEST_TURNS:g}; record longer, or give --path none"
        )
    cycles = turned * gearing.mesh_order(0)
    return find_lines(signal, cycles, carrier.recording.sampling_rate, gearing.stage(0))


def path_response(
    measured: Lines, sound: Array, carrier: Carrier, *, highest: float
) -> Array:
    """Impulse responses from simulated sensors to those of the carrier, (sensor, sample).

    Parameters
    ----------
    measured : of `carrier_lines`
    sound : (sensor, sample) healthy simulated signal of each sensor, as the carrier plays it
    highest : Hz    up to which that signal is known

    Raises
    ------
    ConfigError    for a sensor that hears nothing of the gears

    Notes
    -----
    The gain of `gensig.signals.transfer.path_gain.fit_path`, as ``gensig twin`` fits it. All
    power of the simulated signal counts as the gears': it has no noise.
    """
    recording = carrier.recording
    rate, n_samples = recording.sampling_rate, sound.shape[-1]
    window = np.hanning(n_samples)
    power = np.abs(np.fft.rfft(sound * window, axis=-1)) ** 2
    power *= 2.0 / (n_samples * np.sum(window**2))
    frequency: Array = np.arange(power.shape[-1]) * (rate / n_samples)
    power[:, frequency > min(highest, PASS_SHARE * rate)] = 0.0
    power[power < LEAST_MODEL * power.max(axis=-1, keepdims=True)] = 0.0
    responses = []
    for sensor in range(len(sound)):
        model = Lines(
            power=power[sensor : sensor + 1],
            floor=np.zeros((1, len(frequency))),
            frequency=frequency,
            is_line=np.ones(len(frequency), dtype=bool),
            n_cycles=measured.n_cycles,
            mesh_frequency=measured.mesh_frequency,
        )
        rows = slice(sensor, sensor + 1)
        of_sensor = replace(
            measured, power=measured.power[rows], floor=measured.floor[rows]
        )
        named = replace(recording, sensors=recording.sensors[rows])
        try:
            centers, gain, _ = fit_path(of_sensor, [model], named)
        except ConfigError as error:
            raise ConfigError(f"{carrier.name}: {error}, or give --path none") from None
        _, response = minimum_phase(centers, gain[0], rate, 0.5 * rate / N_LINES)
        responses.append(np.fft.irfft(response, 2 * (len(response) - 1)))
    return np.stack(responses)


def through(signal: Array, response: Array) -> Array:
    """Signals behind a path, (channel, sample), from rest."""
    from scipy.signal import fftconvolve

    filtered = fftconvolve(signal, response, axes=-1)[..., : signal.shape[-1]]
    return np.asarray(filtered, dtype=float)
