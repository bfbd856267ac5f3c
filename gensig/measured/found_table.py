"""A measured set as text: its files, classes, specimens, rates and hashes, and what is missing."""

from __future__ import annotations

from collections.abc import Sequence

from gensig.measured.measured_set import MeasuredRecording, MeasuredSet, specimens
from gensig.measured.set_facts import shipped_facts, shipped_names

HEAD = (
    "machine",
    "class",
    "label",
    "specimens",
    "recordings",
    "files",
    "speed",
    "rate",
    "unit",
)
SHOWN_DIGITS = 16  # of a hash, in the table; --hashes prints all
NO_LABEL = "(none of the three)"


def set_lines(found: MeasuredSet) -> list[str]:
    """Lines that say what a folder holds."""
    lines = [
        f"{found.name}: {found.title or 'recordings of your own'}, in {found.folder}"
    ]
    lines.append(
        f"licence: {found.licence or 'not stated by any source that was read'}"
    )
    lines += ["", *table_lines(HEAD, _rows(found)), ""]
    lines += _specimen_lines(found)
    lines += [f"missing: {key} ({reason})" for key, reason in found.missing.items()]
    if found.missing:
        lines.append("give what is missing in measured.yaml: docs/howto/predict.md")
    if found.n_others:
        rest = found.n_others - len(found.others)
        more = f" and {rest} more" * (rest > 0)
        lines.append(f"{found.n_others} other file(s): {', '.join(found.others)}{more}")
    return lines


def hash_lines(found: MeasuredSet, *, whole: bool) -> list[str]:
    """A line for each file with its sha256, whole or its first digits."""
    digests = {one.file: one.sha256 for one in found.recordings}
    digits = None if whole else SHOWN_DIGITS
    return [
        f"{digest[:digits]}  {file.relative_to(found.folder).as_posix()}"
        for file, digest in digests.items()
    ]


def known_lines() -> list[str]:
    """A line for each known set, with its address."""
    facts = [shipped_facts(name) for name in shipped_names()]
    return table_lines(
        ("set", "title", "where to fetch it"),
        [(one.name, one.title, one.fetch) for one in facts],
    )


def table_lines(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a table with columns of even width."""
    cells = [tuple(head), *map(tuple, rows)]
    widths = [max(len(row[column]) for row in cells) for column in range(len(head))]
    return [
        "  ".join(
            cell.ljust(width) for cell, width in zip(row, widths, strict=True)
        ).rstrip()
        for row in cells
    ]


def _rows(found: MeasuredSet) -> list[tuple[str, ...]]:
    """A row for each class of each machine."""
    groups: dict[tuple[str, str], list[MeasuredRecording]] = {}
    for one in found.recordings:
        groups.setdefault((one.machine, one.own_class), []).append(one)
    return [
        (
            machine,
            own,
            ones[0].label or NO_LABEL,
            str(len({one.specimen for one in ones})),
            str(len(ones)),
            str(len({one.file for one in ones})),
            _span(
                [one.shaft_frequency and 60.0 * one.shaft_frequency for one in ones],
                "r/min",
            ),
            _span([one.sampling_rate for one in ones], "Hz"),
            ones[0].unit,
        )
        for (machine, own), ones in groups.items()
    ]


def _span(values: Sequence[float | None], unit: str) -> str:
    """The one value, or the lowest and the highest; a question mark where some are not known."""
    known = sorted({value for value in values if value is not None})
    if not known:
        return "?"
    text = f"{known[0]:g}"
    if len(known) > 1:
        text = f"{known[0]:g} to {known[-1]:g}"
    if None in values:
        text += ", ?"
    return f"{text} {unit}"


def _specimen_lines(found: MeasuredSet) -> list[str]:
    """A sentence for each machine on how many specimens stand behind its labels."""
    lines = []
    for machine in found.machines():
        groups = specimens(found.of_machine(machine))
        counts = ", ".join(f"{label} {len(names)}" for label, names in groups.items())
        line = f"{machine}: specimens {counts or 'of no label'}"
        if groups and max(map(len, groups.values())) == 1:
            line += "; one specimen a class: says nothing about others"
        lines.append(line)
    return lines
