"""Pitch errors from the sidebands of the mesh.

Their strength over the mesh is compared with that of simulations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gensig.arrays import Array
from gensig.errors import SimulationError
from gensig.sensing.manufacturing import draw_specimen
from gensig.signals.mesh_motion import Teeth
from gensig.signals.transfer.order_lines import Lines, find_lines
from gensig.systems.base import Machine, simulate_together
from gensig.systems.run import CleanRecord, Run, Start

GRADES = (1.0, 3.0, 5.0, 7.0, 9.0, 11.0)
N_SPECIMENS = 6  # sets of gears simulated at each grade
N_SIDEBANDS = 3  # on either side of a harmonic, of each shaft
N_HARMONICS = 10
AUDIBLE = 4.0  # a harmonic counts where it is this many times its floor


@dataclass(frozen=True, slots=True, kw_only=True)
class Grade:
    """ISO 1328 grade at which simulated sidebands are as strong as measured ones.

    90 % of the simulated sets of gears agree with the measurement between ``low`` and ``high``.
    ``ratio_db`` is the median over sensors and harmonics of sideband over mesh power,
    ``n_ratios`` their number. ``is_bounded`` is False where no grade gives the measurement, or
    there are no ratios.
    """

    grade: float
    low: float
    high: float
    ratio_db: float
    n_ratios: int
    is_bounded: bool


def sideband_orders(teeth: Teeth, harmonic: int) -> Array:
    """Mesh orders of the sidebands of a harmonic, each once, (line,)."""
    steps = np.arange(1, N_SIDEBANDS + 1)
    positive = np.concatenate([steps / n for n in (teeth.driving, teeth.driven)])
    offsets = np.concatenate([-positive, positive])
    return harmonic + np.unique(np.round(offsets, 9))


def sideband_ratios(lines: Lines, teeth: Teeth) -> Array:
    """Power of the sidebands over that of the mesh line, (sensor, harmonic) dB.

    NaN where the mesh is not visible. A transfer path that changes little between neighbours on
    the frequency axis does not change their ratio.
    """
    highest = float(lines.frequency[-1]) / lines.mesh_frequency
    ratios = np.full((len(lines.power), N_HARMONICS), np.nan)
    for harmonic in range(1, N_HARMONICS + 1):
        sidebands = sideband_orders(teeth, harmonic)
        if sidebands[-1] > 0.78 * highest:  # the end of the usable band
            break
        mesh = lines.at(np.array([float(harmonic)]))[:, 0]
        around = lines.at(sidebands).sum(axis=1)
        floor = lines.floor[:, round(harmonic * lines.n_cycles)]
        heard = (mesh > AUDIBLE * floor) & (around > floor)
        ratios[heard, harmonic - 1] = 10.0 * np.log10(around[heard] / mesh[heard])
    return ratios


def simulated_records(
    system: Machine, grades: Sequence[float], n_specimens: int, seed: int
) -> list[list[CleanRecord]]:
    """Healthy records of the simulated bearing, by grade and specimen.

    The specimens are the same for every grade.

    Raises
    ------
    SimulationError    where no record stays finite
    """
    pair, runs = system.pair, []
    teeth = Teeth(driving=pair.pinion.n_teeth, driven=pair.wheel.n_teeth)
    for grade in grades:
        quality = replace(system.quality, iso1328_grade=grade)
        for number in range(n_specimens):
            rng = np.random.default_rng([seed, number])
            start = Start(
                tooth_pinion=int(rng.integers(teeth.driving)),
                tooth_wheel=int(rng.integers(teeth.driven)),
                phase=float(rng.random()),
            )
            specimen = draw_specimen(rng, pair.pinion, pair.wheel, quality)
            runs.append(Run(system=system, faults=(), start=start, specimen=specimen))
    records = iter(simulate_together(runs))
    return [[_finite(next(records)) for _ in range(n_specimens)] for _ in grades]


def _finite(record: CleanRecord | SimulationError) -> CleanRecord:
    if isinstance(record, SimulationError):
        raise record
    return record


def simulated_lines(record: CleanRecord, system: Machine) -> Lines:
    """Lines of a simulated record, whose angle is known."""
    teeth = Teeth(driving=system.pair.pinion.n_teeth, driven=system.pair.wheel.n_teeth)
    cycles = record.shaft_angle * teeth.driving / (2.0 * np.pi)
    return find_lines(record.acceleration, cycles, system.sensing.sampling_rate, teeth)


def fit_grade(
    measured: Lines, simulated: Sequence[Sequence[Lines]], teeth: Teeth
) -> Grade:
    """Grade with a median difference of zero between measured and simulated ratios.

    Parameters
    ----------
    simulated : (grade, specimen)    lines of simulated records of ``GRADES``
    """
    ratios = sideband_ratios(measured, teeth)
    n_ratios = int(np.isfinite(ratios).sum())
    # (grade, specimen): by how much sidebands of a simulated set of gears are stronger
    excess = np.array(
        [
            [median_of_finite(sideband_ratios(lines, teeth) - ratios) for lines in row]
            for row in simulated
        ]
    )
    if n_ratios == 0 or not np.all(np.isfinite(excess)):
        middle = GRADES[len(GRADES) // 2 - 1]
        return Grade(
            grade=middle,
            low=GRADES[0],
            high=GRADES[-1],
            ratio_db=np.nan,
            n_ratios=0,
            is_bounded=False,
        )
    least, median, most = np.quantile(excess, [0.05, 0.5, 0.95], axis=1)
    grade, low, high = (_crossing(curve) for curve in (median, most, least))
    return Grade(
        grade=grade,
        low=low,
        high=high,
        ratio_db=float(np.nanmedian(ratios)),
        n_ratios=n_ratios,
        is_bounded=bool(median[0] < 0.0 < median[-1]),
    )


def median_of_finite(values: Array) -> float:
    """Median of the finite values; NaN without any."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return np.nan
    return float(np.median(finite))


def _crossing(excess: Array) -> float:
    """Grade at which a curve that rises with the grade passes zero, within ``GRADES``."""
    rising = np.maximum.accumulate(excess) + 1e-9 * np.arange(len(excess))
    return float(np.interp(0.0, rising, GRADES))
