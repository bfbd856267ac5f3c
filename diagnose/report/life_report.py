"""Report on a study of remaining lives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, final

import numpy as np

from diagnose.data.lives import Lives
from diagnose.data.protocols import MEANING
from diagnose.report.base import Report
from diagnose.report.panels import COLORS, panels, save, spaced
from diagnose.report.text import (
    FEW_UNITS,
    TOLD,
    card_spread,
    data_line,
    few_groups,
    fewest,
    files_section,
    left_out_sentences,
    level_text,
    made_by,
)
from diagnose.scoring.intervals import drawn_text, interval_text, side_of, too_few_text
from diagnose.scoring.life_scores import BAND, MEASURES
from diagnose.scoring.predictions import Prediction, hours_of
from diagnose.studies.life_jobs import AGE_ONLY, AND_AGE, CONSTANT
from diagnose.studies.result_files import Content, write_rows
from gensig.text.markdown import table_lines
from gensig.text.page import Card, Section, Table

MOST_LINES = 12  # lives in one panel; more cannot be told apart
ALPHA = 0.2  # share of the true remaining life, the cone of the figure
HEAD = {
    "rmse_h": "RMSE, h",
    "mae_h": "mean error, h",
    "phm_score": "PHM score",
    "phm_score_last": "PHM score, last",
    "coverage": "share in the interval",
    "width_h": "width, h",
    "horizon_h": "horizon, h",
}
MEANINGS = {
    "Remaining life": "is cut at the early level: long before its failure a machine shows nothing "
    "of it. A prediction at that level says 'that long or longer'.",
    "Scores": "are means over the snapshots of a life, then over lives, so that every life counts "
    "the same; of the test lives that failed. In brackets the 95 % interval.",
    "PHM score": "exp(-d/13) - 1 for too short a prediction, exp(d/10) - 1 for too long a one, d "
    "in units of 1/125 of the early level; smaller is better. 'last': of the last snapshot before "
    "the failure alone.",
    "Share in the interval": "how often the prediction interval holds the true remaining life, "
    "with the share that was wanted. Its half width comes of the errors on validation lives "
    "(conformal prediction, every life counting the same); these chose the model too, so that it "
    "is a little too narrow.",
    "Horizon": f"how long before a failure predictions come within {BAND:.0%} of the early level "
    "and stay so.",
    AGE_ONLY: "regression on the age alone: what a maintenance plan by the clock knows. A method "
    "that is not better has learnt nothing of the vibration.",
    CONSTANT: "the mean remaining life of the training, whatever the record.",
    "indicators": "ridge regression or gradient boosting (chosen on validation lives) on condition "
    "indicators, their change since the first snapshot of the life, speed and torque.",
    f"...{AND_AGE}": "the same with the age in addition to the vibration.",
    "Censored lives": "did not fail within their history. They are never scored; in the training "
    "their snapshots are used where the bound is above the early level, and left out below.",
}
FILES = {
    "metrics.json": "everything in numbers, with settings and versions.",
    "predictions.csv": "the prediction of each method for each test record, with its interval.",
    "scores.csv": "the scores as a table.",
    "models/": "each network, for diagnose evaluate, predict and export.",
}
CAPTION = (
    f"predicted against true remaining life, a line a life (at most {MOST_LINES}), first seed; "
    f"grey: within {ALPHA:.0%} of the truth; dotted: the early level"
)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LifeReport(Report):
    """Report on a study of remaining lives.

    Attributes
    ----------
    lives : of the data set
    predictions : of all methods
    """

    title: ClassVar[str] = "How long the machines still run"
    metrics: Content
    lives: Lives
    predictions: Sequence[Prediction]

    def lines(self) -> list[str]:
        """Tables of all protocols as Markdown."""
        lines = []
        for name, result in self.metrics["protocols"].items():
            table = life_table(result)
            lines += [f"**{name}**: {_lives_sentence(result)}", ""]
            lines += table_lines(table.head, table.rows)
        return lines

    def lead(self) -> list[str]:
        """Data and network."""
        metrics = self.metrics
        return [
            f"{data_line(metrics)} "
            "Simulated vibration: a score says nothing yet about measured machines.",
            f"Network: {metrics['model']}, {level_text(metrics)}, given speed and torque, "
            f"{made_by(metrics)}",
        ]

    def sections(self, folder: Path) -> list[Section]:
        """Errors in short, then a table and a figure for each protocol."""
        results, model = self.metrics["protocols"], self.metrics["model"]
        sections = [
            Section(
                title="In short",
                text=[
                    "Root of the mean squared error of the remaining life that the network "
                    "predicts for machines it never saw."
                ],
                cards=[_card(name, result, model) for name, result in results.items()],
            )
        ]
        for name, result in results.items():
            picture = f"remaining_life_{name}.png"
            mine = [run for run in self.predictions if run.protocol == name]
            life_figure(folder / picture, self.lives, mine)
            sections.append(
                Section(
                    title=f"Remaining life, {name}",
                    text=[_lives_sentence(result)],
                    table=life_table(result),
                    notes=[("", line) for line in _caveats(name, result)],
                    figures=[(picture, CAPTION)],
                )
            )
        meaning = Section(title="What the numbers mean", notes=[*MEANINGS.items()])
        sections.append(meaning)
        left_out = [("", line) for line in left_out_sentences(self.metrics)]
        if left_out:
            sections.append(Section(title="Protocols left out", notes=left_out))
        return [*sections, files_section(FILES)]

    def write_tables(self, folder: Path) -> None:
        """Write ``scores.csv``."""
        write_rows(folder / "scores.csv", _score_rows(self.metrics))


def life_table(result: Content) -> Table:
    """Scores of one protocol, a row a method."""
    rows = [
        [spaced(name), *(interval_text(method[measure], ".3g") for measure in MEASURES)]
        for name, method in result["methods"].items()
    ]
    return Table(head=["method", *HEAD.values()], rows=rows)


def life_figure(path: Path, lives: Lives, predictions: Sequence[Prediction]) -> None:
    """Predicted against true remaining life, one panel a method: an alpha-lambda plot."""
    shown: dict[str, Prediction] = {}
    for run in predictions:
        if run.method != CONSTANT:
            shown.setdefault(run.method, run)
    figure, axes = panels(len(shown), 3.1, 3.9, sharey=True)
    for panel, (name, run) in zip(axes, shown.items(), strict=True):
        _life_panel(panel, lives, run)
        panel.set(xlabel="true remaining life, h", title=spaced(name))
        panel.grid(alpha=0.3)
    axes[0].set_ylabel("predicted, h")
    save(figure, path)


def _life_panel(panel: Any, lives: Lives, run: Prediction) -> None:
    """Draw the cone about the truth, and a line for each life that failed."""
    level, life = hours_of(run).early_life_h, lives.name[run.record]
    at = np.linspace(0, level, 50)
    wide = np.minimum((1 + ALPHA) * at, level)
    panel.fill_between(at, (1 - ALPHA) * at, wide, color="0.88")
    panel.plot(at, at, color="0.4", linewidth=1)
    panel.axhline(level, color="0.4", linestyle=":", linewidth=1)
    names = np.unique(life[lives.failed[run.record]])[:MOST_LINES]
    for index, name in enumerate(names):
        mine = np.flatnonzero(life == name)
        mine = mine[np.argsort(lives.age[run.record[mine]])]
        panel.plot(
            np.minimum(lives.remaining[run.record[mine]], level),
            run.answers[mine, 0],
            color=COLORS[index % len(COLORS)],
            marker=".",
            linewidth=0.8,
            markersize=4,
        )
    panel.set(xlim=(1.03 * level, -0.03 * level), ylim=(-0.03 * level, 1.06 * level))


def _card(name: str, result: Content, model: str) -> Card:
    """The network's error against that of the age alone."""
    methods = result["methods"]
    network, by_age = methods[model], methods[AGE_ONLY]["rmse_h"]["mean"]
    score, better = network["rmse_h"], network["gain_over_age_only_h"]
    side = side_of(better)
    found = TOLD.get(side, f"{too_few_text(better)} to compare it with")
    mark = "good" if side == "above" else "bad"
    meaning = MEANING.get(name, "tested on machines never seen")
    return Card(
        title=name,
        value=f"{score['mean']:.3g} h",
        spread=card_spread(score, ".3g"),
        verdict=f"{found} the age alone ({by_age:.3g} h); "
        f"indicators {methods['indicators']['rmse_h']['mean']:.3g} h; "
        f"intervals hold {network['coverage']['mean']:.0%} "
        f"(wanted {result['coverage_wanted']:.0%})",
        meaning=f"{meaning}; early level {result['early_life_h']:.3g} h.",
        mark=mark,
    )


