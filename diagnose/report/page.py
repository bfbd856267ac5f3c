"""Report on a study that tells classes apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, final

from diagnose.data.protocols import MEANING
from diagnose.report.answer_sections import answer_sections
from diagnose.report.answer_tables import write_tables
from diagnose.report.base import Report
from diagnose.report.control_sections import controls_section
from diagnose.report.fault_answers import fault_answers, fault_section
from diagnose.report.figures import confusion_figure, reliability_figure, scores_figure
from diagnose.report.headlines import headlines
from diagnose.report.methods import explained_methods, score_columns
from diagnose.report.novelty_report import novelty_sections, novelty_tables
from diagnose.report.text import (
    answer_card,
    caveats,
    confusions,
    data_line,
    few_groups,
    fewest,
    files_section,
    leaky_card,
    level_text,
    made_by,
    recall_table,
    resampled_sentence,
    shown_score,
    trust_table,
)
from diagnose.studies.result_files import Content
from diagnose.training.entries import entry_notes
from diagnose.training.heads import heads_notes
from gensig.text.markdown import table_lines
from gensig.text.page import Section, Table

LEAKY_MEANING = (
    "windows of one record on both sides of the split, as in many papers. It is no measure of "
    "diagnosis"
)
FILES = {
    "report.md": "the first figures and the table of scores as text.",
    "metrics.json": "everything in numbers, with macro-F1, recall, calibration, settings and "
    "versions.",
    "predictions.csv": "the prediction of each method for each test record.",
    "scores.csv and more": "the same numbers as tables, explained in docs/howto/report.md.",
    "novelty.csv": "each score of novelty of each test record.",
    "models/": "the networks, one folder each, for diagnose evaluate and diagnose predict.",
}
Entries = Sequence[tuple[str, Any]]


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class ClassReport(Report):
    """Report on a study that tells classes apart.

    Attributes
    ----------
    pictures : (file in the folder, caption) of accused teeth
    """

    title: ClassVar[str] = "Which faults can be told apart"
    metrics: Content
    pictures: Sequence[tuple[str, str]] = ()

    def lines(self) -> list[str]:
        """First figures and tables as Markdown."""
        metrics = self.metrics
        return [
            *headlines(metrics),
            *result_table(metrics),
            *novelty_tables(metrics["novelty"]),
            *without_interval(metrics),
        ]

    def lead(self) -> list[str]:
        """Data and network."""
        samples = self.metrics["settings"]["window_samples"]
        window_ms = 1e3 * samples / self.metrics["sampling_rate_hz"]
        return [
            data_line(self.metrics),
            f"Network: {self.metrics['model']} on windows of {window_ms:.0f} ms, "
            f"{level_text(self.metrics)}, {made_by(self.metrics)}",
        ]

    def sections(self, folder: Path) -> list[Section]:
        """Answers first, then scores, controls and caveats."""
        metrics = self.metrics
        ordered = _ordered(metrics)
        clean = {name: result for name, result in ordered if not result["leaky"]}
        novelty = metrics["novelty"]
        warnings = [("", line) for line in caveats(metrics)]
        sections = [fault_section(metrics)]
        if ordered:
            sections += _score_sections(folder, metrics, ordered)
        if clean:
            sections.append(_fault_section(clean, metrics))
            sections += answer_sections(folder, clean)
        sections += novelty_sections(novelty)
        if ordered:
            sections.append(controls_section(metrics))
        sections.append(Section(title="Caveats", notes=warnings))
        if ordered:
            sections.append(_meaning_section(metrics, clean))
        if clean:
            sections.append(_trust_section(folder, clean))
        sections.append(_confusion_section(folder, metrics, ordered))
        files = {
            name: text
            for name, text in FILES.items()
            if novelty or name != "novelty.csv"
        }
        sections.append(files_section(files))
        sections = [
            section
            for section in sections
            if section.text or section.table or section.notes or section.figures
        ]
        if self.pictures:
            sections.insert(2, _pictures_section(self.pictures))
        return sections

    def write_tables(self, folder: Path) -> None:
        """Write the tables of all answers, and ``report.md``: first figures and pictures."""
        metrics = self.metrics
        write_tables(folder, metrics)
        first = [f"- **{line}**" for line in headlines(metrics)]
        first += [
            f"- {name}, found: {text}" for name, text in fault_answers(metrics).items()
        ]
        shown = [f"![{caption}]({picture})\n" for picture, caption in self.pictures]
        lines = [f"# {self.title}", "", *first, "", data_line(metrics), ""]
        lines += [*result_table(metrics), "", *shown, *without_interval(metrics), ""]
        (folder / "report.md").write_text("\n".join(lines), encoding="utf-8")


def _pictures_section(pictures: Sequence[tuple[str, str]]) -> Section:
    """Accused teeth of test records."""
    return Section(
        title="What the network saw",
        text=[
            "The first found fault of each class and the first wrong answer among the test "
            "records: the mean turn with the most suspicious tooth, the passage of that tooth "
            "over those of its sisters, and the log-odds of a fault of every tooth."
        ],
        figures=pictures,
    )


def result_table(metrics: Content) -> list[str]:
    """Markdown table of protocol x method.

    Balanced accuracy with its 95 % interval, leaky protocols last.
    """
    if not metrics["protocols"]:
        return []
    table = _score_table(metrics)
    rows = []
    for number, (name, *cells) in enumerate(table.rows):
        label = f"**{name}**"
        if number in table.quiet:
            label = f"*{name}* (LEAKY: not a result)"
        rows.append([label, *cells])
    return table_lines(table.head, rows)


def without_interval(metrics: Content) -> list[str]:
    """Lines on the protocols whose scores have no interval; empty where all have one."""
    results = metrics["protocols"] | metrics["novelty"]
    few: dict[str, dict[str, int]] = {}
    for name, result in results.items():
        support = fewest(result)
        if support.too_few:
            few.setdefault(support.kind, {})[name] = support.n_groups
    return [
        f"{', '.join(protocols)}: {few_groups(kind, min(protocols.values()))}"
        for kind, protocols in few.items()
    ]


def _ordered(metrics: Content) -> Entries:
    """Protocols with their results, leaky ones last."""
    return sorted(metrics["protocols"].items(), key=lambda item: item[1]["leaky"])


def _score_table(metrics: Content) -> Table:
    results = _ordered(metrics)
    columns = {
        name: label
        for name, label in score_columns(metrics["model"]).items()
        if _has(metrics, name)
    }
    rows = []
    for protocol, result in results:
        cells = [shown_score(result, name) for name in columns]
        rows.append([protocol, *cells])
    return Table(
        head=["protocol", *columns.values()],
        rows=rows,
        quiet=[number for number, (_, result) in enumerate(results) if result["leaky"]],
    )


def _has(metrics: Content, method: str) -> bool:
    return any(method in result["methods"] for result in metrics["protocols"].values())


def _score_sections(folder: Path, metrics: Content, ordered: Entries) -> list[Section]:
    cards = []
    for name, result in ordered:
        meaning = MEANING.get(name, LEAKY_MEANING)
        if result["leaky"]:
            cards.append(leaky_card(name, metrics))
        else:
            cards.append(answer_card(name, result, metrics["model"], meaning))
    scores_figure(folder / "scores.png", metrics)
    return [
        Section(
            title="Protocols",
            text=[
                "Balanced accuracy of the network over test records: the mean share recognised "
                "of each class."
            ],
            cards=cards,
        ),
        Section(
            title="Network, baselines and controls",
            text=[
                "Mean over the seeds [95 % interval]. "
                f"{resampled_sentence(metrics['protocols'])}"
            ],
            table=_score_table(metrics),
            figures=[("scores.png", "scores and intervals; dotted: chance")],
        ),
    ]


def _meaning_section(metrics: Content, clean: Content) -> Section:
    label = "the class with the largest mean log-probability over its windows."
    return Section(
        title="What the numbers mean",
        notes=[
            ("A record's label", label),
            *((name, f"{MEANING[name]}{_sensors(clean[name])}.") for name in clean),
            ("LEAKY", f"{LEAKY_MEANING}."),
            *(
                (text.label, text.meaning)
                for text in explained_methods()
                if _has(metrics, text.name)
            ),
        ],
        folded=True,
    )


def _sensors(result: Content) -> str:
    """Channels of training and test, where they differ."""
    channels = result["channels"]
    trained, tested = ", ".join(channels["train"]), ", ".join(channels["test"])
    if trained == tested:
        return ""
    return f": trained on {trained}, tested on {tested}"


def _fault_section(clean: Content, metrics: Content) -> Section:
    model, names = metrics["model"], metrics["class_names"]
    notes = [
        (name, confusions(result["methods"][model]["confusion"], names))
        for name, result in clean.items()
    ]
    return Section(
        title="Which faults are found",
        text=[f"Share of the test records of each class that {model} recognises."],
        table=recall_table(clean, model, names),
        notes=[*notes, *heads_notes(clean), *entry_notes(clean)],
    )


def _trust_section(folder: Path, clean: Content) -> Section:
    calibration = {name: result["calibration"] for name, result in clean.items()}
    reliability_figure(folder / "reliability.png", calibration)
    return Section(
        title="What its probabilities are worth",
        text=[
            "One temperature a network, fitted on records of its validation machines, brings the "
            "probabilities of records nearer to the share that is right; it changes no label. "
            "Calibration error: mean distance between the two over test records, and what such "
            "probabilities would have by chance if they were all true. Cross-entropy: smaller is "
            "better. The network is the one of its best epoch on validation machines; the score of "
            "its last epoch is shown for comparison."
        ],
        table=trust_table(clean),
        figures=[("reliability.png", "share right against probability")],
        folded=True,
    )


def _confusion_section(folder: Path, metrics: Content, ordered: Entries) -> Section:
    figures = []
    for name, result in ordered:
        title = f"{metrics['model']}, {name}"
        if result["leaky"]:
            title += " (LEAKY)"
        picture = f"confusion_{name}.png"
        confusion = result["methods"][metrics["model"]]["confusion"]
        confusion_figure(folder / picture, confusion, metrics["class_names"], title)
        figures.append((picture, title))
    return Section(
        title="Confusion matrices", figures=figures, side_by_side=True, folded=True
    )
