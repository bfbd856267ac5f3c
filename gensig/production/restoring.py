"""Files of a data set that were lost and follow from its configuration."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from gensig.dataset.folder.layout import (
    INDEX,
    PLAN,
    SHARDS,
    SPLITS,
    Manifest,
)
from gensig.dataset.plan import Plan, plan_text, read_plan
from gensig.dataset.splitting.protocols import make_splits
from gensig.dataset.storage.atomic import sha256_text, write_text
from gensig.dataset.storage.index import write_index
from gensig.errors import DatasetError


def restore_tables(out: Path, manifest: Manifest, make: Callable[[], Plan]) -> None:
    """Make the plan and the splits again that a folder lacks.

    Parameters
    ----------
    out : folder of a data set
    manifest : its manifest
    make : makes its plan

    Raises
    ------
    DatasetError    for a file that is lost and follows from no other, and for one that would have
                    another sha256 than the manifest says
    """
    lost = [name for name in manifest.files if not (out / name).exists()]
    for name in lost:
        if name not in (PLAN, INDEX) and not name.startswith(f"{SPLITS}/"):
            raise DatasetError(f"{out / name} is missing; restore it from a copy")
    for folder in (SHARDS, SPLITS):
        (out / folder).mkdir(exist_ok=True)
    if PLAN in lost:
        _restore(out, manifest, PLAN, lambda: plan_text(make()))
    splits = [name for name in lost if name.startswith(f"{SPLITS}/")]
    if splits:
        plan = read_plan(out / PLAN, sha256=manifest.files.get(PLAN))
        tables = make_splits(plan, manifest.seed)
        for name in splits:
            table = tables.get(Path(name).stem)
            if table is None:
                raise DatasetError(f"{out / name} is missing; restore it from a copy")
            _restore(out, manifest, name, table.to_csv)


def _restore(out: Path, manifest: Manifest, name: str, make: Callable[[], str]) -> None:
    text = make()
    if sha256_text(text) != manifest.files[name]:
        raise _other_bits(out / name)
    write_text(out / name, text)


def restore_index(out: Path, manifest: Manifest) -> None:
    """Write `index.h5` of a complete set again where it is missing.

    Raises
    ------
    DatasetError    where it has another sha256 than the manifest says; it is removed then
    """
    path = out / INDEX
    if path.exists():
        return
    if write_index(out, manifest) != manifest.files[INDEX]:
        path.unlink()
        raise _other_bits(path)


def _other_bits(path: Path) -> DatasetError:
    return DatasetError(
        f"{path} is missing and would have other bits when made again here; restore it from a "
        "copy"
    )
