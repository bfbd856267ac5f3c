"""Warnings and refusals of long steps."""

from __future__ import annotations

import math
import warnings

import numpy as np

from gensig.dynamics.motion.dynamics import Dynamics
from gensig.errors import StepError

FASTEST_GEARS = 1e6  # Hz, above which sizes are wrong rather than steps too long
LONG_STEP = 0.5  # |lambda| h, above which the error may exceed 1e-3
COARSE_STABILITY = 0.6  # share of the limit: tables may be stiffer than their mean
# Steps per sample of the settling, where the machine allows it, and the time before the record at
# which the steps of the record begin, s. The error of coarse steps decays in these.
SETTLING_STEPS, FINE_TIME = 3, 0.02


class CoarseStepWarning(UserWarning):
    """A step that is stable but too long for the stated error."""

    once = True  # each machine of a plan says it with other numbers


def too_long_steps(
    dynamics: Dynamics, sampling_rate: float, oversampling: int, needed: int
) -> StepError:
    """The refusal of steps that a machine cannot follow, with the motion that decides it.

    ``needed`` is the least number of steps per sample.
    """
    step = 1.0 / (sampling_rate * oversampling)
    frequency = float(np.abs(dynamics.stiff_rates).max()) / (2 * math.pi)
    motion = dynamics.stiffest_motion
    remedy = f"raise solver.oversampling to at least {needed}"
    if frequency > FASTEST_GEARS:
        remedy += f", or check mass, stiffness and damping of {motion}"
    return StepError(
        f"solver.oversampling = {oversampling} makes internal steps of {step:.3g} s, too long "
        f"for the stiffest motion, {motion} at {frequency:.4g} Hz; {remedy}"
    )


def warn_of_coarse_step(
    dynamics: Dynamics, sampling_rate: float, oversampling: int
) -> None:
    """Warn of a step that is long for the mesh mode."""
    step = 1.0 / (sampling_rate * oversampling)
    oscillating = float(np.abs(np.imag(dynamics.stiff_rates)).max())
    if oscillating * step > LONG_STEP:
        warnings.warn(
            f"{2 * math.pi / (oscillating * step):.1f} internal steps to a period of the mesh mode "
            f"at {oscillating / (2 * math.pi):.4g} Hz, and solver.max_error = null looks at no "
            "error, which may exceed 1e-3: raise solver.oversampling to "
            f"{math.ceil(oversampling * oscillating * step / LONG_STEP)}, or give "
            "solver.max_error=1e-3",
            CoarseStepWarning,
            stacklevel=3,
        )
