"""The depth of wear from which a machine shakes too much: clean records of it, its flanks worn as a life wears them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gensig.errors import ConfigError, SimulationError
from gensig.faults.registry import fault_parts
from gensig.life.options import WearOptions
from gensig.life.wear.wear_case import WearCase
from gensig.life.wear.wear_life import WearLife, wear_life
from gensig.record.inputs import row_instrument, row_run, shaken
from gensig.record.machines import read_machine
from gensig.sensing.chain import power
from gensig.systems.lead_in import simulate_with_lead_in
from gensig.systems.pair_machine import PairMachine
from gensig.systems.wear import wear_fault
from gensig.units import channel_unit

Array = NDArray[np.float64]

# the first gears in the first gearbox, as gensig simulate takes them
ROW = {
    "record_id": "r0",
    "gearbox_id": "gearbox-0000",
    "specimen_id": "specimen-0000",
    "condition_id": "condition-000000",
    "start_tooth_pinion": 0,
    "start_tooth_wheel": 0,
    "start_phase": 0.0,
}
N_LOOKS = 17  # at equal shares of the life to the threshold, new flanks and its end among them
MOST_STEPS = 10  # further records between the first look that is at the limit and the one before
TOLERANCE = 2e-3  # of the life to the threshold


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WornVibration:
    """How a machine shakes as its flanks wear.

    Parameters
    ----------
    sensors : names of the channels in m/s2
    turns : (look,) of the pinion, ascending from 0
    depth : (look,) m             by the criterion of the wear
    rms : (look, sensor) m/s2     of the clean record, without its mean
    limit_depth : depth at which the limit is reached, m; None where the life to the threshold ends below it
    """

    sensors: tuple[str, ...]
    turns: Array
    depth: Array
    rms: Array
    limit_depth: float | None

    @property
    def rise(self) -> Array:
        """(look, sensor) dB over new flanks."""
        return 20.0 * np.log10(self.rms / self.rms[0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Bench:
    """The machine of a configuration, asked how it shakes with flanks worn so far."""

    config: Mapping[str, Any]
    machine: PairMachine
    case: WearCase

    @property
    def heard(self) -> list[int]:
        """Places of the sensors that tell m/s2."""
        return [k for k, name in enumerate(self.machine.sensing.channel_names) if channel_unit(name) == "m/s^2"]

    def rms(self, depths: Sequence[Array]) -> Array:
        """RMS of clean records with (2, slice, node) m off the flanks, (depth, sensor) m/s2; NaN for failed ones."""
        found = np.full((len(depths), len(self.heard)), np.nan)
        rows = [
            {**ROW, "faults_json": json.dumps(fault_parts(wear_fault(self.case, depth)) if depth.any() else [])}
            for depth in depths
        ]
        runs = [replace(row_run(self.config, self.machine, row), tell_mesh=False) for row in rows]
        for k, (run, result) in enumerate(zip(runs, simulate_with_lead_in(runs), strict=True)):
            record = shaken(self.config, ROW, run, result)
            if not isinstance(record, SimulationError):
                measured = row_instrument(self.config, self.machine, ROW).measure(record.acceleration)
                found[k] = np.sqrt(power(measured[self.heard]))
        return found


def limited_by_vibration(case: WearCase, config: Mapping[str, Any]) -> tuple[WearCase, WornVibration | None]:
    """A case whose threshold is the depth at which the machine of its configuration reaches a limit of vibration.

    The case as it was, and None, where ``wear`` sets no such limit; the case as it was where the life to its threshold
    ends below the limit.

    The flanks wear under the case's torque. At ``N_LOOKS`` times the machine is simulated with the flanks as they are
    then; between the first look at the limit or above and the one before, the root is found by Brent's method, of at
    most ``MOST_STEPS`` records. A limit that is passed and left again between two looks goes unseen.

    Raises
    ------
    ConfigError        for a limit that new flanks reach already, or without a sensor in m/s2
    SimulationError    where the machine makes no record on the way to the limit
    """
    from scipy.optimize import brentq

    options = case.options
    if options.vibration_limit_m_per_s2 is None and options.vibration_rise is None:
        return case, None
    bench = _bench(case, config)
    life = wear_life(case)
    turns = np.linspace(0.0, life.life, N_LOOKS)
    looks = bench.rms([_worn(life, turn) for turn in turns])
    told = dict(zip(turns.tolist(), looks, strict=True))
    new = looks[0]
    _require_record(case, life, 0.0, new)
    _require_below(options, new)

    def over(turn: float) -> float:
        if turn not in told:
            told[turn] = bench.rms([_worn(life, turn)])[0]
        _require_record(case, life, turn, told[turn])
        return _share_of_limit(options, told[turn], new) - 1.0

    limit_depth = None
    for before, after in zip(turns[:-1].tolist(), turns[1:].tolist(), strict=True):
        if over(after) >= 0.0:
            root = float(brentq(over, before, after, xtol=TOLERANCE * life.life, maxiter=MOST_STEPS, disp=False))
            limit_depth = case.judged(_worn(life, root))
            break
    ordered = sorted(told)
    course = WornVibration(
        sensors=tuple(bench.machine.sensing.channel_names[k] for k in bench.heard),
        turns=np.array(ordered),
        depth=np.array([case.judged(_worn(life, turn)) for turn in ordered]),
        rms=np.array([told[turn] for turn in ordered]),
        limit_depth=limit_depth,
    )
    if limit_depth is None:
        return case, course
    return replace(case, options=replace(options, threshold=limit_depth)), course


def _bench(case: WearCase, config: Mapping[str, Any]) -> _Bench:
    sound = {**config, "plan": {**config["plan"], "sham": False}}
    machine = read_machine(sound)
    machine.check()
    bench = _Bench(config=sound, machine=machine, case=case)
    if not bench.heard:
        raise ConfigError(
            f"sensing.channels = {list(machine.sensing.channels)}: a limit of the vibration is in m/s2; name an "
            "acceleration, such as pinion_y"
        )
    return bench


def _worn(life: WearLife, turn: float) -> Array:
    """Depth off both flanks after so many turns, (2, slice, node) m."""
    place = float(np.interp(turn, life.turns, np.arange(len(life.turns))))
    low = min(int(place), len(life.turns) - 2)
    return life.depth[low] + (place - low) * (life.depth[low + 1] - life.depth[low])


def _share_of_limit(options: WearOptions, rms: Array, new: Array) -> float:
    """The loudest sensor over the limit, or the one that rose most over the rise; the larger where both are set."""
    shares = []
    if options.vibration_limit_m_per_s2 is not None:
        shares.append(float(rms.max()) / options.vibration_limit_m_per_s2)
    if options.vibration_rise is not None:
        shares.append(float((rms / new).max()) / 10.0 ** (options.vibration_rise / 20.0))
    return max(shares)


def _require_below(options: WearOptions, new: Array) -> None:
    limit = options.vibration_limit_m_per_s2
    if limit is not None and new.max() >= limit:
        raise ConfigError(
            f"wear.vibration_limit_m_per_s2 = {limit:g} is reached by new flanks already: theirs is "
            f"{new.max():.4g} m/s2 RMS; give more"
        )


def _require_record(case: WearCase, life: WearLife, turn: float, rms: Array) -> None:
    if np.isnan(rms).any():
        raise SimulationError(
            f"worn {case.judged(_worn(life, turn)) * 1e6:.4g} um deep, the machine makes no record, and no limit was "
            "reached before; give a smaller wear.threshold_um"
        )
