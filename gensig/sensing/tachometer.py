"""Tachometers: sensors that give a pulse for every passing mark of a shaft."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError
from gensig.units import check_limits, from_si, unit

MOST_PULSES = 1000  # a turn
# standard deviations that fit into a pulse or a gap, so that no edge overtakes another
JITTERS_IN_A_WIDTH = 8.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Tachometer:
    """Evenly spaced marks on a shaft, each ``pulse_width_share`` of their spacing wide.

    ``shaft`` names a gear on it. ``jitter`` in rad is the standard deviation of the angle at
    which a pulse begins. It is drawn anew for every pulse, which ends a width later.
    """

    shaft: str
    pulses_per_turn: int
    pulse_width_share: float
    jitter: float = unit("deg")

    def __post_init__(self) -> None:
        if not 1 <= self.pulses_per_turn <= MOST_PULSES:
            raise ConfigError(
                f"sensing.tacho.pulses_per_turn = {self.pulses_per_turn} must lie in "
                f"1..{MOST_PULSES}; sensing.encoder has more lines"
            )
        check_limits(self, "sensing.tacho.", pulse_width_share=(1e-3, 0.999))
        narrower = min(self.pulse_width_share, 1.0 - self.pulse_width_share)
        most = self.spacing * narrower / JITTERS_IN_A_WIDTH
        if not 0.0 <= self.jitter <= most:
            raise ConfigError(
                f"sensing.tacho.jitter_deg = {from_si('jitter_deg', self.jitter):g} must lie in "
                f"0..{from_si('jitter_deg', most):g}, an eighth of the narrower of pulse and gap; "
                "change that with pulse_width_share"
            )

    @property
    def spacing(self) -> float:
        """Angle from the beginning of a pulse to that of the next, rad."""
        return 2.0 * math.pi / self.pulses_per_turn


def draw_mark(rng: np.random.Generator) -> float:
    """Angle of the gear at which a pulse begins, rad: the mark may be anywhere on the shaft."""
    return float(rng.uniform(0.0, 2.0 * math.pi))


def pulse_train(
    tacho: Tachometer,
    mark: float,
    angle: Array,
    sampling_rate: float,
    rng: np.random.Generator,
) -> Array:
    """Output of the tachometer, (sample,): 1 in a pulse, 0 between, the high share at an edge.

    A sample is the mean over one sampling interval around its instant, as a converter integrates.
    So the two samples around an edge hold its exact instant
    (``gensig.signals.tacho.pulse_times``).

    Parameters
    ----------
    mark : rad                     angle at which a pulse begins
    angle : (sample,) rad          of the gear, rising
    """
    n_samples = len(angle)
    ahead, behind = 2.0 * angle[0] - angle[1], 2.0 * angle[-1] - angle[-2]
    turned = np.concatenate([[ahead], angle, [behind]])
    first = math.floor((turned[0] - mark) / tacho.spacing) - 1
    last = math.ceil((turned[-1] - mark) / tacho.spacing) + 1
    number = np.arange(first, last + 1)
    begins = (
        mark + tacho.spacing * number + tacho.jitter * rng.standard_normal(len(number))
    )
    ends = begins + tacho.pulse_width_share * tacho.spacing
    edges = np.column_stack([begins, ends]).ravel()
    # in samples
    at = np.interp(
        edges, np.maximum.accumulate(turned), np.arange(-1.0, n_samples + 1.0)
    )
    is_pulse = np.arange(len(at) - 1) % 2 == 0
    high = np.concatenate([[0.0], np.cumsum(np.diff(at) * is_pulse)])
    return np.diff(np.interp(np.arange(n_samples + 1) - 0.5, at, high))
