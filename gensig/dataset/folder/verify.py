"""Verification that a data set is whole and unaltered; nothing is repaired."""

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from gensig.dataset.columns import COLUMNS
from gensig.dataset.folder.layout import (
    CONFIG,
    INDEX,
    MANIFEST,
    PLAN,
    SHARDS,
    SPLITS,
    Manifest,
    ShardEntry,
    read_config,
    read_manifest,
)
from gensig.dataset.folder.manifest import file_digests, identity_hash
from gensig.dataset.folder.quick_check import (
    label_problem,
    plan_digest,
    records_problem,
    size_problem,
    unlisted_files,
)
from gensig.dataset.plan import Plan, read_plan
from gensig.dataset.schema import SCALES
from gensig.dataset.splitting.split_check import split_problems
from gensig.dataset.splitting.splits import read_split
from gensig.dataset.storage.atomic import sha256_file
from gensig.dataset.storage.attributes import HDF5_ERRORS, read_attributes
from gensig.dataset.storage.checksums import differences
from gensig.dataset.storage.guard import (
    datasets,
    first_line,
    open_shard,
    read_rows,
    shard_labels,
    unknown_class,
)
from gensig.dataset.storage.index_check import index_problem
from gensig.dataset.storage.quantization import is_scale, read_signal
from gensig.errors import DatasetError


@dataclass(frozen=True, slots=True, kw_only=True)
class VerifyResult:
    """Result of `verify`.

    Parameters
    ----------
    problems : list       one line each; that the data set was never closed is one
    n_records : int       records the data set is meant to have
    n_failed : int        records whose simulation failed; they are no problem, but no silence
                          either
    """

    problems: list[str]
    n_records: int
    n_failed: int

    @property
    def complete(self) -> bool:
        """True only for a closed data set without any problem."""
        return not self.problems


def verify(folder: Path, *, quick: bool = False) -> VerifyResult:
    """Check state, sha256, sizes, rows, schema, plan, splits, scales and values of a data set.

    Parameters
    ----------
    folder : Path
    quick : bool     look at the manifest, names and sizes only

    Raises
    ------
    DatasetError    when the folder is no data set
    """
    folder = Path(folder)
    try:
        manifest = read_manifest(folder)
    except DatasetError as error:
        if not (folder / MANIFEST).is_file():
            raise
        return VerifyResult(problems=[str(error)], n_records=0, n_failed=0)
    problems = _unfinished(folder, manifest) + damage(folder, manifest, quick=quick)
    return VerifyResult(
        problems=problems,
        n_records=manifest.n_records,
        n_failed=manifest.n_failed,
    )


def damage(folder: Path, manifest: Manifest, *, quick: bool = False) -> list[str]:
    """Problems of a data set as far as it is made, one line each; see `verify`."""
    n_planned = plan_digest(folder)[1]
    if 0 < n_planned < len(manifest.shards):
        # each shard holds a record: the manifest was made up, and its shards are not looked for
        return [records_problem(n_planned, manifest)]
    problems = _file_names(folder, manifest) + _extra_files(folder, manifest)
    if manifest.is_complete:
        problems += [
            difference.line for difference in differences(folder, manifest, quick=quick)
        ]
    plan = None
    if not quick:
        lines, plan = _tables(folder, manifest, n_planned)
        problems += lines
        if plan is not None:
            problems += _splits(folder, manifest, plan)
    starts = np.cumsum([0, *manifest.shard_sizes])
    reference: dict | None = None
    for i, entry in enumerate(manifest.shards):
        if entry.state != "done":
            continue
        path = folder / SHARDS / entry.name
        differing = _bytes_differ(path, entry, manifest, quick=quick)
        problems += differing
        if quick or not path.is_file():
            continue
        try:
            with open_shard(path, folder=folder) as file:
                if not differing:
                    problems += _label_differs(file, entry, manifest, i)
                    if reference is None:
                        reference = _description(file, path)
                        problems += _index(folder, manifest, file)
                    problems += _description_differs(file, path, reference)
                lines = _rows_differ(file, entry, plan, int(starts[i]))
                # A damaged file can have thousands of wrong rows: one line is enough.
                if differing:
                    lines = lines[:1]
                problems += lines
        except DatasetError as error:
            problems.append(str(error))
        except HDF5_ERRORS as error:
            problems.append(
                f"{entry.name} cannot be read ({first_line(error)}); it is damaged"
            )
    return problems


