"""Verdict on a forged set: every verb that reads a data set is called on it, with limits.

A verb ends with status 0, 1 or 2. With 2 it has said why in one line, and nothing else may come
out of it: no exception, and no more memory or time than a set of this size needs.
"""

from __future__ import annotations

import contextlib
import io
import os
import resource
import shutil
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from benchmarks._damaged_folders import Mutant
from benchmarks._forged_sets import forge_set
from benchmarks._fuzz_judge import Campaign, Judged, meaning, read_all
from gensig.errors import GensigError

ADDRESS_SPACE = 2 * 1024**3  # bytes that a verb may add
SWALLOWED = ("Unable to allocate", "MemoryError", "cannot allocate", "out of memory")
GENSIG = {
    "verify": ("verify", "{set}"),
    "verify --quick": ("verify", "{set}", "--quick"),
    "inspect": ("inspect", "{set}"),
    "inspect index": ("inspect", "{set}/index.h5"),
    "inspect shard": ("inspect", "{set}/shards/shard-00001.h5"),
    "report": ("report", "{set}", "--out", "{new}.html"),
    "export": ("export", "{set}", "--to", "npz", "--out", "{new}.npz"),
    "reproduce": ("reproduce", "{set}", "--records", "1"),
}
DIAGNOSE = {
    "evaluate": ("evaluate", "data={set}"),
    "train": (
        "train", "data={set}", "out={new}", "epochs=1", "model=cnn", "protocols=[by_unit]",
        "seeds=[0]", "shuffle_control=false", "metadata_probe=false", "baselines=false",
        "n_bootstrap=10", "oracle=false", "n_threads=1",
    ),
}  # fmt: skip
# these change the folder, and so come last
WRITING = {
    "resume": ("resume", "{set}", "--workers", "1"),
    "finalize": ("finalize", "{set}"),
}
READ = "open_dataset"
LINES = "GENSIG_FORGED_LINES"  # likewise: prints the line of each verb
VERBS = "GENSIG_FORGED_VERBS"  # variable of the environment: names of the verbs to call


def judge(
    folder: Path, mutant: Mutant, _whole: dict[str, Any], tell: Callable[[str], None]
) -> Judged:
    """The fault ('' for none), whether anything noticed the forgery, whether a reader refused."""
    faults: list[str] = []
    statuses: dict[str, int] = {}
    for verb, call in _calls(folder).items():
        tell(f": {verb}")
        statuses[verb] = _status(verb, call, faults)
    outside = [path.name for path in folder.parent.iterdir()]
    if any(name.startswith("evil") for name in outside):
        faults.append("wrote a file outside")
    if mutant.refused:
        silent = [
            verb for verb in ("verify", "inspect", READ, "report") if not statuses[verb]
        ]
        faults += [f"{verb} is silent" for verb in silent]
    return "; ".join(faults), any(statuses.values()), statuses.get(READ) != 0


def _calls(folder: Path) -> dict[str, Callable[[], int]]:
    from diagnose.cli import main as diagnose
    from gensig.cli import main as gensig

    new = folder.parent / "new"
    for path in folder.parent.glob("new*"):
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()

    def call(main: Callable[..., int], words: tuple[str, ...]) -> Callable[[], int]:
        typed = [word.format(set=folder, new=new) for word in words]
        return lambda: main(typed)

    def opened() -> int:
        read_all(folder)
        return 0

    calls = {verb: call(gensig, words) for verb, words in GENSIG.items()}
    calls |= {READ: opened}
    calls |= {verb: call(diagnose, words) for verb, words in DIAGNOSE.items()}
    calls |= {verb: call(gensig, words) for verb, words in WRITING.items()}
    chosen = os.environ.get(VERBS)
    if not chosen:
        return calls
    return {verb: calls[verb] for verb in chosen.split(",")}


def _status(verb: str, call: Callable[[], int], faults: list[str]) -> int:
    """Exit status of a verb; adds what it did wrong to the faults."""
    out, said = io.StringIO(), io.StringIO()
    status = 2
    try:
        with (
            _limited(),
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(said),
        ):
            status = call()
    except GensigError as error:
        said.write(f"gensig: {error}\n")
        if "\n" in str(error):
            faults.append(f"{verb}: a message of more than one line")
    except BaseException as error:
        faults.append(f"{verb}: {type(error).__name__}: {str(error)[:200]}")
        return 2
    lines = said.getvalue().splitlines()
    if status not in (0, 1, 2):
        faults.append(f"{verb}: exit status {status}")
    if status == 2 and not (lines and lines[-1].startswith(("gensig: ", "diagnose: "))):
        faults.append(f"{verb}: status 2 without its line")
    text = said.getvalue() + out.getvalue()
    if "Traceback" in text or any(word in text for word in SWALLOWED):
        faults.append(f"{verb}: {text[-300:]}")
    if os.environ.get(LINES):
        print(verb, status, (lines or [""])[-1][:200], flush=True)
    return status


@contextlib.contextmanager
def _limited() -> Iterator[None]:
    """No more address space than now and `ADDRESS_SPACE`."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    limit = pages * resource.getpagesize() + ADDRESS_SPACE
    resource.setrlimit(resource.RLIMIT_AS, (limit, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (hard, hard))


def prepare(template: Path) -> None:
    """Call every verb once on the good set, so that each is loaded and is known to work."""
    scratch = template.parent / f"warm-{os.getpid()}-{threading.get_ident()}"
    folder = scratch / "set"
    shutil.copytree(template, folder)
    faults: list[str] = []
    statuses = {
        verb: _status(verb, call, faults) for verb, call in _calls(folder).items()
    }
    shutil.rmtree(scratch)
    if faults or any(statuses.values()):
        raise RuntimeError(f"the good set is refused: {statuses}, {faults}")


FORGERS = Campaign(change=forge_set, judge=judge, meaning=meaning, prepare=prepare)
