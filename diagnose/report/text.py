"""Sentences, cells and tables of the report out of the parts of ``metrics.json``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from diagnose.data.protocols import left_out_lines
from diagnose.report.methods import controls_on_cards, rivals_on_cards
from diagnose.scoring.alarms import FALSE_ALARMS, LEAST_HEALTHY
from diagnose.scoring.intervals import (
    Side,
    drawn_text,
    interval_text,
    is_above,
    side_of,
    too_few_text,
)
from diagnose.scoring.machines import LEAST_UNITS, MACHINES, Support
from diagnose.studies.result_files import Content
from diagnose.studies.verdicts import failed_controls
from gensig.text.page import Card, Section, Table

FEW_UNITS = 10
WITHHELD = "withheld: a control failed"
CONFUSED = 0.1
TOLD: dict[Side | None, str] = {
    "above": "better than",
    "below": "worse than",
    "neither": "not told from",
}
TRUST_HEAD = (
    "protocol",
    "calibration error before, after (chance)",
    "cross-entropy before, after",
    "temperature",
    "best epoch",
    "last epoch",
    "score of the last",
)


def shown(score: Content | float | None) -> str:
    """A score with its interval where it has one; "-" for one that was not taken."""
    if score is None:
        return "-"
    if isinstance(score, int | float):
        return f"{score:.2f}"
    return interval_text(score)


def score_cell(method: Content | None) -> str:
    """Balanced accuracy of a method; "-" for one that was not run."""
    return shown(method and method["balanced_accuracy"])


def shown_score(result: Content, method: str) -> str:
    """Score of a method on a protocol; withheld where one of its controls failed."""
    if failed_controls(result, method):
        return WITHHELD
    return score_cell(result["methods"].get(method))


def data_line(metrics: Content) -> str:
    """Sentence on the data: size, classes, channels, rate."""
    records = f"{metrics['n_records']} records"
    if "class_names" in metrics:
        records += f", classes {', '.join(metrics['class_names'])}"
    channels = ", ".join(metrics["channel_names"])
    return (
        f"Data: {metrics['data']}, {records}; channels {channels} "
        f"at {metrics['sampling_rate_hz']:g} Hz."
    )


def level_text(metrics: Content) -> str:
    """Normalisation in words."""
    if metrics["settings"]["normalise"] == "none":
        return "level kept"
    return "level removed (RMS-normalised)"


def made_by(metrics: Content) -> str:
    """Number of seeds, version and time."""
    made = metrics["environment"]
    n_seeds = len(metrics["settings"]["seeds"])
    return f"{n_seeds} seed(s). gensig {made['gensig']}, {made['finished']}."


def files_section(files: Mapping[str, str]) -> Section:
    """Section on the files of a report."""
    return Section(title="Files beside this page", notes=[*files.items()], folded=True)


def answer_card(name: str, result: Content, model: str, meaning: str) -> Card:
    """A clean protocol's score against chance, the best baseline, oracle and controls."""
    methods = result["methods"]
    score = methods[model]["balanced_accuracy"]
    chance = methods["chance"]["balanced_accuracy"]
    mark = "bad"
    value, spread = f"{score['mean']:.2f}", card_spread(score)
    verdict, leak = _verdict(result, score, chance)
    if is_above(score, chance) and not leak:
        mark = "good"
    if failed := failed_controls(result, model):
        value, spread, verdict = "-", WITHHELD, [failed]
    if not meaning.startswith("tested"):
        meaning = f"tested {meaning}"
    return Card(
        title=name,
        value=value,
        spread=spread,
        verdict="; ".join(verdict),
        meaning=f"{meaning[0].upper()}{meaning[1:]}.",
        mark=mark,
    )


def leaky_card(name: str, metrics: Content) -> Card:
    """A leaky protocol's score, and its difference to a clean one as this study measured it."""
    result, model = metrics["protocols"][name], metrics["model"]
    score = result["methods"][model]["balanced_accuracy"]
    split = "Windows of one record are on both sides of this split."
    leak = result.get("leak")
    if not leak:
        verdict = "not a result"
        meaning = f"{split} No clean protocol was run beside it."
    else:
        against, difference = leak["against"], leak["difference"]
        clean = metrics["protocols"][against]["methods"][model]["balanced_accuracy"]
        shown = interval_text(difference, "+.2f")
        verdict = f"not a result; {shown} against {against} ({clean['mean']:.2f})"
        meaning = f"{split} {_leak_words(difference, against)}"
    return Card(
        title=f"{name} (LEAKY)",
        value=f"{score['mean']:.2f}",
        spread=card_spread(score),
        verdict=verdict,
        meaning=meaning,
        mark="quiet",
    )


