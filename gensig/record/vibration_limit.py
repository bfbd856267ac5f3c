"""Depth of wear at which the vibration of a machine reaches a limit."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array
from gensig.errors import ConfigError, SimulationError
from gensig.faults.registry import fault_parts, read_faults
from gensig.life.options import WearOptions
from gensig.life.wear.wear_case import WearCase
from gensig.life.wear.wear_life import WearLife, wear_life
from gensig.record.inputs import InputReader, RecordInputs, simulate_motions
from gensig.sensing.chain import power
from gensig.systems.base import Machine
from gensig.systems.wear import OF_PAIR, wear_fault
from gensig.units import channel_unit

# the first gears in the first gearbox, as gensig simulate takes them
ROW = {
    "record_id": "r0",
    "gearbox_id": "gearbox-0000",
    "specimen_id": "specimen-0000",
    "condition_id": "condition-000000",
    "start_tooth_pinion": 0,
    "start_tooth_wheel": 0,
    "start_phase": 0.0,
    "faults_json": "[]",
}
N_LOOKS = 17  # at equal shares of the life to the threshold, new flanks and its end among them
MOST_STEPS = 10  # further records between the two looks around the limit
TOLERANCE = 2e-3  # of the life to the threshold


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WornVibration:
    """Vibration of a machine over the wear of its flanks.

    Parameters
    ----------
    sensors : names of the channels in m/s2
    turns : (look,) of the pinion, ascending from 0
    depth : (look,) m             by the criterion of the wear
    rms : (look, sensor) m/s2     of the clean record, without its mean
    limit_depth : depth at which the limit is reached, m; None where the life to the threshold ends
        below it
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
    """Measures the vibration of a healthy machine whose flanks are worn to given depths."""

    sound: RecordInputs
    case: WearCase
    gears: Mapping[str, str]

    @property
    def machine(self) -> Machine:
        """The machine that is measured."""
        return self.sound.machine

    @property
    def sensors(self) -> list[int]:
        """Numbers of the sensors that give m/s2."""
        names = self.machine.sensing.channel_names
        return [k for k, name in enumerate(names) if channel_unit(name) == "m/s^2"]

    def rms(self, depths: Sequence[Array]) -> Array:
        """RMS of clean records with (2, slice, node) m off the flanks, (depth, sensor) m/s2.

        NaN for failed ones.
        """
        levels = np.full((len(depths), len(self.sensors)), np.nan)
        motions = simulate_motions([self._worn_by(depth) for depth in depths])
        for k, motion in enumerate(motions):
            if not isinstance(motion, SimulationError):
                measured = self.sound.instrument.measure(motion.acceleration)
                levels[k] = np.sqrt(power(measured[self.sensors]))
        return levels

    def _worn_by(self, depth: Array) -> RecordInputs:
        """The same record with flanks worn to a depth.

        Its fault passes through text as those of a plan do.
        """
        if not depth.any():
            return self.sound
        worn = wear_fault(self.case, depth, self.gears)
        parts = json.loads(json.dumps(fault_parts(worn)))
        faults = [fault for part in parts for fault in read_faults(part, "faults_json")]
        return replace(self.sound, run=replace(self.sound.run, faults=tuple(faults)))