def _lives_sentence(result: Content) -> str:
    lives, censored = result["n_lives"], result["n_lives_censored"]
    return (
        f"{lives['train']} training, {lives['validation']} validation and {lives['test']} test "
        f"lives that failed (and {', '.join(map(str, censored.values()))} censored); remaining "
        f"life cut at {result['early_life_h']:.4g} h; "
        f"prediction intervals for {result['coverage_wanted']:.0%}; "
        f"brackets 95 % over {drawn_text(result['resampled'])} and seeds."
    )


def _caveats(name: str, result: Content) -> list[str]:
    lines, lives = [], result["n_lives"]
    support = fewest(result)
    if support.too_few:
        lines.append(f"{name}: {few_groups(support.kind, support.n_groups)}")
    elif lives["test"] < FEW_UNITS:
        lines.append(
            f"{name}: only {lives['test']} test lives failed. The brackets are too narrow for new "
            f"ones; at least {FEW_UNITS} are advisable."
        )
    if not result["intervals_hold"]:
        lines.append(
            f"{lives['validation']} validation lives are too few for intervals of "
            f"{result['coverage_wanted']:.0%}: they reach from 0 to the early level and say "
            "nothing."
        )
    if unknown := sum(result["n_records_unknown"].values()):
        lines.append(
            f"{unknown} training or validation snapshots of censored lives are left out: bound "
            "below the level."
        )
    return lines


def _score_rows(metrics: Content) -> Iterator[dict[str, str]]:
    """Scores as a table; without an interval its ends are empty."""
    for protocol, result in metrics["protocols"].items():
        for name, method in result["methods"].items():
            for measure in (*MEASURES, "gain_over_age_only_h"):
                known = {
                    key: f"{method[measure][key]:.6g}"
                    for key in ("mean", "low", "high")
                    if method[measure][key] is not None
                }
                yield {
                    "protocol": protocol,
                    "method": name,
                    "measure": measure,
                    **dict.fromkeys(("mean", "low", "high"), ""),
                    **known,
                }
