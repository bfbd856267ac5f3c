"""Instantaneous speed by a toothed wheel and a magnetic pick-up.

A clock takes the time from tooth to tooth. Torsional vibration of engines is measured so at a
flywheel's starter ring or a gear, where an incremental encoder (`gensig.sensing.encoder`) has no
room. The engine paper's pick-ups give a square wave, an edge a tooth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.errors import SimulationError
from gensig.sensing.encoder import MOST_ECCENTRICITY, MOST_LINE_SHARE, Disc, draw_lines
from gensig.units import check_limits, unit

MOST_TEETH = 1000
SLOWEST_CLOCK, FASTEST_CLOCK = 1e4, 1e12  # Hz
GROUP = "toothed_wheel."


@dataclass(frozen=True, slots=True, kw_only=True)
class ToothedWheel:
    """Wheel on a node of the shaft line; each tooth gives one edge.

    ``eccentricity_error`` is the largest amplitude of the once-per-turn error and ``tooth_error``
    the standard deviation of the position of each tooth, both in rad. ``clock_frequency`` in Hz
    is that of the counter that takes the times of the edges.
    """

    node: int
    n_teeth: int
    eccentricity_error: float = unit("deg")
    tooth_error: float = unit("deg")
    clock_frequency: float = unit("hz")

    def __post_init__(self) -> None:
        check_limits(self, GROUP, n_teeth=(4, MOST_TEETH))
        check_limits(
            self,
            GROUP,
            eccentricity_error=(0.0, MOST_ECCENTRICITY * (1.0 + 1e-9)),
            tooth_error=(0.0, MOST_LINE_SHARE * self.spacing * (1.0 + 1e-9)),
            clock_frequency=(SLOWEST_CLOCK, FASTEST_CLOCK),
        )

    @property
    def spacing(self) -> float:
        """Angle from tooth to tooth, rad."""
        return 2.0 * math.pi / self.n_teeth


def draw_wheel(rng: np.random.Generator, wheel: ToothedWheel) -> Disc:
    """Wheel of one machine with its errors, as of an encoder's disc."""
    return draw_lines(rng, wheel.n_teeth, wheel.eccentricity_error, wheel.tooth_error)


def passage_times(
    wheel: ToothedWheel, disc: Disc, angle: Array, sampling_rate: float
) -> Array:
    """Times at which teeth pass the pick-up, (passage,) s from the first sample.

    They are whole ticks of the clock.

    Parameters
    ----------
    angle : (sample,) rad    of the shaft, rising
    sampling_rate : Hz

    Raises
    ------
    SimulationError    for a shaft that stops or turns back: the teeth would be miscounted
    """
    from scipy.interpolate import CubicSpline

    if not np.all(np.diff(angle) > 0.0):
        raise SimulationError(
            "the shaft under a toothed wheel must turn forward throughout"
        )
    first = math.floor((angle[0] - disc.index) / (2.0 * math.pi)) - 1
    last = math.ceil((angle[-1] - disc.index) / (2.0 * math.pi)) + 1
    turns = 2.0 * math.pi * np.arange(first, last + 1)
    passages = np.sort((disc.index + turns[:, None] + disc.line_angles).ravel())
    passages = passages[(passages >= angle[0]) & (passages <= angle[-1])]
    times = CubicSpline(angle, np.arange(len(angle)) / sampling_rate)(passages)
    return np.floor(times * wheel.clock_frequency) / wheel.clock_frequency


def instantaneous_speed(
    wheel: ToothedWheel, disc: Disc, angle: Array, sampling_rate: float
) -> Array:
    """Speed that the wheel shows, (sample,) rad/s.

    Notes
    -----
    One tooth spacing over the time between two teeth, at the middle of that time. It is straight
    between these instants and held at either end. It is a mean over one spacing and holds orders
    of the shaft below half the number of teeth.

    Raises
    ------
    SimulationError    as `passage_times`; also where fewer than three teeth pass, or two within
        one tick of the clock
    """
    times = passage_times(wheel, disc, angle, sampling_rate)
    gaps = np.diff(times)
    if len(gaps) < 2 or gaps.min() <= 0.0:
        raise SimulationError(
            f"{len(times)} teeth of {wheel.n_teeth} pass in {len(angle) / sampling_rate:.3g} s "
            f"at a clock of {wheel.clock_frequency:g} Hz, too few or too fast; "
            "change n_teeth or clock_frequency_hz"
        )
    sample_times = np.arange(len(angle)) / sampling_rate
    middles = 0.5 * (times[1:] + times[:-1])
    return np.asarray(np.interp(sample_times, middles, wheel.spacing / gaps))
