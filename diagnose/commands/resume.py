"""``diagnose resume``."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from gensig.errors import DatasetError
from gensig.terminal.printing import show

if TYPE_CHECKING:
    from diagnose.training.study_folder import Study

HELP = """\
Finish a study that was stopped: by Ctrl-C, a kill, a batch system or a power cut.

Trainings that were finished are kept and not repeated. The result is that of a study that was never
stopped, bit for bit on the same processor. The same diagnose train command does the same; it may
give another n_threads."""
EXAMPLE = """\
examples:
  diagnose resume runs/report"""


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the verb."""
    parser.add_argument("folder", metavar="DIR", help="of diagnose train, its out=DIR")


def run(arguments: Namespace) -> int:
    """Go on with the study of a folder, and write its report."""
    from diagnose.commands.train import train_one
    from diagnose.training.study_folder import (
        complete_study,
        read_study,
        refuse_in_work,
    )

    out = Path(arguments.folder)
    refuse_in_work(out)
    study = read_study(out)
    if study.is_complete:
        complete_study(out)
        show(f"{out} is complete")
        return 0
    _refuse_other_keys(study, out)
    train_one(study.goes_on(out))
    return 0


def _refuse_other_keys(study: Study, out: Path) -> None:
    """Raise DatasetError for a study with other keys than those that this version knows."""
    from gensig.options.compose import compose

    known = compose("train", ["data=.", "out=."])
    if keys := sorted(set(study.config) ^ set(known)):
        raise DatasetError(
            f"{out} was begun by another version of gensig, with other keys "
            f"({', '.join(keys[:3])}); remove it and train again"
        )
