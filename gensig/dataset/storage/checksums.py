"""SHA256SUMS: digests of all files of a closed data set, as `sha256sum --check` reads them.

The manifest holds the digests of shards, plan and splits. This file repeats them, and adds those
of the manifest itself and of the files that are for people, so that no byte of the folder can
change unnoticed.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from gensig.dataset.folder.layout import (
    CARD,
    CHECKSUMS,
    CROISSANT,
    FIGURES,
    LOG,
    MANIFEST,
    SHARDS,
    TEXT_BYTES_LIMIT,
    Manifest,
    read_manifest,
)
from gensig.dataset.storage.atomic import locked, read_text, sha256_file, write_text
from gensig.errors import DatasetError

EDITABLE = (CARD, CROISSANT)  # may be written on by hand, and then accepted
_LINE = re.compile(
    r"([0-9a-f]{64})  (manifest\.json|README\.md|croissant\.json|run\.log|config\.yaml|"
    r"overrides\.yaml|plan\.csv|index\.h5|splits/[a-z0-9_]+\.csv|figures/[a-z0-9_-]+\.png|"
    r"shards/shard-[0-9]{5,}\.h5)"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """A file that is not as `SHA256SUMS` says: its name, and one line."""

    name: str
    line: str


def write_checksums(folder: Path, manifest: Manifest, manifest_digest: str) -> None:
    """Write `SHA256SUMS` for a manifest that says 'complete'.

    It may be written before that manifest.
    """
    digests = {MANIFEST: manifest_digest, **_recorded(manifest)}
    digests |= {name: sha256_file(folder / name) for name in _unlisted(folder)}
    lines = [f"{digest}  {name}\n" for name, digest in digests.items()]
    write_text(folder / CHECKSUMS, "".join(lines))


def _recorded(manifest: Manifest) -> dict[str, str]:
    """Digests that the manifest holds, by path."""
    shards = {f"{SHARDS}/{entry.name}": entry.sha256 for entry in manifest.shards}
    return manifest.files | shards


def _unlisted(folder: Path) -> list[str]:
    """Files of the folder that the manifest does not list: card, figures, log."""
    pictures = sorted((folder / FIGURES).glob("*.png"))
    paths = [folder / name for name in (CARD, CROISSANT, LOG)] + pictures
    return [path.relative_to(folder).as_posix() for path in paths if path.is_file()]


def read_checksums(folder: Path) -> dict[str, str]:
    """Digest by path.

    Raises
    ------
    DatasetError    when the file is missing, or has a line that gensig does not write
    """
    path = folder / CHECKSUMS
    if not path.is_file():
        raise DatasetError(
            f"{CHECKSUMS} is missing; restore it from a copy, or let `gensig finalize {folder}` "
            "write it where you trust the folder as it is"
        )
    text = read_text(path, limit=TEXT_BYTES_LIMIT)
    digests: dict[str, str] = {}
    for number, line in enumerate(text.split("\n")[:-1], start=1):
        match = _LINE.fullmatch(line)
        if match is None or match[2] in digests:
            raise DatasetError(
                f"{CHECKSUMS} was altered: line {number} is none of a data set; restore it from "
                "a copy"
            )
        digests[match[2]] = match[1]
    if not text.endswith("\n"):
        raise DatasetError(
            f"{CHECKSUMS} was altered: its end is missing; restore it from a copy"
        )
    return digests


def differences(
    folder: Path, manifest: Manifest, *, quick: bool = False
) -> list[Difference]:
    """Files whose digest is not the one in `SHA256SUMS`, or there not the one in the manifest.

    Parameters
    ----------
    quick : bool    of the files beside those that the manifest lists, look at its own digest and
                    at names only
    """
    try:
        listed = read_checksums(folder)
    except DatasetError as error:
        return [Difference(name=CHECKSUMS, line=str(error))]
    recorded = _recorded(manifest)
    different = []
    for name in (MANIFEST, *recorded, CARD, CROISSANT, *_unlisted(folder)):
        if name not in listed:
            listed[name] = ""
            line = f"{CHECKSUMS} does not list {name}; one of them was altered"
            different.append(Difference(name=CHECKSUMS, line=line))
    for name, digest in listed.items():
        path = folder / name
        if name in recorded:
            if digest and digest != recorded[name]:
                both = f"{CHECKSUMS} and {MANIFEST}"
                line = f"{both} have different sha256 of {name}; one was altered"
                different.append(Difference(name=CHECKSUMS, line=line))
        elif not path.is_file() or not path.resolve().is_relative_to(folder.resolve()):
            line = f"{name} is missing; {CHECKSUMS} lists it"
            different.append(Difference(name=name, line=line))
        elif digest and (name == MANIFEST or not quick) and sha256_file(path) != digest:
            line = f"{name} was altered: its sha256 is not the one in {CHECKSUMS}"
            if name in EDITABLE:
                line += f"; if you edited it, `gensig finalize {folder}` accepts it"
            different.append(Difference(name=name, line=line))
    return different


def accept_edits(folder: Path) -> list[str]:
    """Accept card and description of a closed data set as they are; returns the changed names.

    Raises
    ------
    DatasetError    when any other file is not as it was
    """
    with locked(folder):
        manifest = read_manifest(folder)
        if not manifest.is_complete:
            raise DatasetError(
                f"{folder} is incomplete; run `gensig resume {folder}` first"
            )
        different = differences(folder, manifest)
        missing = not (folder / CHECKSUMS).exists()
        refused = [
            each
            for each in different
            if each.name not in EDITABLE or not (folder / each.name).is_file()
        ]
        if refused and not missing:
            raise DatasetError(
                f"{refused[0].line}; only {' and '.join(EDITABLE)} may be edited"
            )
        if different:
            write_checksums(folder, manifest, sha256_file(folder / MANIFEST))
        return [each.name for each in different]
