"""What of a fault the other flank of the same tooth feels: an idler is driven on one and drives with the other."""

from __future__ import annotations

from dataclasses import replace

from gensig.faults.base import Fault
from gensig.faults.broken import BrokenTooth, ChippedTooth, MissingTooth
from gensig.faults.crack import Crack

SIDES = {"tension": "compression", "compression": "tension"}


def on_other_flank(fault: Fault) -> Fault | None:
    """The fault for loads on the flank that does not carry it, None where they do not feel it.

    What is broken off is gone from both flanks; the root crack that one load pulls open the other presses together.
    Pits, wear and what was ground or measured on a flank stay with it.
    """
    if isinstance(fault, MissingTooth | BrokenTooth | ChippedTooth):
        return fault
    if isinstance(fault, Crack):
        return replace(fault, crack_side=SIDES[fault.crack_side])
    return None
