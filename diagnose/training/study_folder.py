"""The folder of a study while it is made: what it was begun with, and one process at work in it.

``study.json`` holds the configuration and says if the study is complete. Results of finished jobs
lie in ``finished_jobs`` until then (`diagnose.studies.kept_jobs`).
"""

from __future__ import annotations

import json
import os
import shlex
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from diagnose.training.model_files import DIGEST, content_digest
from gensig.dataset.storage.atomic import (
    TEMPORARY_SUFFIX,
    at_work,
    cannot_write,
    read_text,
    write_text,
)
from gensig.errors import DatasetError
from gensig.options.configuration import Configuration
from gensig.version import __version__

STUDY, FINISHED_JOBS = "study.json", "finished_jobs"
STUDY_SCHEMA_VERSION = 1
LARGEST_STUDY = 2**20  # bytes
# keys that decide no bit of a result, and may differ from one run to the next
FREE_KEYS = ("out", "n_threads")
MOST_NAMED = 5  # keys in a message


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """Content of ``study.json``.

    Attributes
    ----------
    gensig : version that began it
    data_folder : absolute path of the data set, from which ``config`` may name it otherwise
    config : composed configuration of ``diagnose train``, plain values
    is_complete : True once everything is written
    """

    gensig: str
    data_folder: str
    config: dict[str, Any]
    is_complete: bool = False

    @classmethod
    def of(cls, config: Configuration) -> Study:
        """The study that a composed configuration begins."""
        return cls(
            gensig=__version__,
            data_folder=_absolute(config["data"]),
            config=config.plain(),
        )

    @property
    def out(self) -> Path:
        """Its folder, as configured."""
        return Path(self.config["out"])

    def goes_on(self, out: Path) -> Study:
        """The same study in a folder that may have been moved."""
        config = dict(self.config)
        if _absolute(config["out"]) != _absolute(out):
            config["out"] = str(out)
        if _absolute(config["data"]) != self.data_folder:
            config["data"] = self.data_folder
        return replace(self, config=config)


def holds_study(out: Path) -> bool:
    """True for a folder in which a study was begun by a version that writes ``study.json``."""
    return os.path.lexists(out / STUDY)


def is_blank(out: Path) -> bool:
    """True for a folder that was killed before it held anything, or that does not exist."""
    if not out.is_dir() or out.is_symlink():
        return not os.path.lexists(out)
    kept = out / FINISHED_JOBS
    if kept.is_symlink() or any(kept.glob("*.json")):
        return False
    others = [path for path in out.iterdir() if path != kept]
    return all(path.match(f".{STUDY}.*{TEMPORARY_SUFFIX}") for path in others)


def refuse_in_work(out: Path) -> None:
    """Raise DatasetError for the folder of a study that another process is making."""
    with at_work(out / FINISHED_JOBS, others=False):
        return


def refuse_unfinished(out: Path) -> None:
    """Raise DatasetError for the folder of a study that is being made, or was stopped."""
    if not holds_study(out):
        return
    refuse_in_work(out)
    if not read_study(out).is_complete:
        raise DatasetError(
            f"{out} is a study that was stopped; diagnose resume {quoted(out)} finishes it"
        )


def read_study(out: Path) -> Study:
    """Content of the ``study.json`` of a folder.

    Raises
    ------
    DatasetError    for a file that is missing, altered, or of another version of the format
    """
    path = out / STUDY
    if not holds_study(out):
        raise DatasetError(
            f"{out} holds no {STUDY}; give a folder that diagnose train began"
        )
    try:
        content = json.loads(read_text(path, limit=LARGEST_STUDY))
        version = content.pop("study_schema_version")
        digest = content.pop(DIGEST)
        study = Study(**content)
        is_whole = digest == content_digest(_content(study, version))
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise _altered(path) from error
    if version != STUDY_SCHEMA_VERSION:
        raise DatasetError(
            f"{path}: study schema {version!r}, this program reads {STUDY_SCHEMA_VERSION}"
        )
    if not is_whole:
        raise _altered(path)
    return study


def _altered(path: Path) -> DatasetError:
    return DatasetError(
        f"{path} is damaged or was altered; remove {path.parent} and train again"
    )


def require_same(out: Path, asked: Study) -> Study:
    """The study of a folder, which was begun with the configuration that is asked for.

    Raises
    ------
    DatasetError    as `read_study`, and for another configuration, with the keys that differ
    """
    study = read_study(out)
    names = sorted({*asked.config, *study.config} - {*FREE_KEYS, "data"})
    keys = [name for name in names if asked.config.get(name) != study.config.get(name)]
    if asked.data_folder != study.data_folder:
        keys.insert(0, "data")
    if keys:
        listed = ", ".join(keys[:MOST_NAMED])
        raise DatasetError(
            f"out={out} was begun with another {listed}; leave that out, choose another out=DIR "
            "or remove it: only n_threads may change"
        )
    return study


@contextmanager
def study_at_work(out: Path, asked: Study) -> Iterator[Path]:
    """Folder for results of finished jobs, below that of a study which is made in this block.

    The study is begun where ``out`` holds none. Where it is ended by an error before any job is
    finished, nothing of it is left.

    Raises
    ------
    DatasetError    where another process is at work there, for a study of another configuration,
        and where the disk refuses
    """
    jobs = out / FINISHED_JOBS
    try:
        jobs.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(out, error) from error
    with at_work(jobs, others=False):
        if holds_study(out):
            require_same(out, asked)
        else:
            _write(out, asked)
        try:
            yield jobs
        except Exception:
            if not any(jobs.glob("*.json")):
                (out / STUDY).unlink(missing_ok=True)
                shutil.rmtree(jobs, ignore_errors=True)
            raise


def complete_study(out: Path) -> None:
    """Say that a study is complete, and remove the results of its jobs."""
    study = read_study(out)
    if not study.is_complete:
        _write(out, replace(study, is_complete=True))
    shutil.rmtree(out / FINISHED_JOBS, ignore_errors=True)


def quoted(out: Path) -> str:
    """A folder as it is typed."""
    return shlex.quote(str(out))


def _write(out: Path, study: Study) -> None:
    content = _content(study, STUDY_SCHEMA_VERSION)
    content[DIGEST] = content_digest(content)
    write_text(out / STUDY, json.dumps(content, indent=2, allow_nan=False) + "\n")


def _content(study: Study, version: Any) -> dict[str, Any]:
    facts: Mapping[str, Any] = {
        "study_schema_version": version,
        "gensig": study.gensig,
        "is_complete": study.is_complete,
        "data_folder": study.data_folder,
        "config": study.config,
    }
    return dict(facts)


def _absolute(path: Any) -> str:
    return os.path.abspath(str(path))
