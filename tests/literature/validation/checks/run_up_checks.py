"""Vibration at mesh orders over speed, of plain and modified flanks.

It stands for the noise that a paper measured.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from gensig.options.compose import compose
from gensig.papers.error_paper import SPEEDS_RPM, run_up_level
from gensig.systems.pair_machine import GearPairMachine
from gensig.systems.registry import read_system

Array = NDArray[np.float64]

GROUP = "modification="
VARIANTS = ("beihang_least_ripple", "beihang_even_load", "beihang_both")


@dataclass(frozen=True, eq=False)
class RunUpCase:
    """One machine with one modification, and the overrides that make it."""

    system: GearPairMachine
    overrides: tuple[str, ...]

    @cached_property
    def level(self) -> Array:
        """Level of the bearings at the mesh orders, (speed,) dB."""
        return run_up_level(self.system)

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
        system=read_system(compose("generate", overrides)), overrides=overrides
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
