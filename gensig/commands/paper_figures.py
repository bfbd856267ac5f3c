"""``gensig figures``: the figures of a paper, ours beside what is printed."""

from __future__ import annotations

import textwrap
from argparse import Namespace
from pathlib import Path

from gensig.commands.console import replaced_file
from gensig.errors import ConfigError
from gensig.terminal.printing import show, show_text
from gensig.terminal.warning_lines import one_line_warnings

WIDTH = 90  # letters of a line of a reason


def figures(arguments: Namespace) -> int:
    """Write a PNG and a CSV for every figure asked for, and print what differs and why.

    Raises
    ------
    ConfigError    for an unknown paper or figure
    """
    from gensig.commands.figures.panels import draw
    from gensig.commands.figures.paper_drawing import paper_page
    from gensig.papers.registry import PAPERS

    if arguments.paper not in PAPERS:
        raise ConfigError(
            f"gensig figures {arguments.paper}: no such paper; take one of {', '.join(PAPERS)}"
        )
    paper = PAPERS[arguments.paper]
    numbers = arguments.numbers or list(paper.figures)
    for number in numbers:
        if number not in paper.figures:
            raise ConfigError(
                f"gensig figures {arguments.paper} {number}: simulation draws figures "
                f"{', '.join(paper.figures)} of this paper"
            )
    folder = Path(arguments.dir)
    if folder.exists() and not folder.is_dir():
        raise ConfigError(f"--dir {folder}: a file has this name; give a folder")
    folder.mkdir(parents=True, exist_ok=True)
    show(paper.title)
    for number in numbers:
        with one_line_warnings("gensig"):
            figure = paper.figures[number]()
        stem = folder / f"{arguments.paper}_{number}"
        with (
            replaced_file(stem.with_suffix(".csv")) as path,
            path.open("w", encoding="utf-8", newline="") as file,
        ):
            figure.write_csv(file)
        with replaced_file(stem.with_suffix(".png")) as path:
            draw(paper_page(figure), path)
        show(f"{stem}.png and .csv: {figure.title}")
        show_text(textwrap.indent(textwrap.fill(figure.reason, WIDTH), "    "))
    return 0
