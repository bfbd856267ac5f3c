"""Closing of a data set whose shards are all done."""

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
    write_manifest,
)
from gensig.dataset.folder.quick_check import shard_sizes
from gensig.dataset.storage.atomic import TEMPORARY_SUFFIX, locked, sha256_text
from gensig.dataset.storage.checksums import write_checksums
from gensig.dataset.storage.index import write_index
from gensig.dataset.storage.receipts import RECEIPT_SUFFIX
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
        if problems := shard_sizes(out, manifest):
            raise DatasetError(f"{out}: {problems[0]}; run `gensig resume {out}`")
        _remove_leftovers(out)
        closed = replace(
            manifest,
            state="complete",
            files={**manifest.files, INDEX: write_index(out, manifest)},
            environment={**manifest.environment, "finished": now()},
        )
        write_card(out, figures=figures)
        text = manifest_text(closed)
        write_checksums(out, closed, sha256_text(text))
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
