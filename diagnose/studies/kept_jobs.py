"""Outcomes of finished jobs on disk, from which a study that was stopped goes on.

Each job has two files: arrays as ``.npz``, then a ``.json`` with the rest and the digests of both.
Their name is a digest of everything that an outcome depends on. Nothing else is read, and no
pickle.
"""

from __future__ import annotations

import dataclasses
import hashlib
import io
import json
import math
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnose.data.windows import SUBSETS, Task, subset_segments
from diagnose.networks.domain import Domain
from diagnose.scoring.hours import LifeFacts
from diagnose.scoring.predictions import Prediction, Rows
from diagnose.settings import TrainSettings
from diagnose.studies.result_files import environment
from diagnose.training.model_files import DIGEST, content_digest
from diagnose.training.store import data_fingerprint
from diagnose.training.train import device_of
from gensig.dataset.folder.layout import MANIFEST, read_manifest
from gensig.dataset.storage.atomic import (
    open_part,
    read_text,
    refuse_larger,
    write_bytes,
    write_text,
)
from gensig.errors import DatasetError

# settings that decide no outcome of a job, and the time of an environment
WITHOUT = ("out", "n_threads", "data", "n_bootstrap")
FINISHED = "finished"
# dataclasses that outcomes of jobs are made of
KINDS = {kind.__name__: kind for kind in (Prediction, Rows, Domain, LifeFacts)}
LARGEST_TREE, LARGEST_ARRAYS = 2**26, 2**32  # bytes of the two files

