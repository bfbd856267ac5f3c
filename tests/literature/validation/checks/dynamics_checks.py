"""Indicators of short simulated records, by the names that the rows use.

A record is the acceleration of the pinion's bearing along the line of action over 15 whole turns,
so that every shaft order falls on a bin. The *residual* is what is left without every mesh
harmonic; the *tooth-segment ratio* is the largest over the median RMS of the 23 tooth segments of
a turn.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.signal import resample

from gensig.signals.averaging import remove_orders
from gensig.signals.indicators import kurtosis, rms
from gensig.signals.spectrum import amplitude_spectrum
from validation.case import (
    RECORD_TURNS,
    Array,
    Case,
    record,
    running,
    with_fault,
    with_words,
)
from validation.checks.geometry_checks import Check

SAMPLES_PER_TOOTH = 512
N_SIDEBANDS = 6


@lru_cache(maxsize=64)
def _amplitude(case: Case) -> Array:
    """Amplitude of every line, m/s2; line k * 15 is order k of the pinion."""
    return np.asarray(amplitude_spectrum(record(case), 1.0, window="boxcar")[1])


def _mesh_line(case: Case, harmonic: int, sideband: int = 0) -> float:
    """Amplitude of a mesh harmonic, or of its n-th sideband at the pinion's rotation, m/s2."""
    return float(
        _amplitude(case)[
            RECORD_TURNS * (harmonic * case.pair.pinion.n_teeth + sideband)
        ]
    )


@lru_cache(maxsize=64)
def _residual(case: Case) -> Array:
    signal = record(case)
    step = RECORD_TURNS * case.pair.pinion.n_teeth
    return np.asarray(remove_orders(signal, range(0, len(signal) // 2 + 1, step)))


def _sidebands(case: Case, harmonic: int) -> list[float]:
    steps = range(1, N_SIDEBANDS + 1)
    return [
        _mesh_line(case, harmonic, sign * step) for step in steps for sign in (-1, 1)
    ]


def _line_ratio(case: Case, at: str) -> float:
    above, below = at.split("/")
    return _mesh_line(case, int(above)) / _mesh_line(case, int(below))


def _strongest_line(case: Case, at: str) -> float:
    """Number of the strongest mesh harmonic up to the one in ``at``."""
    return float(
        1
        + np.argmax([_mesh_line(case, harmonic) for harmonic in range(1, int(at) + 1)])
    )


def _sideband_sum(case: Case, at: str) -> float:
    """Six sidebands on either side of a mesh harmonic over that harmonic."""
    return sum(_sidebands(case, int(at))) / _mesh_line(case, int(at))


def _strongest_sideband(case: Case, at: str) -> float:
    return max(_sidebands(case, int(at))) / _mesh_line(case, int(at))


def _mesh_power_share(case: Case, at: str) -> float:
    """Share of the power that lies in the mesh harmonics."""
    return 1.0 - float(np.mean(_residual(case) ** 2) / np.var(record(case)))


def _rms(case: Case, at: str) -> float:
    return float(np.std(record(case)))


def _rms_over_healthy(case: Case, at: str) -> float:
    return _rms(case, at) / _rms(with_fault(case), at)


def _residual_rms(case: Case, at: str) -> float:
    return float(rms(_residual(case)))


def _residual_over_crack(case: Case, at: str) -> float:
    """Residual of the fault over that of the paper's 1 mm crack.

    ``at`` says where the crack starts.
    """
    crack = with_fault(case, "fault=crack", f"fault.crack_start={at}")
    return _residual_rms(case, at) / _residual_rms(crack, at)


def _fine(case: Case, signal: Array) -> Array:
    """The same band-limited signal at 512 samples a tooth, (turn, tooth, sample): whatever the
    record's rate.

    A rate that is a multiple of the mesh frequency always takes the same few instants of a mesh
    period.
    """
    n_teeth = case.pair.pinion.n_teeth
    fine = resample(signal - signal.mean(), RECORD_TURNS * n_teeth * SAMPLES_PER_TOOTH)
    return np.asarray(fine).reshape(RECORD_TURNS, n_teeth, SAMPLES_PER_TOOTH)


def _tooth_segment_ratio(case: Case, at: str) -> float:
    level = np.sqrt((_fine(case, record(case)) ** 2).mean(axis=(0, 2)))
    return float(level.max() / np.median(level))


def _classical_change(case: Case, at: str) -> float:
    """Relative change of an indicator without the torque that keeps the energy balance."""
    classical = with_words(case, "mesh.roll_torque=classical")
    indicator = {"rms": _rms, "kurtosis": _kurtosis}[at]
    return indicator(classical, at) / indicator(case, at) - 1.0


def _kurtosis(case: Case, at: str) -> float:
    return float(kurtosis(_fine(case, record(case)).ravel()))


def _residual_kurtosis(case: Case, at: str) -> float:
    return float(kurtosis(_fine(case, _residual(case)).ravel()))


def _natural_frequency(case: Case, at: str) -> float:
    """The n-th undamped frequency in Hz with the mesh held at a stiffness, rotation held by the
    drive left out.

    ``at`` is ``stiffness mode``; modes across the line of action and that of the drive are not
    counted.
    """
    stiffness, mode = at.split()
    pair = running(case)
    system = pair.equations
    direction = pair.approach_direction()
    matrix = system.governed_stiffness + float(stiffness) * np.outer(
        direction, direction
    )
    along = [index for index, name in enumerate(pair.dofs) if not name.endswith("_x")]
    reduced = matrix[np.ix_(along, along)] / system.mass[along][:, None]
    frequency = np.sqrt(np.sort(np.abs(np.linalg.eigvals(reduced)))) / (2.0 * np.pi)
    return float(frequency[int(mode)])


def _support_frequency(case: Case, at: str) -> float:
    """Undamped frequency in Hz of one gear on its own support; ``at`` is its degree of freedom."""
    pair = running(case)
    system, index = pair.equations, pair.dofs.index(at)
    return float(
        np.sqrt(system.governed_stiffness[index, index] / system.mass[index])
        / (2.0 * np.pi)
    )


DYNAMICS: dict[str, Check] = {
    "acceleration_rms": _rms,
    "acceleration_kurtosis": _kurtosis,
    "rms_over_healthy": _rms_over_healthy,
    "kurtosis_over_healthy": lambda case, at: (
        _kurtosis(case, at) / _kurtosis(with_fault(case), at)
    ),
    "mesh_line": lambda case, at: _mesh_line(case, int(at)),
    "mesh_line_ratio": _line_ratio,
    "strongest_mesh_line": _strongest_line,
    "sideband_sum": _sideband_sum,
    "strongest_sideband": _strongest_sideband,
    "mesh_power_share": _mesh_power_share,
    "residual_rms": _residual_rms,
    "residual_kurtosis": _residual_kurtosis,
    "residual_over_crack": _residual_over_crack,
    "tooth_segment_ratio": _tooth_segment_ratio,
    "classical_change": _classical_change,
    "natural_frequency": _natural_frequency,
    "support_frequency": _support_frequency,
}
