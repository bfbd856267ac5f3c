"""Novelty as a comparator: distance from the healthy recordings, without any simulation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnose.bridge.bridge_machine import BridgeMachine
from diagnose.bridge.bridge_scores import Answers
from diagnose.bridge.implanted_windows import Stretch
from diagnose.bridge.rules import like_healthy
from diagnose.detection.finding import Finding
from diagnose.detection.followed_shafts import FollowedRecording, follow_shafts
from diagnose.detection.gear_stages import GearStages
from diagnose.detection.healthy_machine import HealthyMachine
from gensig.errors import ConfigError


def distance_answers(
    machine: BridgeMachine, healthy: Sequence[Stretch], judged: Sequence[Stretch]
) -> tuple[Answers | None, str]:
    """Distance of each recording, NaN for one that cannot be followed.

    Parameters
    ----------
    healthy : stretches that may be learnt from
    judged : stretches to answer for

    Returns
    -------
    answers : None where nothing can be learnt or judged
    reason : of what is left out, empty where nothing is
    """
    stages = GearStages(pairs=machine.train.stages)
    reasons: list[str] = []
    followed = [_followed(one, stages, reasons) for one in healthy]
    asked = [_followed(one, stages, reasons) for one in judged]
    learnt = [one for one in followed if one is not None]
    known_asked = [one for one in asked if one is not None]
    if not learnt or not known_asked:
        return None, reasons[0]
    shortest = min(known_asked, key=lambda one: one.n_turns)
    try:
        known = HealthyMachine.fit_followed(learnt, stages, shortest=shortest)
        findings = [
            None if one is None else _finding(known, one, stretch, healthy)
            for one, stretch in zip(asked, judged, strict=True)
        ]
    except ConfigError as error:
        return None, str(error)
    answers = Answers(
        predicted=None,
        faulty=np.array([[np.nan if one is None else one.score for one in findings]]),
        alarm=np.array([one is not None and one.is_changed for one in findings]),
    )
    if not reasons:
        return answers, ""
    return answers, f"{len(reasons)} stretch(es) are left out of it: {reasons[0]}"


def _followed(
    stretch: Stretch, stages: GearStages, reasons: list[str]
) -> FollowedRecording | None:
    """The stretch over the angle of its shafts; None, and a reason more, where none is found."""
    try:
        return follow_shafts(
            stretch.signal,
            stages,
            60.0 * stretch.sample.shaft_frequency,
            name=stretch.sample.source.name,
        )
    except ConfigError as error:
        reasons.append(str(error))
        return None


def _finding(
    known: HealthyMachine,
    followed: FollowedRecording,
    stretch: Stretch,
    healthy: Sequence[Stretch],
) -> Finding:
    """The finding; levels do not count where no healthy recording has the load."""
    alike = like_healthy(stretch.sample, healthy)
    load = stretch.sample.source.load
    other_load = all(one.sample.source.load != load for one in alike)
    return known.judge_followed(followed, other_load=other_load)
