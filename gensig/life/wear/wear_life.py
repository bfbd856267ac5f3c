"""Life of worn flanks: wear step by step up to a threshold, with renewed sharing and pressure."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError, SimulationError
from gensig.life.wear.wear_case import WearCase

# Error of the solver in one step, as a share of the depth and in m. Pressures depend on the
# curvature of the worn profile, which takes a tenth. That makes the equations stiff: they are
# solved backwards, with neighbouring nodes coupled.
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
    """Life of a pair under a steady torque.

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
    horizon = HORIZON * at_first_rate
    solution = _solve(case, case.new_flanks(), horizon, ends=ends, dense_output=True)
    if solution.status != 1:
        raise SimulationError(
            f"the flanks do not wear to the threshold in {horizon:.4g} turns: "
            f"{solution.message}"
        )
    turns = np.linspace(0.0, float(solution.t[-1]), N_SNAPSHOTS)
    depth = np.stack([_depth(case, solution.sol(turn)) for turn in turns])
    ended_by = "depth"
    if len(ends) == 2 and len(solution.t_events[1]) > 0:
        ended_by = "transmission_error"
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
    """Depth off both flanks at given turns of the pinion, whatever the threshold.

    Parameters
    ----------
    turns : (time,) of the pinion from ``start`` on, not falling
    torque : (time,) N m    of the interval that ends at each; None for that of the case
    start : (2, slice, node) m    initial depth; None for new flanks

    Returns
    -------
    (time, 2, slice, node) m

    Raises
    ------
    ConfigError    for turns that fall, or a torque that is not positive or not one for each
    """
    turns = np.asarray(turns, dtype=np.float64)
    if turns.ndim != 1 or not np.isfinite(turns).all() or not _never_falls(turns):
        raise ConfigError(
            "the turns of a life must be a row of numbers that never falls, from 0 on"
        )
    depth = case.new_flanks() if start is None else np.array(start, dtype=np.float64)
    if torque is None:
        return _depth_at(case, depth, turns)
    if np.shape(torque) != turns.shape:
        raise ConfigError(
            f"{np.size(torque)} torques for {len(turns)} times of a life; "
            "give one for each"
        )
    depths = []
    for interval, load in zip(np.diff(turns, prepend=0.0), torque, strict=True):
        loaded = case.with_torque(float(load))
        depth = _depth_at(loaded, depth, np.array([interval]))[0]
        depths.append(depth)
    return np.stack(depths)


def _never_falls(turns: Array) -> bool:
    return not (np.diff(turns, prepend=0.0) < 0.0).any()


def _depth_at(case: WearCase, start: Array, turns: Array) -> Array:
    """Depth at each of ``turns`` under one torque, (time, 2, slice, node) m."""
    if not case.follows_wear or not turns.any():
        return start + turns[:, None, None, None] * case.rate(start)
    times, index = np.unique(turns, return_inverse=True)
    solution = _solve(case, start, float(times[-1]), t_eval=times)
    if solution.status != 0:
        raise SimulationError(
            "the flanks wear to where their wear cannot be followed: "
            f"{solution.message}"
        )
    return np.stack([_depth(case, flat) for flat in solution.y.T])[index]


def _solve(
    case: WearCase,
    start: Array,
    end: float,
    *,
    ends: Sequence[Callable[[Array], float]] = (),
    **outputs: Any,
) -> Any:
    """Depths as an initial value problem over the turns of the pinion.

    They go from ``start`` at 0 to ``end``, or to the first of ``ends``.
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
    step = min(case.options.step, LARGEST_SHARE * case.options.threshold)
    longest = step / float(case.rate(start).max())
    method: dict[str, Any] = {"method": "RK23"}  # Bogacki & Shampine
    if case.options.rule != "band":
        method = {"method": "LSODA", "lband": BANDWIDTH, "uband": BANDWIDTH}
    return solve_ivp(
        rate,
        (0.0, end),
        _flat(start),
        max_step=longest,
        first_step=min(0.01 * longest, end),
        rtol=relative,
        atol=absolute,
        events=[event(reached) for reached in ends],
        **method,
        **outputs,
    )


def _flat(depth: Array) -> Array:
    """Both gears side by side, node by node: what acts on each other is near each other."""
    return np.moveaxis(depth, 0, 2).ravel()


def _depth(case: WearCase, flat: Array) -> Array:
    gears, slices, nodes = case.shape
    return np.maximum(np.moveaxis(flat.reshape(slices, nodes, gears), 2, 0), 0.0)