def _unfinished(folder: Path, manifest: Manifest) -> list[str]:
    problems = [
        f"{entry.name} could not be made; run `gensig resume {folder}`"
        for entry in manifest.shards
        if entry.state == "failed"
    ]
    if not manifest.is_complete:
        problems.append(
            f"incomplete: {manifest.n_done} of {len(manifest.shards)} shards are done and the "
            f"data set was never closed; run `gensig resume {folder}`"
        )
    return problems


def _file_names(folder: Path, manifest: Manifest) -> list[str]:
    """Files that the manifest should list, that are missing, and that it should not have."""
    problems, present = unlisted_files(manifest), []
    if manifest.is_complete:
        present = sorted(
            f"{SPLITS}/{path.name}" for path in (folder / SPLITS).glob("*")
        )
    for name in manifest.files:
        if not (folder / name).is_file():
            problems.append(f"{name} is missing")
    for name in present:
        if name not in manifest.files:
            problems.append(f"{name!a} is extra: the manifest does not list it")
    return problems


def _extra_files(folder: Path, manifest: Manifest) -> list[str]:
    """Files in `shards` that the manifest does not know.

    An interrupted run may have unfinished ones.
    """
    if not (folder / SHARDS).is_dir():
        return [f"the folder {SHARDS} is missing"]
    known = {entry.name for entry in manifest.shards}
    names = sorted(path.name for path in (folder / SHARDS).iterdir())
    if not manifest.is_complete:
        names = [name for name in names if not name.startswith(".")]
    return [
        f"{SHARDS}/{name!a} is extra: no shard of this data set"
        for name in names
        if name not in known
    ]


def _tables(
    folder: Path, manifest: Manifest, n_planned: int
) -> tuple[list[str], Plan | None]:
    """Plan, configuration, splits and index against the manifest."""
    problems = [
        f"{name} was altered: its sha256 is not the one in the manifest"
        for name, recorded, actual in file_digests(folder, manifest)
        if actual and actual != recorded
    ]
    version, identity = manifest.generator_version, manifest.identity
    try:
        config = read_config(folder)
        if identity_hash(config, version) != identity:
            problems.append(
                f"{CONFIG} and the identity in the manifest do not belong together; one was altered"
            )
        begun = manifest.configuration
        if begun and identity_hash(begun, version) != identity:
            problems.append(
                f"{MANIFEST} has a configuration and an identity that do not belong together"
            )
        if "seed" in config and config["seed"] != manifest.seed:
            problems.append(
                f"{CONFIG} has seed {config['seed']!r} and the manifest {manifest.seed}; one was "
                "altered"
            )
    except DatasetError as error:
        problems.append(str(error))
    if n_planned > manifest.n_records:  # not read: it may be of any size
        return [*problems, records_problem(n_planned, manifest)], None
    try:
        plan = read_plan(folder / PLAN)
    except DatasetError as error:
        return [*problems, str(error)], None
    if problem := records_problem(plan.n_records, manifest):
        return [*problems, problem], None
    if plan.shard_sizes() != manifest.shard_sizes:
        line = f"{PLAN} and the manifest have different shards; one was altered"
        return [*problems, line], None
    return problems, plan


def _splits(folder: Path, manifest: Manifest, plan: Plan) -> list[str]:
    """Splits that do not keep apart what their protocol says."""
    problems = []
    for path in sorted(folder / name for name in manifest.files):
        if path.parent.name != SPLITS or not path.is_file():
            continue
        try:
            table = read_split(path, n_records=plan.n_records)
            lines = split_problems(path.stem, table, plan)
            problems += [f"{SPLITS}/{line}" for line in lines]
        except DatasetError as error:
            problems.append(str(error))
    return problems


