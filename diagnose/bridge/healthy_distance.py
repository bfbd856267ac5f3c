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
    """Distance of each recording, or the reason why there is none.

    Parameters
    ----------
    healthy : stretches that may be learnt from
    judged : stretches to answer for

    Returns
    -------
    answers : None where a recording cannot be followed
    reason : empty where there are answers
    """
    stages = GearStages(pairs=machine.train.stages)
    try:
        followed = [_followed(one, stages) for one in healthy]
        asked = [_followed(one, stages) for one in judged]
        shortest = min(asked, key=lambda one: one.n_turns)
        known = HealthyMachine.fit_followed(followed, stages, shortest=shortest)
        findings = [
            _finding(known, one, stretch, healthy)
            for one, stretch in zip(asked, judged, strict=True)
        ]
    except ConfigError as error:
        return None, str(error)
    answers = Answers(
        predicted=None,
        faulty=np.array([[one.score for one in findings]]),
        alarm=np.array([one.is_changed for one in findings]),
    )
    return answers, ""


def _followed(stretch: Stretch, stages: GearStages) -> FollowedRecording:
    return follow_shafts(
        stretch.signal,
        stages,
        60.0 * stretch.sample.shaft_frequency,
        name=stretch.sample.source.name,
    )


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
