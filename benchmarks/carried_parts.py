"""Recordings known again by their fingerprints, and false alarms over others of one machine.

``python -m benchmarks.carried_parts SET --pairs 1000`` takes every record of a data set of one
machine as a recording of its own.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, resample_poly, sosfiltfilt
from scipy.stats import binomtest

import gensig
from gensig.implants.fingerprints import fingerprints_of, known_in
from gensig.signals.recording import STANDARD_GRAVITY, Recording

Array = NDArray[np.float64]
RATES = (12800, 20000, 25600, 48000)


def altered() -> dict[str, Callable[[Array, float], tuple[Array, float]]]:
    """Alteration -> samples and sampling rate of a recording (sensor, sample) after it."""
    rng = np.random.default_rng(20261127)

    def part(
        first: float, last: float
    ) -> Callable[[Array, float], tuple[Array, float]]:
        return lambda x, rate: (
            x[:, round(first * x.shape[1]) : round(last * x.shape[1])],
            rate,
        )

    def at(wanted: int) -> Callable[[Array, float], tuple[Array, float]]:
        def apply(x: Array, rate: float) -> tuple[Array, float]:
            common = math.gcd(wanted, round(rate))
            ratio = wanted // common, round(rate) // common
            return resample_poly(x, *ratio, axis=1), float(wanted)

        return apply

    def noisy(db: float) -> Callable[[Array, float], tuple[Array, float]]:
        def apply(x: Array, rate: float) -> tuple[Array, float]:
            scale = x.std() * 10 ** (-db / 20)
            return x + scale * rng.standard_normal(x.shape), rate

        return apply

    def low(hertz: float) -> Callable[[Array, float], tuple[Array, float]]:
        return lambda x, rate: (
            sosfiltfilt(butter(4, hertz, fs=rate, output="sos"), x, axis=1),
            rate,
        )

    def whole(x: Array, rate: float) -> tuple[Array, float]:
        return np.round(x / np.abs(x).max() * 32767), rate

    return {
        "first 50 %": part(0, 0.5),
        "first 20 %": part(0, 0.2),
        "first 10 %": part(0, 0.1),
        "from the middle, 22 %": part(0.411, 0.63),
        "in g": lambda x, rate: (x / STANDARD_GRAVITY, rate),
        "other sign": lambda x, rate: (-x, rate),
        "offset": lambda x, rate: (x + 3 * x.std(), rate),
        **{f"at {rate} Hz": at(rate) for rate in RATES},
        "float32": lambda x, rate: (x.astype(np.float32).astype(float), rate),
        "int16": whole,
        "low-passed at 4 kHz": low(4000.0),
        "low-passed at 1 kHz": low(1000.0),
        **{f"noise of {db} dB added": noisy(db) for db in (40, 30, 20, 10)},
        "part, in g, 20 kHz, noise of 30 dB": lambda x, rate: at(20000)(
            noisy(30)(-x[:, x.shape[1] // 2 :] / STANDARD_GRAVITY, rate)[0], rate
        ),
    }


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data")
    parser.add_argument("--pairs", type=int, default=1000)
    parser.add_argument("--recordings", type=int, default=20)
    options = parser.parse_args()
    with gensig.open_dataset(options.data) as data:
        recordings = [
            Recording(
                sensors=tuple(data.channel_names),
                acceleration=np.asarray(data.signals(index), dtype=float),
                sampling_rate=data.sampling_rate,
            )
            for index in range(data.n_records)
        ]
    prints = [fingerprints_of({str(k): one}) for k, one in enumerate(recordings)]
    least = [each.least for of_one in prints for each in of_one]
    print(f"{options.data}: known from {min(least):.2f} to {max(least):.2f}")
    chosen = range(min(options.recordings, len(recordings)))
    for name, change in altered().items():
        known = 0
        for index in chosen:
            one = recordings[index]
            samples, rate = change(one.acceleration, one.sampling_rate)
            asked = replace(one, acceleration=samples, sampling_rate=rate)
            known += bool(known_in(asked, prints[index]))
        print(f"{name}: {known} of {len(chosen)}", flush=True)
    pairs = [(i, j) for i in range(len(recordings)) for j in range(len(recordings))]
    pairs = [pair for pair in pairs if pair[0] != pair[1]][: options.pairs]
    alarms = sum(bool(known_in(recordings[i], prints[j])) for i, j in pairs)
    interval = binomtest(alarms, len(pairs)).proportion_ci(0.95, method="exact")
    print(f"false alarms: {alarms} of {len(pairs)} pairs, up to {interval.high:.4f}")


if __name__ == "__main__":
    main()
