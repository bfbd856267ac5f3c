"""Flanks over their life.

Wear step by step, sharing and pressure renewed as they wear, up to a threshold.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError, SimulationError
from gensig.life.wear.wear_case import WearCase

Array = NDArray[np.float64]

# What the solver may be off in one step, as a share of the depth and in m. Pressures hang on the
# curvature of what is
# worn off, which takes a tenth, and makes the equations stiff: they are solved backwards, with
# the nodes next to each.
ACCURACY = {"band": (1e-3, 2e-9), "fixed_intervals": (1e-3, 1e-9)}
BANDWIDTH = 13
LARGEST_SHARE = 0.1  # of the threshold, worn in one step
# times the life at the rate of new flanks: sharing slows wear down, but never so much
HORIZON = 50.0
N_SNAPSHOTS = 41


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WearLife:
    """A life from new flanks to its end.

    Parameters
    ----------
    turns : (time,) of the pinion, equally spaced; the last is the life
    depth : (time, 2, slice, node) m    off pinion and wheel, normal to the flank
    ended_by : ``depth`` or ``transmission_error``
    n_steps : steps that the solution took
    """

    case: WearCase
    turns: Array
    depth: Array
    ended_by: str
    n_steps: int

    @property
    def life(self) -> float:
        """Turns of the pinion."""
        return float(self.turns[-1])

    @property
    def threshold(self) -> float:
        """Depth at the end by the case's criterion, m: the threshold, given or found."""
        return self.case.judged(self.depth[-1])


def hours(turns: float, speed: float) -> float:
    """Hours that so many turns take at a speed in rad/s."""
    return turns * 2.0 * math.pi / speed / 3600.0


def wear_life(case: WearCase) -> WearLife:
    """The life of a pair under a steady torque.

    Raises
    ------
    ConfigError    for a limit of the transmission error that new flanks reach already
    SimulationError    if the end is not reached
    """
    options = case.options
    rate = case.rate(case.new_flanks())
    at_first_rate = options.threshold / case.judged(rate)
    if not case.follows_wear:
        turns = np.linspace(0.0, at_first_rate, N_SNAPSHOTS)
        return WearLife(
            case=case,
            turns=turns,
            depth=turns[:, None, None, None] * rate,
            ended_by="depth",
            n_steps=1,
        )
    ends: list[Callable[[Array], float]] = [
        lambda depth: case.judged(depth) / options.threshold - 1.0
    ]
    limit = options.transmission_error_limit
    if limit is not None:
        least = case.error_range(case.new_flanks())
        if least >= limit:
            raise ConfigError(
                f"wear.transmission_error_limit_um = {limit * 1e6:g} is reached by new flanks "
                "already: theirs is "
                f"{least * 1e6:.4g} um from peak to peak; give more"
            )
        ends.append(lambda depth: case.error_range(depth) / limit - 1.0)
    solution = _solve(
        case, case.new_flanks(), HORIZON * at_first_rate, ends=ends, dense_output=True
    )
    if solution.status != 1:
        raise SimulationError(
            f"the flanks do not wear to the threshold in {HORIZON * at_first_rate:.4g} turns: "
            f"{solution.message}"
        )
    turns = np.linspace(0.0, float(solution.t[-1]), N_SNAPSHOTS)
    depth = np.stack([_depth(case, solution.sol(turn)) for turn in turns])
    by_error = len(ends) == 2 and len(solution.t_events[1]) > 0
    ended_by = "transmission_error" if by_error else "depth"
    return WearLife(
        case=case,
        turns=turns,
        depth=depth,
        ended_by=ended_by,
        n_steps=len(solution.t) - 1,
    )


def worn_flanks(
    case: WearCase,
    turns: Array,
    *,
    torque: Array | None = None,
    start: Array | None = None,
) -> Array:
    """Depth off both flanks after so many turns of the pinion, whatever the threshold.

    Parameters
    ----------
    turns : (time,) of the pinion from ``start`` on, not falling
    torque : (time,) N m    of the time that ends at each, from the one before (the first: from 0);
        None is the case's own throughout
    start : (2, slice, node) m    what is off already; None is nothing

    Returns
    -------
    (time, 2, slice, node) m

    Raises
    ------
    ConfigError    for turns that fall, or a torque that is not positive or not one for each
    """
    turns = np.asarray(turns, dtype=np.float64)
    if (
        turns.ndim != 1
        or not np.isfinite(turns).all()
        or (np.diff(turns, prepend=0.0) < 0.0).any()
    ):
        raise ConfigError(
            "the turns of a life must be a row of numbers that never falls, from 0 on"
        )
    depth = case.new_flanks() if start is None else np.array(start, dtype=np.float64)
    if torque is None:
        return _depth_at(case, depth, turns)
    if np.shape(torque) != turns.shape:
        raise ConfigError(
            f"{np.size(torque)} torques for {len(turns)} times of a life; give one for each"
        )
    found = np.empty((len(turns), *case.shape))
    for k, stretch in enumerate(np.diff(turns, prepend=0.0)):
        depth = found[k] = _depth_at(
            case.under(float(torque[k])), depth, np.array([stretch])
        )[0]
    return found


def _depth_at(case: WearCase, start: Array, turns: Array) -> Array:
    """Depth at each of ``turns`` under one torque, (time, 2, slice, node) m."""
    if not case.follows_wear or not turns.any():
        return start + turns[:, None, None, None] * case.rate(start)
    times, place = np.unique(turns, return_inverse=True)
    solution = _solve(case, start, float(times[-1]), t_eval=times)
    if solution.status != 0:
        raise SimulationError(
            f"the flanks wear to where their wear cannot be followed: {solution.message}"
        )
    return np.stack([_depth(case, flat) for flat in solution.y.T])[place]


def _solve(
    case: WearCase,
    start: Array,
    end: float,
    *,
    ends: list[Callable[[Array], float]] | None = None,
    **more: Any,
) -> Any:
    """The depths as an initial value problem over the turns of the pinion from 0 to ``end``, or
    to the first end.
    """
    from scipy.integrate import solve_ivp

    def rate(_turns: float, flat: Array) -> Array:
        return _flat(case.rate(_depth(case, flat)))

    def event(reached: Callable[[Array], float]) -> Callable[[float, Array], float]:
        def function(_turns: float, flat: Array) -> float:
            return reached(_depth(case, flat))

        function.terminal, function.direction = True, 1.0  # type: ignore[attr-defined]
        return function

    relative, absolute = ACCURACY[case.options.rule]
    longest = min(case.options.step, LARGEST_SHARE * case.options.threshold) / float(
        case.rate(start).max()
    )
    if case.options.rule == "band":
        method: dict[str, Any] = {"method": "RK23"}  # Bogacki & Shampine
    else:
        method = {"method": "LSODA", "lband": BANDWIDTH, "uband": BANDWIDTH}
    return solve_ivp(
        rate,
        (0.0, end),
        _flat(start),
        max_step=longest,
        first_step=min(0.01 * longest, end),
        rtol=relative,
        atol=absolute,
        events=[event(reached) for reached in ends or ()],
        **method,
        **more,
    )


def _flat(depth: Array) -> Array:
    """Both gears side by side, node by node: what acts on each other is near each other."""
    return np.moveaxis(depth, 0, 2).ravel()


def _depth(case: WearCase, flat: Array) -> Array:
    gears, slices, nodes = case.shape
    return np.maximum(np.moveaxis(flat.reshape(slices, nodes, gears), 2, 0), 0.0)
