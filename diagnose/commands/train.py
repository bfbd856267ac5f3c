"""``diagnose train``."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from diagnose.commands.parser import add_overrides, refuse_existing
from gensig.errors import ConfigError, Interrupted
from gensig.options.configuration import Configuration
from gensig.terminal.printing import show, tell
from gensig.terminal.warning_lines import one_line_warnings

if TYPE_CHECKING:
    from diagnose.data.windows import Task
    from diagnose.settings import TrainSettings
    from diagnose.training.study_folder import Study

HELP = """\
Train a network and its baselines on splits of a data set and write a report. Default protocols:
new_machine, by_unit and cross_specimen, as far as the data set has them. task=remaining_life
predicts how long each machine still runs, on data sets that run to failure.

  data=DIR    data set made by gensig generate
  out=DIR     folder to write; must not exist, be empty, or hold the same study, which was stopped
              and goes on. Receives report.html, metrics.json, figures, models/

Every other key=value overrides configs/train.yaml, model=NAME chooses a file of configs/model."""
EXAMPLE = """\
examples:
  diagnose train data=runs/quickstart out=runs/report
  diagnose train data=runs/quickstart out=runs/report protocols=[new_machine] seeds=[0,1,2]
  diagnose train data=runs/quickstart out=runs/cross protocols=[cross_speed,unseen_severity_outer]
  diagnose train data=runs/quickstart out=runs/novelty protocols=[healthy_only,open_set]
  diagnose train data=runs/lives out=runs/hours task=remaining_life normalise=none
  diagnose train -m data=runs/quickstart out=runs/levels normalise=rms,none"""


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of the verb."""
    add_overrides(parser)
    parser.add_argument(
        "-m",
        "--multirun",
        action="store_true",
        help="one run for each combination of values a,b",
    )
    parser.add_argument(
        "--config-dir",
        metavar="DIR",
        help="folder with groups and options of your own (default: ./configs, if there)",
    )


def run(arguments: Namespace) -> int:
    """Train, judge and write the report of every combination."""
    from gensig.options.compose import override_keys

    overrides, config_dir = arguments.overrides, arguments.config_dir
    if not arguments.multirun:
        override_keys(overrides)
        study = _study(overrides, config_dir)
        refuse_used(study)
        train_one(study)
        return 0
    jobs = _expand(overrides, config_dir)
    for number, study in enumerate(jobs, start=1):
        out, which = study.out, f"run {number} of {len(jobs)}"
        if _is_complete(out):
            tell(f"{which}: {out} is complete")
            continue
        tell(f"{which}: {out}")
        train_one(study)
    return 0


def refuse_used(study: Study) -> None:
    """Refuse a study's folder that holds anything but the same study, which was stopped.

    Raises
    ------
    DatasetError    also where another process is at work there
    """
    from diagnose.training.study_folder import (
        holds_study,
        is_blank,
        refuse_in_work,
        require_same,
    )

    out = study.out
    refuse_in_work(out)
    if holds_study(out) and not require_same(out, study).is_complete:
        return
    if not is_blank(out):
        refuse_existing(out)


def _is_complete(out: Path) -> bool:
    from diagnose.training.study_folder import holds_study, read_study

    return holds_study(out) and read_study(out).is_complete


def _study(overrides: Sequence[str], config_dir: str | None) -> Study:
    """The study that overrides ask for; options of one's own may be in ./configs."""
    from diagnose.training.study_folder import Study
    from gensig.options.compose import compose
    from gensig.options.own_options import with_own_options
    from gensig.options.typed_only import refuse_untyped

    with one_line_warnings("diagnose"):
        config = with_own_options(
            lambda folder: compose("train", overrides, config_dir=folder), config_dir
        )
    refuse_untyped(config, overrides)
    return Study.of(config)


def _expand(overrides: Sequence[str], config_dir: str | None) -> list[Study]:
    """Studies of a multirun, each with its own ``out``.

    All composed before the first one runs. The folders may be there where the same runs were
    stopped.
    """
    from diagnose.training.study_folder import holds_study, is_blank, require_same
    from gensig.options.compose import job_folders, sweep

    jobs = sweep(overrides, config_dir=config_dir)
    studies = [_study(job, config_dir) for job in jobs]
    parents = {str(study.config["out"]) for study in studies}
    if len(parents) > 1:
        raise ConfigError(
            "out must be one folder; with -m each run gets a folder below it"
        )
    parent = Path(parents.pop())
    studies = [
        study.goes_on(parent / name)
        for study, name in zip(studies, job_folders(jobs), strict=True)
    ]
    done = [
        require_same(study.out, study).is_complete
        for study in studies
        if holds_study(study.out)
    ]
    is_left = parent.is_dir() and all(map(is_blank, parent.iterdir()))
    if done.count(True) == len(studies) or not (done or is_left):
        refuse_existing(parent)
    for study in studies:
        if not _is_complete(study.out):
            refuse_used(study)
    return studies


def train_one(study: Study) -> None:
    """Run a study, or go on with it in a folder that was begun."""
    from diagnose.settings import settings_from
    from diagnose.training.study_folder import holds_study, quoted

    settings = settings_from(Configuration(study.config))
    out = Path(settings.out)
    try:
        page, lines = make_report(settings, study)
    except KeyboardInterrupt:
        if not holds_study(out):
            raise Interrupted("run the same command again") from None
        raise Interrupted(
            f"{out} is incomplete, and diagnose resume {quoted(out)} finishes it"
        ) from None
    show(*lines)
    show(f"report: {page}")


def make_report(settings: TrainSettings, asked: Study) -> tuple[Path, list[str]]:
    """Page and tables of a study, which is written into its folder."""
    from diagnose.data.protocols import left_out_lines
    from diagnose.progress import progress
    from diagnose.recordings.registry import TARGETS
    from diagnose.studies.study import run_study
    from diagnose.training.study_folder import complete_study, study_at_work

    target = TARGETS[settings.task]
    target.study.check(settings)
    task, settings = _opened(settings)
    out = Path(settings.out)
    study = target.study(task=task, settings=settings)
    plan = study.plan()
    for name, reason in plan.baselines_left_out.items():
        tell(f"baseline {name} is left out of {reason}")
    with study_at_work(out, asked) as kept_in:
        for line in left_out_lines(plan.left_out):
            tell(line)
        with progress(len(plan.jobs)) as on_done:
            metrics, runs = run_study(study, plan, kept_in=kept_in, on_done=on_done)
        report = target.report(out, task, metrics, runs)
        page = report.write(out)
        complete_study(out)
    return page, report.lines()


def _opened(settings: TrainSettings) -> tuple[Task, TrainSettings]:
    """Task on the data set, and the settings with what the data set decides.

    Lines on stderr say where windows get another length than usual, and where another network is
    trained than asked for.
    """
    from diagnose.studies.network_choice import settings_for
    from diagnose.studies.study import task_from, window_note
    from gensig.dataset.reader import open_dataset

    task = task_from(open_dataset(settings.data), settings)
    chosen, instead = settings_for(task, settings)
    if instead:
        tell(instead)
    given = replace(chosen, window_samples=settings.window_samples)
    if note := window_note(task.dataset, given):
        tell(note)
    return task, chosen
