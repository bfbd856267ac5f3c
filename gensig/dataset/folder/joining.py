"""Continuation of a data-set folder by the version and configuration that began it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from gensig.dataset.folder.layout import (
    CONFIG,
    PLAN,
    ConfigContent,
    Manifest,
    read_config,
    read_manifest,
)
from gensig.dataset.folder.manifest import differing_keys, identity_hash
from gensig.dataset.folder.quick_check import plan_problem
from gensig.dataset.storage.compression import COMPRESSIONS, creation_options
from gensig.errors import DatasetError
from gensig.version import __version__

IMPLANTS = "implants"  # section of the configuration of a set of implants


def joined_folder(
    out: Path,
    *,
    asked: ConfigContent | None = None,
    restore: Callable[[Manifest, ConfigContent], None] | None = None,
) -> tuple[Manifest, ConfigContent]:
    """Manifest and configuration of a folder that this version and configuration began.

    Parameters
    ----------
    out : folder of a data set
    asked : a configuration that must agree with the folder's in all that decides bits
    restore : makes tables again that are lost, before the plan is looked at

    Raises
    ------
    DatasetError    for another version, a configuration that was changed (with the keys that
                    differ), a compression whose package is missing, and a plan that is missing or
                    was changed
    """
    manifest, config = read_manifest(out), read_config(out)
    if manifest.generator_version != __version__:
        raise DatasetError(
            f"{out} was begun by gensig {manifest.generator_version}, this is gensig "
            f"{__version__}, whose bits may differ: go on with that version, or start a new "
            "folder"
        )
    if identity_hash(config, __version__) != manifest.identity:
        begun, where = manifest.configuration, ""
        if begun and identity_hash(begun, __version__) == manifest.identity:
            where = f" in {_listed(differing_keys(begun, config))}"
        raise DatasetError(
            f"{out / CONFIG} was changed{where} since the folder was begun; undo that, or start "
            "a new folder"
        )
    if asked is not None and (keys := differing_keys(config, asked)):
        raise DatasetError(
            f"{out} was begun with another {_listed(keys)}; leave that out, or start a new "
            "folder: only executor.* may change"
        )
    _check_sections(out / CONFIG, config)
    creation_options(config["dataset"]["compression"])  # its package may be missing
    if restore is not None:
        restore(manifest, config)
    if not (out / PLAN).is_file():
        raise DatasetError(
            f"{out / PLAN} is missing; `gensig resume {out}` makes it again"
        )
    if problem := plan_problem(out, manifest):
        raise DatasetError(
            f"{out}: {problem}; the plan was changed since the folder was begun: restore it, or "
            "start a new folder"
        )
    return manifest, config


def refuse_implants(out: Path, config: ConfigContent) -> None:
    """Raise DatasetError for a set of implants, where records are to be simulated."""
    if IMPLANTS in config:
        raise DatasetError(
            f"{out} is made of recordings, which no simulation makes again: `gensig verify` "
            "checks it, the same `gensig implant` into another folder makes it anew"
        )


def _check_sections(path: Path, config: ConfigContent) -> None:
    """Raise DatasetError for a configuration of a stranger without classes or a compression."""
    plan, dataset = config.get("plan"), config.get("dataset")
    classes = plan.get("classes") if isinstance(plan, dict) else None
    if not isinstance(classes, list) or {*map(type, classes)} != {str}:
        raise DatasetError(f"{path}: plan.classes must be a list of names")
    compression = dataset.get("compression") if isinstance(dataset, dict) else None
    if compression not in list(COMPRESSIONS):
        raise DatasetError(
            f"{path}: dataset.compression must be one of {', '.join(COMPRESSIONS)}"
        )


def _listed(keys: list[str]) -> str:
    more = f" and {len(keys) - 5} more" if len(keys) > 5 else ""
    return ", ".join(keys[:5]) + more