def limited_by_vibration(
    case: WearCase, reader: InputReader, gears: Mapping[str, str] = OF_PAIR
) -> tuple[WearCase, WornVibration | None]:
    """The case with the depth of a limit of vibration as threshold, and the measured course.

    The case as it was, and None, where ``wear`` sets no such limit; the case as it was where the
    life to its threshold ends below the limit.

    ``gears`` are as in ``wear_fault``. The flanks wear under the case's torque. At ``N_LOOKS``
    times the machine is simulated with the flanks as they are then; between the first look at the
    limit or above and the one before, the root is found by Brent's method, of at most
    ``MOST_STEPS`` records. A limit that is passed and left again between two looks goes unseen.

    Raises
    ------
    ConfigError        for a limit that new flanks reach already, or without a sensor in m/s2
    SimulationError    where the machine makes no record on the way to the limit
    """
    from scipy.optimize import brentq

    options = case.options
    if options.vibration_limit_m_per_s2 is None and options.vibration_rise is None:
        return case, None
    bench = _bench(case, reader, gears)
    life = wear_life(case)
    turns = np.linspace(0.0, life.life, N_LOOKS)
    looks = bench.rms([_worn(life, turn) for turn in turns])
    measured = dict(zip(turns.tolist(), looks, strict=True))
    new = looks[0]
    _require_record(case, life, 0.0, new)
    _require_below(options, new)

    def over(turn: float) -> float:
        if turn not in measured:
            measured[turn] = bench.rms([_worn(life, turn)])[0]
        _require_record(case, life, turn, measured[turn])
        return _share_of_limit(options, measured[turn], new) - 1.0

    limit_depth = None
    for before, after in zip(turns[:-1].tolist(), turns[1:].tolist(), strict=True):
        if over(after) >= 0.0:
            tolerance = TOLERANCE * life.life
            root = brentq(
                over, before, after, xtol=tolerance, maxiter=MOST_STEPS, disp=False
            )
            limit_depth = case.judged(_worn(life, float(root)))
            break
    ordered = sorted(measured)
    names = bench.machine.sensing.channel_names
    course = WornVibration(
        sensors=tuple(names[k] for k in bench.sensors),
        turns=np.array(ordered),
        depth=np.array([case.judged(_worn(life, turn)) for turn in ordered]),
        rms=np.array([measured[turn] for turn in ordered]),
        limit_depth=limit_depth,
    )
    if limit_depth is None:
        return case, course
    return replace(case, options=replace(options, threshold=limit_depth)), course


def _bench(case: WearCase, reader: InputReader, gears: Mapping[str, str]) -> _Bench:
    sound = reader.inputs(ROW).without_faults()
    sound.machine.check()
    bench = _Bench(sound=sound, case=case, gears=gears)
    if not bench.sensors:
        raise ConfigError(
            f"sensing.channels = {list(bench.machine.sensing.channels)}: a limit of the "
            "vibration is in m/s2; name an acceleration, such as pinion_y"
        )
    return bench


def _worn(life: WearLife, turn: float) -> Array:
    """Depth off both flanks after so many turns, (2, slice, node) m."""
    step = float(np.interp(turn, life.turns, np.arange(len(life.turns))))
    low = min(int(step), len(life.turns) - 2)
    return life.depth[low] + (step - low) * (life.depth[low + 1] - life.depth[low])


def _share_of_limit(options: WearOptions, rms: Array, new: Array) -> float:
    """The loudest sensor over the limit, or the one that rose most over the rise.

    The larger where both are set.
    """
    shares = []
    if options.vibration_limit_m_per_s2 is not None:
        shares.append(float(rms.max()) / options.vibration_limit_m_per_s2)
    if options.vibration_rise is not None:
        shares.append(
            float((rms / new).max()) / 10.0 ** (options.vibration_rise / 20.0)
        )
    return max(shares)


def _require_below(options: WearOptions, new: Array) -> None:
    limit = options.vibration_limit_m_per_s2
    if limit is not None and new.max() >= limit:
        raise ConfigError(
            f"wear.vibration_limit_m_per_s2 = {limit:g} is reached by new flanks already: theirs "
            f"is {new.max():.4g} m/s2 RMS; give more"
        )


def _require_record(case: WearCase, life: WearLife, turn: float, rms: Array) -> None:
    if np.isnan(rms).any():
        raise SimulationError(
            f"worn {case.judged(_worn(life, turn)) * 1e6:.4g} um deep, the machine makes no "
            "record, and no limit was reached before; give a smaller wear.threshold_um"
        )