def _leak_words(difference: Content, against: str) -> str:
    """Meaning of the difference between a leaky and a clean protocol."""
    mean = abs(difference["mean"])
    return {
        None: "The difference has no interval, so that nothing can be said of it.",
        "above": f"In this study it shows {mean:.2f} more than {against}.",
        "below": f"In this study it shows {mean:.2f} less than {against}.",
        "neither": f"In this study it is not told from {against}.",
    }[side_of(difference)]


def _verdict(result: Content, score: Content, chance: float) -> tuple[list[str], bool]:
    """Verdicts on a score, and True if a control is above chance."""
    methods = result["methods"]
    side = side_of(score, chance)
    found = {
        None: f"no verdict against chance ({chance:.2f}): {too_few_text(score)}",
        "above": f"above chance ({chance:.2f})",
    }.get(side, f"not distinguishable from chance ({chance:.2f})")
    lines = [found]
    if side is not None:
        lines += _best_rival(result, score)
    if "oracle" in methods:
        share = result["over_oracle"]["balanced_accuracy"]
        best = methods["oracle"]["balanced_accuracy"]["mean"]
        lines.append(
            f"{share['mean']:.2f} ({card_spread(share)}) of the oracle ({best:.2f})"
        )
    leak = False
    for name, control in controls_on_cards().items():
        found = methods.get(name, {}).get("balanced_accuracy", {"low": None})
        if found["low"] is None:
            continue
        if is_above(found, chance):
            leak = True
            mean = found["mean"]
            lines.append(f"{control} ABOVE chance ({mean:.2f}): look for a leak")
        else:
            lines.append(f"{control} at chance")
    return lines, leak


def _best_rival(result: Content, score: Content) -> list[str]:
    """Comparison of the network's score with the best baseline; empty where none ran.

    It is the best one on validation machines, whose controls hold.
    """
    best = result["answers"]["best_baseline"]
    if best is None:
        return []
    label = rivals_on_cards().get(best, best)
    mean = result["methods"][best]["balanced_accuracy"]["mean"]
    # an interval that holds the other's mean tells the two apart neither way
    return [f"{TOLD[side_of(score, mean)]} {label} ({mean:.2f})"]


def card_spread(score: Content, form: str = ".2f") -> str:
    """Interval of a score for a card."""
    if score["low"] is None:
        return too_few_text(score)
    return f"{score['low']:{form}} to {score['high']:{form}}"


def recall_table(clean: Content, model: str, class_names: Sequence[str]) -> Table:
    """Recall by class, a row a protocol."""
    rows = []
    for protocol, result in clean.items():
        recall = result["methods"][model]["recall"]
        rows.append([protocol, *(shown(recall.get(name)) for name in class_names)])
    return Table(head=["protocol", *class_names], rows=rows)


def confusions(confusion: Sequence[Sequence[int]], class_names: Sequence[str]) -> str:
    """The largest off-diagonal shares, at most three."""
    result = []
    for true, row in zip(class_names, confusion, strict=True):
        total = max(int(np.sum(row)), 1)
        for predicted, count in zip(class_names, row, strict=True):
            if true != predicted and count / total >= CONFUSED:
                result.append((count / total, true, predicted))
    if not result:
        return (
            f"no class is taken for another in {CONFUSED:.0%} of its records or more."
        )
    result.sort(reverse=True)
    texts = [f"{true} taken for {other} ({share:.0%})" for share, true, other in result]
    return "; ".join(texts[:3]) + "."


