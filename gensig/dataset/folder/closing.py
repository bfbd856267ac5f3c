"""Closing of a data set whose shards are all done."""

import hashlib
from dataclasses import replace
from pathlib import Path

from gensig.dataset.cards.card import write_card
from gensig.dataset.folder.environment import now
from gensig.dataset.folder.layout import (
    BEGINNING,
    FIGURES,
    INDEX,
    SHARDS,
    SPLITS,
    manifest_text,
    read_manifest,
    shard_path,
    write_manifest,
)
from gensig.dataset.folder.manifest import RECEIPT_SUFFIX
from gensig.dataset.storage.atomic import TEMPORARY_SUFFIX, locked
from gensig.dataset.storage.checksums import write_checksums
from gensig.dataset.storage.index import write_index
from gensig.errors import DatasetError


def finalize(out: Path, *, figures: bool = True) -> None:
    """Close a data set whose shards are all done: index, card, checksums, and last the state.

    Parameters
    ----------
    figures : bool    draw a picture a class for the card

    Raises
    ------
    DatasetError    when a shard is not done, is missing or has another size than the manifest says
    """
    out = Path(out)
    with locked(out):
        manifest = read_manifest(out)
        if manifest.is_complete:
            return
        missing = [entry for entry in manifest.shards if entry.state != "done"]
        if missing:
            named = ", ".join(f"{entry.name} is {entry.state}" for entry in missing[:3])
            more = f" and {len(missing) - 3} more" if len(missing) > 3 else ""
            raise DatasetError(
                f"{out}: {manifest.n_done} of {len(manifest.shards)} shards are done, "
                f"{named}{more}; run `gensig resume {out}` first"
            )
        for i, entry in enumerate(manifest.shards):
            path = shard_path(out, i)
            if not path.is_file() or path.stat().st_size != entry.bytes:
                raise DatasetError(
                    f"{path} is missing or has not the {entry.bytes} bytes recorded; run `gensig "
                    f"resume {out}`"
                )
        _remove_leftovers(out)
        closed = replace(
            manifest,
            state="complete",
            files={**manifest.files, INDEX: write_index(out, manifest)},
            environment={**manifest.environment, "finished": now()},
        )
        write_card(out, figures=figures)
        text = manifest_text(closed)
        write_checksums(out, closed, hashlib.sha256(text.encode()).hexdigest())
        write_manifest(out, closed)


def _remove_leftovers(out: Path) -> None:
    """Remove temporary files and receipts of killed writers.

    Every shard is done, so no writer is alive.
    """
    for folder in (out, out / SHARDS, out / SPLITS, out / FIGURES):
        for suffix in (TEMPORARY_SUFFIX, RECEIPT_SUFFIX):
            for path in folder.glob(f".*{suffix}"):
                path.unlink(missing_ok=True)
    (out / BEGINNING).unlink(missing_ok=True)
