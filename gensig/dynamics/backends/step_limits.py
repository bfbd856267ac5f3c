"""Steps that the classical Runge-Kutta scheme can take, and the stages of the settling."""

from __future__ import annotations

import math
import warnings

import numpy as np

from gensig.dynamics.pair import PairDynamics
from gensig.dynamics.system import slowest_decay, stiffest_motion
from gensig.errors import StepError

LONGEST_SETTLING = 0.45  # s
SETTLED = 1e-4  # share of the start's transient that is left
STABILITY_LIMIT = (
    2.6  # |lambda| h; RK4 has 2.83 on the imaginary axis, 2.79 on the real axis
)
FASTEST_GEARS = 1e6  # Hz, above which sizes are wrong rather than steps too long
LONG_STEP = 0.5  # of the same, above which the error may exceed 1e-3
COARSE_STABILITY = 0.6  # share of the limit: tables may be stiffer than their mean
# Stages of the settling: steps per sample, and the time before the record at which the stage ends,
# s. The slow transient of the drive takes nearly all of the settling. The error of coarse steps
# decays in the finer steps that follow. The last stage takes the step of the record.
COARSE = ((1, 0.2), (2, 0.1), (3, 0.02))


class CoarseStepWarning(UserWarning):
    """A step that is stable but too long for the stated error."""

    once = True  # each machine of a plan says it with other numbers


def settling_time(dynamics: PairDynamics) -> float:
    """Time after which the start's transient has fallen to 1e-4 (longest 0.45 s), s."""
    rate = slowest_decay(
        dynamics.system(), dynamics.approach_direction(), dynamics.mean_mesh_stiffness
    )
    return min(LONGEST_SETTLING, math.log(1.0 / SETTLED) / rate)


def coarsest_oversampling(
    dynamics: PairDynamics, oversampling: int, sampling_rate: float
) -> int:
    """Least stable number of steps per sample of the settling, at most that of the record."""
    fastest = float(np.abs(dynamics.stiff_rates).max()) / sampling_rate
    return min(oversampling, math.ceil(fastest / (COARSE_STABILITY * STABILITY_LIMIT)))


def settling_stages(
    least: int, oversampling: int, sampling_rate: float
) -> list[tuple[int, int]]:
    """Stages of the settling: steps per sample, and samples from the stage's end to the record.

    ``least`` is the number of steps per sample from which the method is stable.
    """
    return [
        (min(max(steps, least), oversampling), math.ceil(before * sampling_rate))
        for steps, before in COARSE
    ]


def check_step(
    dynamics: PairDynamics,
    sampling_rate: float,
    oversampling: int,
    max_error: float | None = None,
) -> None:
    """Raise StepError for an unstable step; warn of a coarse one without ``max_error``.

    With a ``max_error``, records with a larger error are integrated again at half the step.
    """
    rates, step = dynamics.stiff_rates, 1.0 / (sampling_rate * oversampling)
    fastest = float(np.abs(rates).max())
    if fastest * step > STABILITY_LIMIT:
        needed = math.ceil(oversampling * fastest * step / STABILITY_LIMIT)
        raise too_long_steps(dynamics, sampling_rate, oversampling, needed)
    if max_error is None:
        warn_of_coarse_step(dynamics, sampling_rate, oversampling)


def too_long_steps(
    dynamics: PairDynamics, sampling_rate: float, oversampling: int, needed: int
) -> StepError:
    """The refusal of steps that a machine cannot follow, with the motion that decides it.

    ``needed`` is the least number of steps per sample.
    """
    step = 1.0 / (sampling_rate * oversampling)
    frequency = float(np.abs(dynamics.stiff_rates).max()) / (2 * math.pi)
    motion = stiffest_motion(
        dynamics.system(),
        dynamics.approach_direction(),
        dynamics.mean_mesh_stiffness,
    )
    remedy = f"raise solver.oversampling to at least {needed}"
    if frequency > FASTEST_GEARS:
        remedy += f", or check mass, stiffness and damping of {motion}"
    return StepError(
        f"solver.oversampling = {oversampling} makes internal steps of {step:.3g} s, too long "
        f"for the stiffest motion, {motion} at {frequency:.4g} Hz; {remedy}"
    )


def warn_of_coarse_step(
    dynamics: PairDynamics, sampling_rate: float, oversampling: int
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
