"""Creation of a data-set folder: plan, splits and, last, the manifest."""

from collections.abc import Sequence
from pathlib import Path

import yaml

from gensig.dataset.folder.environment import environment
from gensig.dataset.folder.layout import (
    BEGINNING,
    CONFIG,
    MANIFEST,
    OVERRIDES,
    PLAN,
    SHARDS,
    SPLITS,
    ConfigContent,
    Manifest,
    ShardEntry,
    read_manifest,
    shard_name,
    write_manifest,
)
from gensig.dataset.folder.manifest import deciding, identity_hash, stored_config
from gensig.dataset.plan import Plan, plan_text
from gensig.dataset.schema import version_of
from gensig.dataset.splitting.protocols import make_splits
from gensig.dataset.storage.atomic import (
    TEMPORARY_SUFFIX,
    at_work,
    cannot_write,
    locked,
    sha256_text,
    write_text,
)
from gensig.dataset.storage.made_together import made_together, remove
from gensig.errors import DatasetError


def create_folder(
    out: Path,
    *,
    config: ConfigContent,
    overrides: Sequence[str],
    plan: Plan,
    seed: int,
    generator_version: str,
) -> None:
    """Make a data-set folder with plan, splits and manifest, ready to take shards.

    The manifest is written last. Until it is there, a note says that the folder is being begun:
    one whose process was killed meanwhile is known by it, and is begun anew by the next call.

    Parameters
    ----------
    out : Path           a folder that does not exist, is empty, or was left by a call that was
                         killed
    config : dict        resolved configuration, plain values
    overrides : list     what the user typed
    plan : Plan          all records; it fixes the shards
    seed : int           root seed, also of the splits
    generator_version : str

    Raises
    ------
    DatasetError    when `out` holds anything else, before anything is touched; when the disk
                    refuses, after which nothing new is left
    """
    out = Path(out)
    typed = list(map(str, overrides))
    texts = {
        CONFIG: config_text(config),
        OVERRIDES: yaml.safe_dump(typed, allow_unicode=True),
        PLAN: plan_text(plan),
    }
    for name, table in make_splits(plan, seed).items():
        texts[f"{SPLITS}/{name}.csv"] = table.to_csv()
    note = {BEGINNING: "This folder is being made by gensig.\n"}
    manifest = Manifest(
        schema_version=version_of(plan.columns),
        generator_version=generator_version,
        identity=identity_hash(config, generator_version),
        seed=seed,
        n_records=plan.n_records,
        shards=tuple(
            ShardEntry(name=shard_name(i), rows=rows)
            for i, rows in enumerate(plan.shard_sizes())
        ),
        files={name: sha256_text(text) for name, text in texts.items()},
        configuration=deciding(config),
        environment=environment(),
    )
    try:
        with made_together() as made:
            refuse_used(out)
            made.folder(out)
            with locked(out):
                _refuse_begun_meanwhile(out)
                _clear(out)
                for name, text in (note | texts).items():
                    made.folder((out / name).parent)
                    write_text(made.file(out / name), text)
                made.folder(out / SHARDS)
                made.file(out / MANIFEST)
                write_manifest(out, manifest)
                (out / BEGINNING).unlink()
    except OSError as error:
        raise cannot_write(out, error) from error


def config_text(config: ConfigContent) -> str:
    """A configuration as `config.yaml` holds it."""
    stored = stored_config(config)
    return yaml.safe_dump(stored, sort_keys=False, allow_unicode=True)


def refuse_used(out: Path) -> None:
    """Raise DatasetError where a folder holds anything but a beginning that was killed.

    The line says where another process is at work there.
    """
    if out.is_dir():
        if _is_used(out):
            raise DatasetError(f"{out} {_contents(out)}")
    elif out.exists() or out.is_symlink():
        raise DatasetError(f"{out} exists and is no folder; choose another out=DIR")


def _refuse_begun_meanwhile(out: Path) -> None:
    """Raise DatasetError where another process has begun the folder that is locked here.

    What that process does there is not asked, since the question takes this lock.
    """
    if _is_used(out):
        raise DatasetError(
            f"{out} is not empty: another process has begun a data set there meanwhile; choose "
            "another out=DIR"
        )


def _contents(out: Path) -> str:
    """Words on the contents that stand in the way of a new data set, and on the remedy."""
    try:
        manifest = read_manifest(out)
    except DatasetError:
        return "exists and is not empty; choose another out=DIR or empty it first"
    if manifest.is_complete:
        return (
            f"is not empty: a complete data set of {manifest.n_records} records; choose another "
            "out=DIR"
        )
    with at_work(out / SHARDS, others=False):
        pass  # else another process is making it, which the error says
    kind = "an interrupted" if manifest.n_done else "a planned"
    done = f"{manifest.n_made} of {manifest.n_records} records done"
    return (
        f"is not empty: {kind} data set, {done}; `gensig resume {out}` finishes it, another "
        "out=DIR begins one"
    )


def _is_used(out: Path) -> bool:
    """False for an empty folder, and for one with what `create_folder` left where it was killed.

    That is its note, and files from before its manifest.
    """
    names = {path.name for path in out.iterdir() if not _is_temporary(path)}
    if not names:  # empty, or killed while it wrote the note
        return not all(path.name.startswith(f".{BEGINNING}.") for path in out.iterdir())
    parts = [out / part for part in (SHARDS, SPLITS) if part in names]
    inside = [path for part in parts if part.is_dir() for path in part.iterdir()]
    return not (
        BEGINNING in names
        and names <= {BEGINNING, CONFIG, OVERRIDES, PLAN, SHARDS, SPLITS}
        and all(part.is_dir() and not part.is_symlink() for part in parts)
        and all(
            path.parent.name == SPLITS
            and (path.suffix == ".csv" or _is_temporary(path))
            for path in inside
        )
    )


def _is_temporary(path: Path) -> bool:
    return path.match(f".*{TEMPORARY_SUFFIX}") and path.is_file()


def _clear(out: Path) -> None:
    """Remove what a killed beginning left, its note last."""
    paths = sorted(
        out.rglob("*"),
        key=lambda path: (path.name != BEGINNING, len(path.parts)),
        reverse=True,
    )
    for path in paths:
        remove(path)
