"""One healthy recording on the simulated healthy distribution of its geometry and speed.

The recording is looked for in the folder ``$GENSIG_MEASURED`` and nowhere else; nothing of it
is stored but the range of each indicator over its channels.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from benchmarks._realism_results import RECORDING
from benchmarks._realism_sets import (
    CONTROLS,
    RECORDING_DURATION,
    RECORDING_RATE,
    RECORDING_SPEED,
    RECORDING_TEETH,
)
from benchmarks._realism_values import to_rate
from gensig.dataset.reader import Dataset
from gensig.errors import DatasetError
from gensig.report.realism import (
    APART,
    NOT_APART,
    NOTHING,
    WITHOUT,
    Comparison,
    judge,
    points,
)
from gensig.signals.averaging import resample_to_angle, samples_per_turn_for
from gensig.signals.indicators import crest_factor, fm4, kurtosis, rms, sideband_ratio
from gensig.signals.rotation import (
    find_mesh_frequency,
    mesh_phase_angle,
    resample_by_angle,
)
from gensig.signals.synchronous import mesh_harmonics

FloatArray = NDArray[np.floating]

VARIABLE = "GENSIG_MEASURED"
NAME = "healthy_*.npz"
INDICATORS = {
    "kurtosis": "",
    "crest_factor": "",
    "fm4": "",
    "sideband_ratio": "dB",
    "harmonic_2_over_1": "dB",
    "harmonic_3_over_1": "dB",
    "mesh_share": "dB",
}
MOST_WIDTH = 2.0  # simulated interval over the range of the channels
SOURCE = "public recording, 23/46 teeth, 2000 r/min, healthy"


def find_recording() -> FloatArray | None:
    """(channel, sample) acceleration of the healthy recording, or None where there is none.

    Raises
    ------
    DatasetError    for a file without the array that is looked for
    """
    folder = os.environ.get(VARIABLE)
    files = sorted(Path(folder).glob(NAME)) if folder else []
    if not files:
        return None
    with np.load(files[0], allow_pickle=False) as held:
        if "acceleration" not in held or held["acceleration"].ndim != 2:
            raise DatasetError(
                f"{files[0].name} holds no array 'acceleration' of (channel, sample)"
            )
        return held["acceleration"].astype(float)


def indicators(
    signal: ArrayLike, sampling_rate: float, n_teeth: int, rotation_frequency: float
) -> dict[str, FloatArray]:
    """Indicators without unit that gain does not change, of a recording without a tachometer.

    Parameters
    ----------
    signal : (channel, sample)
    sampling_rate : Hz
    n_teeth : teeth of the gear whose turns are averaged
    rotation_frequency : Hz    its nominal turns per second

    Returns
    -------
    (channel,) each; ratios of amplitudes in dB
    """
    x = np.asarray(signal, dtype=float)
    x = x - x.mean(axis=-1, keepdims=True)
    mesh_frequency = find_mesh_frequency(x, sampling_rate, n_teeth, rotation_frequency)
    turns = _turns(x, sampling_rate, n_teeth, mesh_frequency)
    average = turns.mean(axis=-2)
    harmonics = mesh_harmonics(average, n_teeth, 3)
    whole = rms(turns.reshape(*turns.shape[:-2], -1))
    return {
        "kurtosis": kurtosis(x),
        "crest_factor": crest_factor(x),
        "fm4": fm4(average, n_teeth),
        "sideband_ratio": _decibel(sideband_ratio(average, n_teeth)),
        "harmonic_2_over_1": _decibel(harmonics[..., 1] / harmonics[..., 0]),
        "harmonic_3_over_1": _decibel(harmonics[..., 2] / harmonics[..., 0]),
        "mesh_share": _decibel(
            np.sqrt(0.5 * np.sum(np.square(harmonics), axis=-1)) / whole
        ),
    }


def _turns(
    x: FloatArray, sampling_rate: float, n_teeth: int, mesh_frequency: float
) -> FloatArray:
    """Whole turns by the angle under which the mesh stands out most: steady, or by the phase of a
    mesh harmonic.

    The phase of each harmonic is taken from the channel that holds most of it; where no line
    stands out it is left out.
    """
    rotation = mesh_frequency / n_teeth
    per_turn = samples_per_turn_for(sampling_rate, rotation)
    candidates = [resample_to_angle(x, sampling_rate, rotation, per_turn)]
    shares = mesh_harmonics(candidates[0].mean(axis=-2), n_teeth, 3) / rms(x)[:, None]
    for harmonic, channel in enumerate(np.argmax(shares, axis=0), start=1):
        try:
            angle = mesh_phase_angle(
                x[channel], sampling_rate, n_teeth, mesh_frequency, harmonic=harmonic
            )
        except ValueError:
            continue
        candidates.append(resample_by_angle(x, angle, per_turn))
    return max(candidates, key=lambda turns: _mesh_power(turns, n_teeth))


def _mesh_power(turns: FloatArray, n_teeth: int) -> float:
    """Power of the first mesh harmonics in the average turn over that of the turns, mean over the
    channels.
    """
    harmonics = mesh_harmonics(turns.mean(axis=-2), n_teeth, 3)
    return float(
        np.mean(
            np.sum(np.square(harmonics), axis=-1)
            / np.mean(np.square(turns), axis=(-2, -1))
        )
    )


def _decibel(ratio: FloatArray) -> FloatArray:
    return 20.0 * np.log10(ratio)


def simulated_indicators(data: Dataset) -> dict[str, FloatArray]:
    """(record, channel) indicators of the records of a set, resampled to the rate of the
    recording.
    """
    rows = [
        indicators(
            to_rate(data.signals(index), data.sampling_rate, RECORDING_RATE),
            RECORDING_RATE,
            RECORDING_TEETH[0],
            RECORDING_SPEED / 60.0,
        )
        for index in np.flatnonzero(data.usable).tolist()
    ]
    return {name: np.array([row[name] for row in rows]) for name in INDICATORS}


def recording_indicators(
    recording: FloatArray, duration: float = RECORDING_DURATION
) -> dict[str, FloatArray]:
    """(channel,) indicators of the recording, of its first part where less is simulated."""
    length = min(recording.shape[-1], round(duration * RECORDING_RATE))
    return indicators(
        recording[:, :length],
        RECORDING_RATE,
        RECORDING_TEETH[0],
        RECORDING_SPEED / 60.0,
    )


def recording_comparisons(
    simulated: Mapping[str, Mapping[str, FloatArray]],
    recorded: Mapping[str, FloatArray] | None,
) -> list[Comparison]:
    """Rows of the second table: the right simulation beside the recording, its width, and the
    wrong ones beside it.

    Parameters
    ----------
    simulated : indicators by control, see ``CONTROLS``
    recorded : indicators of the recording; None leaves its rows out
    """
    result = []
    for name, unit in INDICATORS.items():
        right = points(simulated[CONTROLS[0]][name])
        row = {"id": f"{RECORDING}.{name}", "unit": unit}
        if recorded is None:
            result.append(_row(row, "simulated", (None, None), "", right, WITHOUT))
        else:
            channels = float(np.min(recorded[name])), float(np.max(recorded[name]))
            verdict = judge(right[1], right[2], *channels)
            result.append(_row(row, "channels", channels, SOURCE, right, verdict))
            width = (right[2] - right[1]) / (channels[1] - channels[0])
            verdict = judge(None, MOST_WIDTH, width, width)
            result.append(
                _row(
                    {**row, "unit": ""},
                    "width",
                    (None, MOST_WIDTH),
                    "asked",
                    (width,) * 3,
                    verdict,
                    right[3],
                )
            )
        for control in CONTROLS[1:]:
            wrong = points(simulated[control][name])
            verdict = APART if wrong[0] < right[1] or wrong[0] > right[2] else NOT_APART
            result.append(
                _row(
                    row,
                    control,
                    (right[1], right[2]),
                    "right simulation",
                    wrong,
                    verdict,
                )
            )
    return result


def _row(
    row: Mapping[str, Any],
    at: str,
    beside: tuple[float | None, float | None],
    source: str,
    simulated: Sequence[float],
    verdict: str,
    n: int | None = None,
) -> Comparison:
    median, p5, p95 = simulated[:3]
    count = int(simulated[3]) if n is None else n
    return Comparison(
        **row,
        at=at,
        low=beside[0],
        high=beside[1],
        source=source,
        median=median,
        p5=p5,
        p95=p95,
        n=count,
        verdict=verdict if count else NOTHING,
    )
