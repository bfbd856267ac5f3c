"""Novelty as a comparator: distance from the healthy recordings, without any simulation."""

from __future__ import annotations

from collections.abc import Sequence

from diagnose.bridge.bridge_machine import BridgeMachine
from diagnose.bridge.bridge_scores import Answers
from diagnose.bridge.implanted_windows import Stretch


def distance_answers(
    machine: BridgeMachine, healthy: Sequence[Stretch], judged: Sequence[Stretch]
) -> tuple[Answers | None, str]:
    """Distance of each recording, or the reason why there is none."""
    return None, "not yet"
