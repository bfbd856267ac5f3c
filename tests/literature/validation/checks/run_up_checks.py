"""Vibration at mesh orders over speed, of plain and modified flanks.

It stands for the noise that a paper measured.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from gensig.dynamics.response import accelerations
from gensig.options.compose import compose
from gensig.sensing.manufacturing import nominal_gearbox, perfect_specimen
from gensig.systems.helical_pair import HelicalPair
from gensig.systems.pair_machine import pair_dynamics
from gensig.systems.registry import read_helical_pair
from gensig.systems.run import Run
from gensig.units import to_si

Array = NDArray[np.float64]

GROUP = "modification="
VARIANTS = ("beihang_least_ripple", "beihang_even_load", "beihang_both")
SPEEDS_RPM = np.arange(250.0, 5001.0, 50.0)
N_ORDERS = 3  # of the mesh frequency, up to 15 kHz at the highest speed
CHANNELS = ("pinion_y", "pinion_z", "wheel_y", "wheel_z")


@dataclass(frozen=True, eq=False)
class RunUpCase:
    """One machine with one modification, and the overrides that make it."""

    system: HelicalPair
    overrides: tuple[str, ...]

    @cached_property
    def level(self) -> Array:
        """Mean square acceleration of the bearings at the mesh orders, (speed,) dB.

        The static transmission error at the mean load pushes the linear machine with the mesh's
        mean stiffness.
        """
        system = self.system
        gears = system.pair.pinion, system.pair.wheel
        run = Run(
            system=system,
            faults=(),
            specimen=perfect_specimen(*gears),
            gearbox=nominal_gearbox(len(CHANNELS)),
        )
        dynamics = pair_dynamics(run)
        amplitude = system.flanks.transmission_error().harmonics[:N_ORDERS]
        order, speed = np.arange(1, N_ORDERS + 1), to_si("speed_rpm", 1.0) * SPEEDS_RPM
        frequency = np.outer(speed, order * system.pair.pinion.n_teeth).ravel()
        push = dynamics.mean_mesh_stiffness * np.tile(amplitude, len(speed))
        force = np.asarray(
            push[:, None] * dynamics.approach_direction(), dtype=np.complex128
        )
        felt = accelerations(dynamics, frequency, force)[
            :, [dynamics.dofs.index(name) for name in CHANNELS]
        ]
        return 10.0 * np.log10(
            (np.abs(felt) ** 2).reshape(len(speed), -1).sum(axis=1) / 2.0
        )

    def beside(self, variant: str | None) -> RunUpCase:
        """The same machine with another modification; None: with plain flanks."""
        others = tuple(word for word in self.overrides if not word.startswith(GROUP))
        if variant is not None:
            others = *others, GROUP + variant
        return read_run_up_case(others)


@lru_cache(maxsize=32)
def read_run_up_case(overrides: tuple[str, ...]) -> RunUpCase:
    """Compose the machine of a row."""
    return RunUpCase(
        system=read_helical_pair(compose("generate", overrides)), overrides=overrides
    )


def _within(at: str) -> NDArray[np.bool_]:
    low, high = (float(word) for word in at.split("_"))
    return np.asarray((low <= SPEEDS_RPM) & (high >= SPEEDS_RPM))


def _change(reduce: Callable[[Array], float]) -> Callable[[RunUpCase, str], float]:
    return lambda case, at: float(
        reduce((case.level - case.beside(None).level)[_within(at)])
    )


def _behind_the_best(case: RunUpCase, at: str) -> float:
    """Mean level over some speeds less that of the best other variant, dB."""
    mine = next(
        word.removeprefix(GROUP) for word in case.overrides if word.startswith(GROUP)
    )
    mean = {
        name: float(case.beside(name).level[_within(at)].mean()) for name in VARIANTS
    }
    return mean[mine] - min(value for name, value in mean.items() if name != mine)


RUN_UP: dict[str, Callable[[RunUpCase, str], float]] = {
    "run_up.largest_change": _change(np.max),
    "run_up.mean_change": _change(np.mean),
    "run_up.behind_the_best": _behind_the_best,
}