def _bytes_differ(
    path: Path, entry: ShardEntry, manifest: Manifest, *, quick: bool
) -> list[str]:
    if problem := size_problem(path, entry):
        return [problem]
    if quick:
        return []
    digest = sha256_file(path)
    if digest == entry.sha256:
        return []
    for other in manifest.shards:
        if other.sha256 == digest:
            return [f"{entry.name} is swapped: it holds what belongs in {other.name}"]
    return [
        f"{entry.name} was altered: its sha256 is {digest[:12]}..., recorded is "
        f"{entry.sha256[:12]}..."
    ]


def _description(file: h5py.File, path: Path) -> dict:
    """Types, shapes and attributes, which all shards of one data set share."""
    shapes = {
        name: (str(data.dtype), data.shape[1:])
        for name, data in datasets(file, path).items()
    }
    return {"data sets": shapes, "attributes": read_attributes(file)}


def _description_differs(file: h5py.File, path: Path, reference: dict) -> list[str]:
    problems = []
    for part, actual in _description(file, path).items():
        expected = reference[part]
        names = [
            name
            for name in sorted(actual | expected)
            if repr(actual.get(name)) != repr(expected.get(name))
        ]
        if names:
            problems.append(
                f"{path.name} is foreign: its {part} {', '.join(names)} differ from those of the "
                "other shards"
            )
    return problems


def _index(folder: Path, manifest: Manifest, shard: h5py.File) -> list[str]:
    """The first reason why the index is not the one over the shards, where there is one."""
    if not manifest.is_complete or not (folder / INDEX).exists():
        return []
    problem = index_problem(folder, manifest, shard)
    return [problem] if problem else []


def _label_differs(
    file: h5py.File, entry: ShardEntry, manifest: Manifest, index: int
) -> list[str]:
    problem = label_problem(shard_labels(file), manifest, index)
    if problem:
        return [f"{entry.name} {problem}"]
    classes = read_attributes(file)["class_names"]
    if problem := unknown_class(read_rows(file["label"]), classes):
        return [f"{entry.name}: {problem}"]
    return []


def _rows_differ(
    file: h5py.File, entry: ShardEntry, plan: Plan | None, start: int
) -> list[str]:
    """Row count, rows against the plan, failed records, scales, finite signals."""
    name = entry.name
    n = file["record_id"].shape[0]
    if n != entry.rows:
        return [f"{name} has {n} rows, recorded are {entry.rows}"]
    problems = []
    for column in COLUMNS.values():
        # Other inputs may be refined while simulating; names and labels never.
        if plan is None or column.role not in ("id", "label", "unit"):
            continue
        if column.name not in plan.columns or column.name not in file:
            continue
        planned = plan.columns[column.name][start : start + n]
        stored = read_rows(file[column.name])
        wrong = np.flatnonzero(planned != stored)
        if wrong.size:
            i = int(wrong[0])
            problems.append(
                f"{name} row {i}: {column.name} is {stored[i].item()!a}, the plan says "
                f"{planned[i].item()!a} ({wrong.size} such rows)"
            )
            if column.name == "record_id":
                return problems
    failed = read_rows(file["status"]) != "ok"
    if int(failed.sum()) != entry.n_failed:
        problems.append(
            f"{name} has {int(failed.sum())} failed records, recorded are {entry.n_failed}"
        )
    for row, is_failed in enumerate(failed.tolist()):
        lines = _signal_problems(file, row, failed=is_failed)
        problems += [f"{name} row {row}: {line}" for line in lines]
    return problems


def _signal_problems(file: h5py.File, row: int, *, failed: bool) -> list[str]:
    """Invalid scales, and signals that are not finite although the record did not fail."""
    problems = []
    for name, scale_name in SCALES.items():
        if name not in file:
            continue
        if file[name].dtype.kind == "i":
            scale = file[scale_name][row]
            wrong = ~(is_scale(scale) | (np.isnan(scale) & failed))
            if wrong.any():
                problems.append(
                    f"{scale_name} is {scale[wrong][0]}; it must be positive and finite"
                )
                continue
        if not failed and not np.isfinite(read_signal(file, name, row)).all():
            problems.append(f"{name} is not finite, but its status is ok")
    return problems