Arrays = list[NDArray[Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class KeptJobs:
    """A place for outcomes of jobs.

    Attributes
    ----------
    folder : exists
    digest : of everything that outcomes depend on, but the job; see `outcomes_digest`
    """

    folder: Path
    digest: str

    def name(self, job: Any) -> str:
        """Name of the files of a job: a digest of it and of everything it depends on."""
        text = json.dumps([self.digest, asdict(job)], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:32]


def kept_jobs(
    task: Task,
    settings: TrainSettings,
    protocols: Sequence[str],
    folder: Path | None,
) -> KeptJobs | None:
    """The place for the outcomes of a study below a folder; None without one."""
    if folder is None:
        return None
    return KeptJobs(folder=folder, digest=outcomes_digest(task, settings, protocols))


def outcomes_digest(
    task: Task, settings: TrainSettings, protocols: Sequence[str]
) -> str:
    """Digest of the data, the splits, the settings, the versions and the device of a study."""
    values = {**asdict(settings), "model": dict(settings.model)}
    versions = environment()
    versions.pop(FINISHED)
    content = {
        "data": data_fingerprint(task.dataset),
        "shards": _shards(task.dataset.folder),
        "sham": _shards(settings.sham),
        "splits": [
            _segments_digest(task, protocol, subset)
            for protocol in protocols
            for subset in SUBSETS
        ],
        "settings": {key: values[key] for key in values if key not in WITHOUT},
        "versions": versions,
        "device": str(device_of(settings.device)),
    }
    text = json.dumps(content, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def _shards(folder: str | Path | None) -> list[str]:
    """Identity of a data set on disk, and the digests of its shards; empty for any other."""
    if folder is None or not (Path(folder) / MANIFEST).is_file():
        return []
    manifest = read_manifest(Path(folder))
    return [manifest.identity, *[entry.sha256 for entry in manifest.shards]]


def _segments_digest(task: Task, protocol: str, subset: str) -> str:
    segments = subset_segments(task, protocol, subset)
    text = json.dumps([protocol, subset, segments.rows()])
    return hashlib.sha256(text.encode()).hexdigest()


def keep_outcomes(
    kept: KeptJobs, job: Any, outcomes: Sequence[Prediction]
) -> list[Prediction]:
    """Write the outcomes of a job, and return them as they are read back.

    Raises
    ------
    DatasetError    where the disk refuses, or gives back something else
    """
    arrays: Arrays = []
    tree = [_encoded(outcome, arrays) for outcome in outcomes]
    buffer = io.BytesIO()
    np.savez(buffer, *arrays)
    raw, path = buffer.getvalue(), kept.folder / kept.name(job)
    content = {
        "job": asdict(job),
        "name": path.name,
        "arrays": {"bytes": len(raw), DIGEST: hashlib.sha256(raw).hexdigest()},
        "outcomes": tree,
    }
    content[DIGEST] = content_digest(content)
    write_bytes(path.with_suffix(".npz"), raw)
    write_text(path.with_suffix(".json"), json.dumps(content, allow_nan=False))
    found = kept_outcomes(kept, job)
    if found is None:
        raise DatasetError(f"{path}.npz cannot be read back; check the disk")
    return found


def kept_outcomes(kept: KeptJobs, job: Any) -> list[Prediction] | None:
    """Outcomes of a job; None where there are none that are whole and belong to this study."""
    path = kept.folder / kept.name(job)
    if not path.with_suffix(".json").is_file():
        return None
    try:
        content = json.loads(read_text(path.with_suffix(".json"), limit=LARGEST_TREE))
        raw = _bytes_of(path.with_suffix(".npz"), content["arrays"]["bytes"])
        is_whole = (
            content.pop(DIGEST) == content_digest(content)
            and content["name"] == path.name
            and content["arrays"][DIGEST] == hashlib.sha256(raw).hexdigest()
        )
        if not is_whole:
            return None
        with np.load(io.BytesIO(raw), allow_pickle=False) as file:
            arrays = [file[f"arr_{index}"] for index in range(len(file.files))]
        return [_decoded(each, arrays) for each in content["outcomes"]]
    except (
        DatasetError,
        OSError,
        ValueError,
        LookupError,
        TypeError,
        AttributeError,
        zipfile.BadZipFile,
    ):
        return None


def _bytes_of(path: Path, n_bytes: int) -> bytes:
    """An ordinary file of at most so many bytes."""
    with open_part(path, part_of="study") as file:
        refuse_larger(path, file, min(n_bytes, LARGEST_ARRAYS), "study")
        return file.read()


def _encoded(value: Any, arrays: Arrays) -> Any:
    """A value as JSON takes it, with the numbers of its arrays."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {
            field.name: _encoded(getattr(value, field.name), arrays)
            for field in dataclasses.fields(value)
        }
        return {"kind": type(value).__name__, "fields": fields}
    if isinstance(value, np.ndarray | np.generic):
        array = np.asarray(value)
        if array.dtype.hasobject:
            raise TypeError(f"an array of {array.dtype} cannot be kept")
        arrays.append(array)
        form = "array" if isinstance(value, np.ndarray) else "number"
        return {form: len(arrays) - 1}
    if isinstance(value, Mapping):
        pairs = [[key, _encoded(value[key], arrays)] for key in value]
        return {"mapping": pairs}
    if isinstance(value, tuple | list):
        form = "tuple" if isinstance(value, tuple) else "list"
        return {form: [_encoded(each, arrays) for each in value]}
    if isinstance(value, float) and not math.isfinite(value):
        return {"float": repr(value)}
    if value is None or isinstance(value, str | int | float):
        return value
    raise TypeError(f"a {type(value).__name__} cannot be kept")


def _decoded(tree: Any, arrays: Arrays) -> Any:
    """The value of a tree of `_encoded`."""
    if not isinstance(tree, dict):
        return tree
    if "kind" in tree:
        fields = {
            name: _decoded(value, arrays) for name, value in tree["fields"].items()
        }
        return KINDS[tree["kind"]](**fields)
    ((form, value),) = tree.items()
    if form == "array":
        return arrays[value]
    if form == "number":
        return arrays[value][()]
    if form == "mapping":
        return {key: _decoded(each, arrays) for key, each in value}
    if form == "float":
        return float(value)
    members = [_decoded(each, arrays) for each in value]
    return {"tuple": tuple, "list": list}[form](members)
