"""Results of the verbs on drive lines, which their figures draw."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gensig.driveline.engine_dampers import DynamicRootStress, ToothLoad
from gensig.driveline.engine_line import EngineLine
from gensig.driveline.excitation.line_torques import LineTorques
from gensig.driveline.in_time import TimeResponse
from gensig.driveline.linear.forced import SteadyResponse, Waterfall
from gensig.driveline.sweep import Sweep


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseResult:
    """Forced response of a drive line: operating point, steady vibration and a run of speeds.

    ``seen`` is half the peak to peak of the speed at each toothed wheel, rad/s. In ``in_time``
    and ``sweep`` teeth may part. ``roots`` are root stresses by name: linear or in time, with
    dampers or without. ``nodes`` are those whose speed is shown.
    """

    torques: LineTorques
    response: SteadyResponse
    seen: dict[str, float]
    nodes: tuple[int, ...]
    run: tuple[Waterfall, ...]
    in_time: TimeResponse | None = None
    sweep: Sweep | None = None
    mesh: int | None = None
    roots: dict[str, DynamicRootStress] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DamperState:
    """A drive line before or after tuning its dampers.

    ``largest`` (speed,) N is the greatest tooth force over the range of speeds; the rest holds at
    the reference speed.
    """

    line: EngineLine
    largest: NDArray[np.float64]
    response: SteadyResponse
    load: ToothLoad
    root: DynamicRootStress
