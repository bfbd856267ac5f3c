"""Firing of the cylinders of an engine: banks, throws of the crank and the firing order."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gensig.errors import ConfigError
from gensig.units import unit

TURN = 2.0 * math.pi
TOGETHER = math.radians(0.01)


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """Cylinders named by bank and throw: ``A1`` is that of bank A on throw 1.

    ``throw_angles`` (throw,) are the crank angles at which each throw's piston of the first bank
    is at top dead center (modulo a turn), ``bank_angles`` (bank,) those by which each bank comes
    after the first. A four-stroke engine: every cylinder fires once in two turns.
    """

    banks: tuple[str, ...]
    bank_angles: tuple[float, ...] = unit("deg")
    throw_angles: tuple[float, ...] = unit("deg")
    firing_order: tuple[str, ...]

    def __post_init__(self) -> None:
        if not self.banks or len(set(self.banks)) != len(self.banks):
            raise ConfigError(
                f"excitation.layout.banks = {', '.join(self.banks)}: name at least "
                "one bank, each once"
            )
        if len(self.bank_angles) != len(self.banks):
            raise ConfigError(
                f"excitation.layout.bank_angles_deg has {len(self.bank_angles)} "
                f"values for {len(self.banks)} banks"
            )
        if not self.throw_angles:
            raise ConfigError(
                "excitation.layout.throw_angles_deg is empty; give one angle for every throw"
            )
        known = self.cylinders
        for position, name in enumerate(self.firing_order):
            if name not in known:
                raise ConfigError(
                    f"excitation.layout.firing_order: no cylinder {name!r} (place "
                    f"{position + 1}); there are "
                    f"{known[0]} to {known[-1]}"
                )
            if name in self.firing_order[:position]:
                first = self.firing_order.index(name) + 1
                raise ConfigError(
                    f"excitation.layout.firing_order repeats {name} (places {first} "
                    f"and {position + 1}); "
                    "every cylinder fires once a cycle"
                )
        if missing := [name for name in known if name not in self.firing_order]:
            raise ConfigError(
                f"excitation.layout.firing_order lacks {', '.join(missing)}; every "
                "cylinder fires once"
            )
        self._check_turns()

    @property
    def cylinders(self) -> tuple[str, ...]:
        """Names, bank by bank."""
        return tuple(
            f"{bank}{throw + 1}"
            for bank in self.banks
            for throw in range(len(self.throw_angles))
        )

    def throw(self, cylinder: str) -> int:
        """Index of a cylinder's throw."""
        return self.cylinders.index(cylinder) % len(self.throw_angles)

    def dead_center(self, cylinder: str) -> float:
        """Crank angle at a cylinder's top dead center, rad in 0..2 pi."""
        bank, throw = divmod(self.cylinders.index(cylinder), len(self.throw_angles))
        return (self.bank_angles[bank] + self.throw_angles[throw]) % TURN

    def firing_angles(self) -> dict[str, float]:
        """Crank angle at which each cylinder fires, rad from 0 to 4 pi, in the firing order.

        Each fires at its first top dead center after the cylinder before it; the first fires in
        the first turn.
        """
        angle, angles = self.dead_center(self.firing_order[0]), {}
        for name, gap in zip(self.firing_order, self._gaps(), strict=True):
            angles[name] = angle % (2.0 * TURN)
            angle += gap
        return angles

    def _gaps(self) -> list[float]:
        """Crank angle from each firing to the next, rad.

        A turn where the next is on the same top dead center.
        """
        if len(self.firing_order) == 1:
            return [2.0 * TURN]
        centers = [self.dead_center(name) for name in self.firing_order]
        gaps = np.roll(centers, -1) - centers
        gaps %= TURN
        gaps[np.minimum(gaps, TURN - gaps) < TOGETHER] = TURN
        return [float(gap) for gap in gaps]

    def _check_turns(self) -> None:
        """Refuse cylinders that fire together, and orders that these throws cannot fire in two
        turns.
        """
        gaps = self._gaps()
        total = sum(gaps)
        same = [position for position, gap in enumerate(gaps) if gap == TURN]
        if abs(total - 2.0 * TURN) <= TOGETHER:
            return
        if same and abs(total - len(same) * TURN - 2.0 * TURN) <= TOGETHER:
            names = [
                self.firing_order[position % len(gaps)]
                for position in (same[0], same[0] + 1)
            ]
            raise ConfigError(
                f"excitation.layout: {' and '.join(names)} fire together with these "
                "bank_angles_deg and "
                "throw_angles_deg; change one of them or the firing order"
            )
        raise ConfigError(
            f"excitation.layout.firing_order takes {math.degrees(total):.6g} degrees "
            "with these throw and bank "
            "angles; a four-stroke engine fires every cylinder once in 720"
        )
