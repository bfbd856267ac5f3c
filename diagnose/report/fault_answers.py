"""First section of a report: one line a fault, on whether and from what size it is found."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from diagnose.data.protocols import MEANING
from diagnose.report.headlines import headline_protocol, headlines
from diagnose.report.text import shown
from diagnose.scoring.alarms import FALSE_ALARMS
from diagnose.scoring.detection_limit import too_few_for_curve
from diagnose.scoring.intervals import interval_text, is_above, too_few_text
from diagnose.studies.result_files import Content
from diagnose.studies.verdicts import failed_controls
from gensig.text.page import Section, Table
from gensig.text.parameters import size_words

OFTEN, HALF = 0.9, 0.5  # shares of the detection limits
SEVERITY = "severity"
NOT_FOUND = "not: no more often than false alarms"
OPEN = "open: too few records to tell it from false alarms"
NO_THRESHOLD = "no verdict: no threshold for alarms, see below"
# Beginning of a size's name -> the whole of which the severity is a share.
WHOLES = {
    "crack": "of the root chord",
    "pit": "of the flank",
    "pitted": "of the flank",
    "spall": "of the flank",
}
HEAD = ("fault", "found", "share found", "test records", "named right")


def fault_answers(metrics: Content) -> dict[str, str]:
    """Fault class -> whether it is found, in one phrase, on the protocol of the headlines.

    Empty without a clean protocol, or without healthy test records.
    """
    detection = _detection(metrics)
    if detection is None:
        return {}
    return {
        name: found_phrase(result, detection["false_alarms"])
        for name, result in detection["classes"].items()
    }


def fault_section(metrics: Content) -> Section:
    """The first section; without text where no protocol tells classes apart."""
    protocol = headline_protocol(metrics)
    title = "In short"
    if protocol is None:
        if not metrics["protocols"]:
            return Section(title=title)
        return Section(
            title=title,
            text=[
                "No answer: only leaky protocols were run. Run one that keeps machines apart."
            ],
        )
    result = metrics["protocols"][protocol]
    recall = result["methods"][metrics["model"]]["recall"]
    notes = [("", line) for line in headlines(metrics)]
    detection = _detection(metrics)
    if detection is None:
        rows = [(name, shown(share)) for name, share in recall.items()]
        text = [
            f"Network {metrics['model']}, {protocol}: share of the test records of each class "
            "that is named right. Without healthy test records no alarm can be judged."
        ]
        table = Table(head=("class", "named right"), rows=rows)
        return Section(title=title, text=text, table=table, notes=notes)
    answers = fault_answers(metrics)
    rows_of_faults = [
        (
            name,
            answers[name],
            interval_text(part["share_found"]),
            f"{part['n_records']} of {part['n_units']} machines",
            shown(recall.get(name)),
        )
        for name, part in detection["classes"].items()
    ]
    return Section(
        title=title,
        text=[_sentence(metrics, protocol, detection)],
        table=Table(head=HEAD, rows=rows_of_faults),
        notes=[*notes, *_notes(detection)],
    )


def found_phrase(result: Mapping[str, Any], false_alarms: Mapping[str, Any]) -> str:
    """Phrase on whether and from what size the faults of a class are found.

    "always": 90 % at every tested size. "from" a size on: 90 % from there. "sometimes": more often
    than healthy records raise an alarm. "not": no more often than those, or than the 5 % intended.
    "open": more often, but the interval holds their share. Too few machines, and no threshold,
    give no verdict.

    Parameters
    ----------
    result : of one class, of `diagnose.scoring.detection_limit.detection`
    false_alarms : share of healthy test records with an alarm, and its interval
    """
    share = result["share_found"]
    if share["mean"] is None:
        return NO_THRESHOLD
    if share["low"] is None:
        return f"no verdict: {too_few_text(share)}"
    alarms = false_alarms["mean"] or 0.0
    is_found = is_above(share, alarms)
    absent = OPEN
    if share["mean"] <= max(alarms, FALSE_ALARMS):
        absent = NOT_FOUND
    often, half = _limit(result, OFTEN), _limit(result, HALF)
    if often is None or half is None:
        if share["mean"] >= OFTEN:
            return "always"
        if not is_found:
            return absent
        if too_few_for_curve(result):
            return "sometimes; from what size on is not told: too few records"
        return "sometimes"
    if often["status"] == "at_smallest_tested":
        return f"always: at every tested size, {_from(result, OFTEN)}"
    if often["status"] == "reached":
        return _from(result, OFTEN)
    if not is_found:
        return absent
    if half["status"] == "at_smallest_tested":
        return "sometimes: half of them or more at every tested size"
    if half["status"] == "reached":
        return f"sometimes: half of them {_from(result, HALF)}"
    return "sometimes: fewer than half of them at every tested size"


def _detection(metrics: Content) -> Content | None:
    """Detection by the network on the protocol of the headlines."""
    protocol = headline_protocol(metrics)
    if protocol is None:
        return None
    answers = metrics["protocols"][protocol]["answers"]
    failed = failed_controls(metrics["protocols"][protocol], metrics["model"])
    if failed or "detection" not in answers:
        return None
    result: Content = answers["detection"][answers["network"]]
    return result


def _sentence(metrics: Content, protocol: str, detection: Content) -> str:
    """Network, protocol and false alarms behind the lines."""
    name = protocol
    if protocol in MEANING:
        name = f"{protocol} (tested {MEANING[protocol]})"
    text = f"Network {metrics['model']}, protocol {name}."
    if detection["missing"]:
        return text
    return (
        f"{text} False alarms on healthy test records: "
        f"{interval_text(detection['false_alarms'])}, 5 % intended; threshold from "
        f"{detection['threshold_from']}."
    )


def _notes(detection: Content) -> list[tuple[str, str]]:
    """Reading of the columns."""
    notes = [
        (
            "found",
            "raises an alarm, whatever class it is then given. Always, or from a size on: nine "
            "in ten [95 % interval]",
        ),
        ("named right", "its own class is the most probable one"),
    ]
    if detection["missing"]:
        notes.append(("no verdict", detection["missing"]))
    if detection["too_many_false_alarms"]:
        text = "more than 5 %, so that the lines above are too good"
        notes.append(("false alarms", text))
    return notes


def _limit(result: Mapping[str, Any], share: float) -> Mapping[str, Any] | None:
    """Detection limit of a class in severity; None where no curve was drawn."""
    for row in result["limits"]:
        if row["quantity"] == SEVERITY and row["share"] == share:
            limit: Mapping[str, Any] = row
            return limit
    return None


def _from(result: Mapping[str, Any], share: float) -> str:
    """A limit in words: in the size of the fault where it is known, and in severity."""
    severity = _limit(result, share)
    assert severity is not None  # the caller has looked
    for row in result["limits"]:
        same = row["share"] == share and row["status"] == severity["status"]
        if same and row["quantity"] != SEVERITY:
            words, unit = size_words(row["quantity"])
            size = " ".join(filter(None, [_ends(row), unit, words]))
            return f"from {size} on ({_of_whole(row['quantity'], severity)})"
    return f"from severity {_ends(severity)} on"


def _of_whole(quantity: str, severity: Mapping[str, Any]) -> str:
    """A severity as share of what it is a share of, where that is known."""
    value = _value(severity)
    for beginning, whole in WHOLES.items():
        if quantity.startswith(f"{beginning}_"):
            return f"{100 * value:.0f} % {whole}"
    return f"severity {value:.2f}"


def _value(row: Mapping[str, Any]) -> float:
    """Limit, or the smallest tested size where all are found."""
    if row["status"] == "at_smallest_tested":
        return float(row["smallest_tested"])
    return float(row["value"])


def _ends(row: Mapping[str, Any]) -> str:
    """Limit with its interval; beyond the largest tested size the upper end is open."""
    text = f"{_value(row):.2g}"
    if row["status"] == "at_smallest_tested":
        return text
    if row["low"] is None and row["high"] is None:
        return text
    ends = ["?" if end is None else f"{end:.2g}" for end in (row["low"], row["high"])]
    if row["high"] is None:
        ends[1] = f"over {row['largest_tested']:.2g}"
    return f"{text} [{ends[0]}, {ends[1]}]"
