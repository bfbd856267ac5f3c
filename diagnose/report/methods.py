"""Methods of a study as the page names them: baselines of the registry and trained controls."""

from __future__ import annotations

from collections.abc import Sequence

from diagnose.baselines.base import MethodText, Role
from diagnose.baselines.registry import BASELINES
from diagnose.studies.baseline_runs import LABEL_SHUFFLE, shuffle_method
from diagnose.studies.class_jobs import (
    LEVEL_KEPT,
    ORACLE,
    ORACLE_NETWORK,
    WITH_REFERENCE,
)
from diagnose.training.sham import NETWORK as SHAM
from diagnose.training.sham import sham_method

CHANCE = "chance"

LEVEL_TEXT = MethodText(
    name=LEVEL_KEPT,
    label="network with RMS",
    card_label=None,
    meaning="the same network on windows in m/s^2, their level not removed.",
)
REFERENCE_TEXT = MethodText(
    name=WITH_REFERENCE,
    label="network with a healthy record",
    card_label="with a healthy record",
    meaning="the same network that also sees the turns of a healthy record of the same machine; "
    "which one, no class decides.",
)
ORACLE_TEXT = MethodText(
    name=ORACLE,
    label="oracle",
    card_label=None,
    meaning="the best of the models that are given each record's healthy twin; see Controls.",
)
SHAM_TEXT = MethodText(
    name=SHAM,
    label="sham",
    card_label="sham",
    meaning="the same training on a data set of severity zero whose labels were kept; "
    "see Controls.",
)
SHUFFLE_TEXT = MethodText(
    name=LABEL_SHUFFLE,
    label="label shuffle",
    card_label="label shuffle",
    meaning="the same training on shuffled labels, to its last epoch. Chance must lie in its "
    "interval, which covers the machines and the luck of the shuffle; if it lies below, "
    "something leaks.",
)
# Notes of the section Controls, where they say more than the sentences above.
SHAM_NOTE = (
    "the same trainings on a data set of severity zero whose labels were kept. Above chance: "
    "something other than the fault tells the class."
)
ORACLE_NOTE = (
    "the best, on validation machines, of the same network and of models on indicators and teeth, "
    "all given the record's healthy twin in as much noise. What it finds is in the signal; it is a "
    "reference for those who do not know how this machine sounds when healthy, as far as these "
    "can learn, not a bound of what any detector could find."
)


def baseline_texts(*roles: Role) -> list[MethodText]:
    """Texts of the baselines of these roles, in the order of the registry."""
    return [baseline.text for baseline in BASELINES.values() if baseline.role in roles]


def score_columns(model: str) -> dict[str, str]:
    """Headings of the table of scores by name of the method; the network first."""
    controls = (LEVEL_TEXT, ORACLE_TEXT, SHUFFLE_TEXT, SHAM_TEXT)
    texts = [REFERENCE_TEXT, *baseline_texts(Role.RIVAL), *controls]
    labels = {text.name: text.label for text in texts}
    return {model: f"{model} network", **labels, CHANCE: CHANCE}


def explained_methods() -> list[MethodText]:
    """Methods that the page explains beside its table of scores."""
    controls = (LEVEL_TEXT, ORACLE_TEXT, SHAM_TEXT, SHUFFLE_TEXT)
    return [REFERENCE_TEXT, *baseline_texts(Role.RIVAL), *controls]


def rivals_on_cards() -> dict[str, str]:
    """Labels of the baselines that the cards compare with the network."""
    return _card_labels(baseline_texts(Role.RIVAL))


def controls_on_cards() -> dict[str, str]:
    """Labels of the controls whose verdict the cards give."""
    return _card_labels([SHUFFLE_TEXT, *baseline_texts(Role.AT_CHANCE), SHAM_TEXT])


def controls_at_chance() -> dict[str, str]:
    """Labels of every control that must be at chance, with the shuffle and sham of each method."""
    watched = (REFERENCE_TEXT, LEVEL_TEXT, *baseline_texts(Role.RIVAL))
    shams = {sham_method(text.name, ""): f"{SHAM}, {text.label}" for text in watched}
    shuffles = {
        shuffle_method(text.name): f"{SHUFFLE_TEXT.label}, {text.label}"
        for text in watched
    }
    return {
        SHUFFLE_TEXT.name: SHUFFLE_TEXT.label,
        **shuffles,
        **{text.name: text.label for text in baseline_texts(Role.AT_CHANCE)},
        SHAM: f"{SHAM}, network",
        **shams,
    }


def oracle_labels(model: str) -> dict[str, str]:
    """Labels of the models that are given healthy twins."""
    baselines = {text.name: text.label for text in baseline_texts(Role.BOUND)}
    return {ORACLE_NETWORK: model, **baselines}


def control_notes() -> dict[str, str]:
    """Explanation of each control by the beginning of its label."""
    probes = baseline_texts(Role.AT_CHANCE, Role.FOLLOWER)
    bounds = {
        f"{ORACLE}, {text.label}": text.meaning for text in baseline_texts(Role.BOUND)
    }
    return {
        **{text.label: text.meaning for text in probes},
        SHAM: SHAM_NOTE,
        ORACLE: ORACLE_NOTE,
        **bounds,
    }


def _card_labels(texts: Sequence[MethodText]) -> dict[str, str]:
    return {text.name: text.card_label for text in texts if text.card_label is not None}