def trust_table(clean: Content) -> Table:
    """Calibration and the choice of the epoch, a row a protocol."""
    rows = []
    for name, result in clean.items():
        calibration, last = result["calibration"], result["last_epoch"]
        error, entropy = (
            ", ".join(
                f"{np.mean(calibration[when][key]):.3f}" for when in ("before", "after")
            )
            for key in ("expected_calibration_error", "cross_entropy")
        )
        by_chance = np.mean(calibration["after"]["error_by_chance"])
        rows.append(
            [
                name,
                f"{error} ({by_chance:.3f})",
                entropy,
                ", ".join(f"{value:.2f}" for value in calibration["temperature"]),
                ", ".join(map(str, result["best_epoch"])),
                ", ".join(map(str, last["epoch"])),
                score_cell(last),
            ]
        )
    return Table(head=TRUST_HEAD, rows=rows)


def fewest(result: Content) -> Support:
    """Groups that the intervals of a protocol resample; of two kinds the one with fewer."""
    counts = [Support(kind=kind, n_groups=n) for kind, n in result["resampled"].items()]
    return min(counts, key=lambda support: support.n_groups)


def few_groups(kind: str, n_groups: int) -> str:
    """Reason why there is no interval."""
    return (
        f"too few {kind} ({n_groups}) in the test part for an interval; {LEAST_UNITS} are the "
        f"least and {FEW_UNITS} advisable: a score of so few says little of others."
    )


def resampled_sentence(results: Content) -> str:
    """Sentence on what the intervals of protocols resample; machines alone need no more words."""
    drawn = {name: drawn_text(result["resampled"]) for name, result in results.items()}
    each = [*dict.fromkeys(drawn.values())]
    texts = [
        f"{what} ({', '.join(name for name in drawn if drawn[name] == what)})"
        for what in each
    ]
    if len(each) == 1:
        texts = each
    sentence = (
        f"The interval resamples {'; '.join(texts)}: windows of one machine are not "
        "independent"
    )
    if each == [MACHINES]:
        return f"{sentence}."
    return f"{sentence}, nor are machines that share gears or a gearbox."


def left_out_sentences(metrics: Content) -> list[str]:
    """Protocols that are left out, and why."""
    lines = left_out_lines(metrics["protocols_left_out"])
    return [f"{line[0].upper()}{line[1:]}." for line in lines]


def caveats(metrics: Content) -> list[str]:
    """Limits of the scores that a reader must know before using them."""
    lines = [
        "Simulated vibration. A score here says nothing yet about measured machines."
    ]
    for name, result in metrics["protocols"].items():
        for method in result.get("controls", {}):
            if failed := failed_controls(result, method):
                lines.append(f"{method} has no score on {name}: {failed}.")
        support = fewest(result)
        kind, n_groups = support.kind, support.n_groups
        if support.too_few:
            lines.append(f"{name}: {few_groups(kind, n_groups)}")
        elif n_groups < FEW_UNITS and not result["leaky"]:
            lines.append(
                f"{name}: only {n_groups} {kind} in the test part. The interval shows the spread "
                f"of these and is too narrow for new ones; at least {FEW_UNITS} are advisable."
            )
    lines += novelty_caveats(metrics["novelty"])
    if metrics["settings"]["normalise"] == "rms":
        lines.append(
            "The network sees windows without their level, the indicators with it unless stated; "
            "normalise=none gives the level to the network too."
        )
    lines += left_out_sentences(metrics)
    for name, reason in metrics["baselines_left_out"].items():
        lines.append(f"The baseline {name} is left out of {reason}.")
    if n_failed := metrics["n_records_unusable"]:
        lines.append(f"{n_failed} record(s) failed in simulation and are left out.")
    return lines


def novelty_caveats(novelty: Content) -> list[str]:
    """Weaknesses of the scores of novelty, one line each."""
    lines = []
    for name, result in novelty.items():
        support = fewest(result)
        if support.n_groups < FEW_UNITS:
            lines.append(
                f"{name}: only {support.n_groups} {support.kind} in the test part; at least "
                f"{FEW_UNITS} are advisable."
            )
        if (n_records := result["n_records"]["validation"]) < LEAST_HEALTHY:
            lines.append(
                f"{name}: {n_records} validation record(s); with fewer than {LEAST_HEALTHY} no "
                f"threshold promises {FALSE_ALARMS:.0%} of false alarms, "
                "the largest score is taken."
            )
    return lines
