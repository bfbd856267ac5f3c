"""Comparators of a bridge that learn from healthy recordings alone, or from none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnose.bridge.bridge_machine import Sample
from diagnose.bridge.bridge_scores import Answers
from diagnose.bridge.implanted_windows import Stretch
from diagnose.data.windows import FloatArray
from gensig.measured.measured_set import LABELS
from gensig.signals.handbook_rule import handbook_answer


def handbook_answers(healthy: Sequence[Stretch], judged: Sequence[Stretch]) -> Answers:
    """The handbook's rule for each recording, by the healthy level of its speed and load.

    Parameters
    ----------
    healthy : stretches that may be learnt from
    judged : stretches to answer for
    """
    answers = [
        handbook_answer(one.signal.acceleration, _healthy_level(one.sample, healthy))
        for one in judged
    ]
    predicted = np.array([[LABELS.index(answer.state) for answer in answers]])
    # the more of the two alarms, so that a curve can be drawn
    faulty = np.array(
        [[max(one.kurtosis / 6.0, one.level_db / 3.0) for one in answers]]
    )
    return Answers(predicted=predicted, faulty=faulty)


def like_healthy(sample: Sample, healthy: Sequence[Stretch]) -> list[Stretch]:
    """Healthy stretches of the same speed and load, else of the same speed, else all."""
    speed, load = sample.shaft_frequency, sample.source.load
    same_speed = [
        one for one in healthy if abs(one.sample.shaft_frequency / speed - 1.0) < 0.02
    ]
    same_load = [one for one in same_speed if one.sample.source.load == load]
    return same_load or same_speed or list(healthy)


def _healthy_level(sample: Sample, healthy: Sequence[Stretch]) -> FloatArray:
    """(channel,) RMS of the healthy recordings like a recording."""
    power = [
        np.square(one.signal.acceleration).mean(axis=1)
        for one in like_healthy(sample, healthy)
    ]
    return np.sqrt(np.mean(power, axis=0))
