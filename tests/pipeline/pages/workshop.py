"""A folder in which the commands of a page run, with everything made that they name."""

import contextlib
import io
import itertools
import os
import re
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from docs_pages import command_lines
from least_runs import least, value_of
from page_files import write_named

import diagnose.cli
import gensig.cli

MAIN = {"gensig": gensig.cli.main, "diagnose": diagnose.cli.main}
QUICKSTART = "gensig generate experiment=quickstart"
TRAIN = "diagnose train data=runs/quickstart protocols=[new_machine]"
LIVES = "gensig generate experiment=run_to_failure"
# name of a folder or file -> command that makes it, where the page has not made it
MADE: Mapping[str, str] = {
    **{
        name: f"{QUICKSTART} out={name}"
        for name in ("runs/quickstart", "runs/quick", "runs/first", "DIR", "runs/large")
    },
    "runs/other": f"{QUICKSTART} seed=2 out=runs/other",
    "runs/faults": f"{QUICKSTART} sensing.snr_db=null dataset.store_healthy_twin=true "
    "plan.n_reference=0 plan.classes=[healthy,missing_tooth] out=runs/faults",
    "runs/lives": f"{LIVES} out=runs/lives",
    "runs/lives2": f"{LIVES} seed=2 out=runs/lives2",
    "report": f"{TRAIN} channels=[pinion_y] out=report",
    "runs/cnn": f"{TRAIN} channels=[pinion_y] model=cnn out=runs/cnn",
    "runs/report": f"{TRAIN} baselines=[tooth_logistic] out=runs/report",
    "runs/hours": "diagnose train data=runs/lives out=runs/hours task=remaining_life "
    "normalise=none",
    "runs/mine": "gensig implant runs/faults out=runs/mine --teeth 29 95 36 90 "
    "--speed-rpm 1480 --healthy monday.csv tuesday.csv",
    "runs/mine_report": "diagnose train data=runs/mine out=runs/mine_report model=cnn",
    "my_machine": "gensig twin healthy.csv --teeth 23 46 --speed 2000 --module 2 "
    "--torque 20 --out my_machine",
    "missing.csv": "gensig simulate fault=missing_tooth operating.speed_rpm=1500 "
    "--output missing.csv",
}
ANSWERS = {"predict": {0, 3}, "detect": {0, 3}}  # statuses that are answers
WRITES = ("--out", "--output", "--plot", "--json", "--orders", "--markdown", "--dir")


@dataclass
class Workshop:
    """The current folder, which is empty at first.

    Attributes
    ----------
    known : what earlier pages made: the words of the command and of those it stands on -> folder
    made : name -> such words, of what lies here
    """

    known: dict[tuple[str, ...], Path]
    made: dict[str, tuple[str, ...]] = field(default_factory=dict)

    def run(self, words: Sequence[str]) -> None:
        """Run the least run of a command.

        Raises
        ------
        AssertionError    if its status is no answer
        """
        words = least([os.path.expandvars(word) for word in words])
        for name in _names(words):
            self._make(name, words)
        out = value_of(words, "out")
        if out and not value_of(words, "executor.shard_index"):
            self._run_or_copy(words, out)
        else:
            _run(words)

    def _run_or_copy(self, words: Sequence[str], out: str) -> None:
        key = self._key(words)
        if self.made.get(out) == key:
            return
        if Path(out).exists():
            shutil.rmtree(out)
        if key in self.known:
            shutil.copytree(self.known[key], out)
        else:
            _run(words)
        self.made[out] = key
        self.known.setdefault(key, Path(out).resolve())

    def _key(self, words: Iterable[str]) -> tuple[str, ...]:
        """Words that decide what a command makes, with those that made what it reads."""
        kept = [word for word in words if not word.startswith("out=")]
        names = [word.partition("=")[2] or word for word in kept]
        stands_on = [self.made[name] for name in names if name in self.made]
        return (*kept, *[word for words in stands_on for word in words])

    def _make(self, name: str, words: Sequence[str]) -> None:
        for known, command in MADE.items():
            is_named = name == known or name.startswith(f"{known}/")
            if is_named and not Path(known).exists():
                ((_, maker),) = command_lines(f"\n    {command}\n")
                self.run(maker)
        if name not in MADE:
            write_named(name, words)


def _names(words: Sequence[str]) -> Iterator[str]:
    """Files and folders that the words of a command may name, without those it writes."""
    for before, word in itertools.pairwise(words):
        if before not in WRITES and not word.startswith("out="):
            yield from re.findall(r"[\w./-]+", word.partition("=")[2] or word)


def _run(words: Sequence[str]) -> None:
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        status = MAIN[words[0]](list(words[1:]))
    assert status in ANSWERS.get(words[1], {0}), f"{words}\n{status}: {said.getvalue()}"
