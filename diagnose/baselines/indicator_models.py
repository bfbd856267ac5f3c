"""Simple models on condition indicators, with the level of the signal and without it."""

from __future__ import annotations

from functools import partial
from typing import final

from diagnose.baselines.base import Input, MethodText, Parts, Role, Source
from diagnose.baselines.chosen_model import ChosenModelBaseline
from diagnose.baselines.features import LEVEL, feature_table


def indicator_tables(source: Source) -> Parts:
    """Indicators of every stretch of the signal."""
    table = partial(feature_table, features=source.features)
    return source.tables(INDICATOR_INPUT.name, table, source.subsets)


INDICATOR_INPUT = Input(name="indicators", make=indicator_tables)


@final
class IndicatorModel(ChosenModelBaseline):
    """Logistic regression or gradient boosting on all indicators."""

    text = MethodText(
        name="indicators",
        label="indicators",
        card_label="indicators",
        meaning="logistic regression or gradient boosting (chosen on validation machines) on RMS, "
        "kurtosis, crest factor, FM4 and sideband ratio of every channel over the whole stretch "
        "of signal; it knows the speed and the tooth counts.",
    )
    role = Role.RIVAL
    reads = INDICATOR_INPUT


@final
class IndicatorModelWithoutLevel(ChosenModelBaseline):
    """The same without the RMS: a fair comparison with windows divided by theirs."""

    text = MethodText(
        name="indicators_without_level",
        label="indicators without RMS",
        card_label=None,
        meaning="the same models without the RMS, for networks on windows without their level.",
    )
    role = Role.RIVAL
    reads = INDICATOR_INPUT
    without = LEVEL
