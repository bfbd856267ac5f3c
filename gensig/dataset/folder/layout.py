"""Names of the files in a data-set folder, and its manifest with the states of the shards."""

import itertools
import json
import os
import re
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import yaml

from gensig.dataset.schema import READABLE_VERSIONS, SCHEMA_VERSION
from gensig.dataset.storage.atomic import link_text, read_text, write_text
from gensig.errors import DatasetError

MANIFEST = "manifest.json"
CONFIG = "config.yaml"
OVERRIDES = "overrides.yaml"
PLAN = "plan.csv"
INDEX = "index.h5"
CARD = "README.md"
CROISSANT = "croissant.json"
CHECKSUMS = "SHA256SUMS"
LOG = "run.log"
SHARDS = "shards"
SPLITS = "splits"
FIGURES = "figures"
FINGERPRINTS = (
    "fingerprints"  # section of config.yaml, of recordings that carry implants
)
BEGINNING = ".beginning"  # in a folder that has no manifest yet
NAMES = (
    MANIFEST,
    CONFIG,
    OVERRIDES,
    PLAN,
    INDEX,
    CARD,
    CROISSANT,
    CHECKSUMS,
    LOG,
    BEGINNING,
)
PARTS = (SHARDS, SPLITS, FIGURES)  # folders

# manifest and SHA256SUMS: 64 MiB are some 300,000 shards
TEXT_BYTES_LIMIT = 64 * 1024**2
PLAN_BYTES_LIMIT = 4 * 1024**3
# a row of a plan has at least an id, a shard and a row number: "a,0,0\n"
RECORDS_LIMIT = PLAN_BYTES_LIMIT // 6
FILES_LIMIT = 1000  # that the manifest lists beside the shards
COUNT_LIMIT = 2**63 - 1  # what fits numpy's integers
CONFIG_BYTES_LIMIT = 1024**2
CONFIG_DEPTH_LIMIT = 50
MOST_LOOKED_AT, MOST_NAMED = 1000, 5  # folders, in a folder that is no data set

# that of libyaml takes a seventh of the time, once in every process
LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

_HASH = re.compile(r"[0-9a-f]{64}")
_FILE = re.compile(
    r"config\.yaml|overrides\.yaml|plan\.csv|index\.h5|splits/[a-z0-9_]+\.csv"
)


def shard_name(index: int) -> str:
    """File name of a shard inside the folder `shards`."""
    return f"shard-{index:05d}.h5"


def shard_path(folder: Path, index: int) -> Path:
    """Path of a shard."""
    return folder / SHARDS / shard_name(index)


# Content of config.yaml: nested mappings, lists, text, numbers, booleans and null. It is
# unchecked until `gensig.options.configuration.Configuration` takes it.
ConfigContent = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class ShardEntry:
    """One shard in the manifest.

    `sha256`, `bytes` and `n_failed` mean something once `state` is 'done'.
    """

    name: str
    rows: int
    state: str = "planned"
    sha256: str = ""
    bytes: int = 0
    n_failed: int = 0

    def failed(self) -> "ShardEntry":
        """The entry where the shard could not be made."""
        return ShardEntry(name=self.name, rows=self.rows, state="failed")


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifest:
    """The manifest of a data-set folder.

    Parameters
    ----------
    identity : str         sha256 over what decides the bits
    state : str            'incomplete', or 'complete' once everything else is on disk
    shards : tuple         one entry a shard, in order
    files : dict           sha256 of the other files that decide or list the records
    configuration : dict   what `identity` was made of, so that keys changed since can be named; {}
                           in older folders
    environment : dict     versions, machine and times; decides nothing
    """

    schema_version: int = SCHEMA_VERSION
    generator_version: str
    identity: str
    seed: int
    n_records: int
    state: str = "incomplete"
    shards: tuple[ShardEntry, ...]
    files: dict[str, str]
    configuration: ConfigContent = field(default_factory=dict)
    environment: dict[str, Any] = field(default_factory=dict)

    @property
    def is_complete(self) -> bool:
        """True when the run was finished and closed."""
        return self.state == "complete"

    @property
    def shard_sizes(self) -> list[int]:
        """Number of records of each shard."""
        return [entry.rows for entry in self.shards]

    @property
    def n_done(self) -> int:
        """Number of finished shards."""
        return sum(entry.state == "done" for entry in self.shards)

    @property
    def n_made(self) -> int:
        """Number of records in the finished shards."""
        return sum(entry.rows for entry in self.shards if entry.state == "done")

    @property
    def n_failed(self) -> int:
        """Number of failed records in the finished shards."""
        return sum(entry.n_failed for entry in self.shards)


def manifest_text(manifest: Manifest) -> str:
    """Text of `manifest.json`."""
    content = asdict(manifest)
    return f"{json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False)}\n"


def write_manifest(folder: Path, manifest: Manifest) -> None:
    """Replace `manifest.json` atomically."""
    write_text(folder / MANIFEST, manifest_text(manifest))


def refuse_special(folder: Path) -> None:
    """Raise DatasetError for the first part of a data set that is no ordinary file or folder.

    Symbolic links are refused wherever they lead, and so are named pipes, sockets and devices. The
    folder itself may be named by a link, and so may files that are no part of the data set.
    """
    names = [folder / name for name in (*NAMES, *PARTS)]
    for path in names:
        if path.is_symlink():
            raise DatasetError(link_text(path))
    for path in names[: len(NAMES)]:
        if path.exists() and not path.is_file():
            raise DatasetError(_special_text(path, "file"))
    for part in names[len(NAMES) :]:
        if not part.is_dir():
            if part.exists():
                raise DatasetError(_special_text(part, "folder"))
            continue
        with os.scandir(part) as entries:
            special = [entry for entry in entries if not _is_ordinary(entry)]
        for entry in sorted(special, key=lambda entry: entry.name):
            path = part / entry.name
            if entry.is_symlink():
                raise DatasetError(link_text(path))
            raise DatasetError(_special_text(path, "file"))


def _is_ordinary(entry: os.DirEntry[str]) -> bool:
    """True for a file and for a folder, which is none of a data set's and is left alone."""
    return entry.is_file(follow_symlinks=False) or entry.is_dir(follow_symlinks=False)


def _special_text(path: Path, wanted: str) -> str:
    """The line on what is neither a file nor a folder, or the wrong one of them."""
    return (
        f"{path} is no ordinary {wanted}; a data set holds nothing else: put the {wanted} back or "
        "remove what is there"
    )


def read_manifest(folder: Path) -> Manifest:
    """The manifest of a folder, every name and type checked.

    Raises
    ------
    DatasetError    when the folder is no data set, a part of it is a symbolic link or no ordinary
                    file, or the manifest is damaged, newer than this gensig, promises more than a
                    plan can hold, or names a file that is not one of a data set ('../other')
    """
    folder = Path(folder)
    refuse_special(folder)
    path = folder / MANIFEST
    if not path.is_file():
        if not folder.exists():
            raise DatasetError(
                f"{folder} does not exist; give the folder that `gensig generate` made"
            )
        if (folder / BEGINNING).is_file():
            raise DatasetError(
                f"{folder} holds no record: its run was killed before the plan was on disk; give "
                "the same `gensig generate`, `gensig plan --freeze` or `gensig implant` with "
                f"out={folder} again"
            )
        raise DatasetError(
            f"{folder} is no gensig data set: it has no {MANIFEST}; {_what_to_give(folder)}"
        )
    try:
        content = json.loads(read_text(path, limit=TEXT_BYTES_LIMIT))
        version = _get(content, "schema_version", int)
        if version not in READABLE_VERSIONS:
            known = " and ".join(map(str, READABLE_VERSIONS))
            raise DatasetError(
                f"format version {version}; this gensig reads {known}, install a matching one"
            )
        entries = enumerate(_get(content, "shards", list))
        files = _get(content, "files", dict)
        if len(files) > FILES_LIMIT:
            raise DatasetError(
                f"it lists {len(files)} files beside the shards, at most {FILES_LIMIT} are "
                "possible; it is damaged or forged"
            )
        state = _get(content, "state", str)
        manifest = Manifest(
            schema_version=version,
            generator_version=_get(content, "generator_version", str),
            identity=_hash(_get(content, "identity", str), "identity"),
            seed=_get(content, "seed", int),
            n_records=_count(content, "n_records", RECORDS_LIMIT),
            state=_choice(state, ("incomplete", "complete"), "state"),
            shards=tuple(shard_entry(i, entry) for i, entry in entries),
            files={name: _hash(value, name) for name, value in files.items()},
            configuration=_get({"configuration": {}} | content, "configuration", dict),
            environment=_get(content, "environment", dict),
        )
        _check_manifest(manifest)
    except DatasetError as error:
        raise DatasetError(f"{path}: {error}") from error
    except (ValueError, RecursionError) as error:
        raise DatasetError(
            f"{path} is no JSON ({str(error)[:80]}); it is damaged, restore it from a copy"
        ) from error
    return manifest


def _what_to_give(folder: Path) -> str:
    """Advice in place of a folder that is no data set: those in it, the first by name."""
    try:
        with os.scandir(folder) as entries:
            looked_at = list(itertools.islice(entries, MOST_LOOKED_AT))
    except OSError:
        looked_at = []
    sets = sorted(entry.path for entry in looked_at if _holds_manifest(entry))
    if not sets:
        return "give the folder that `gensig generate` made"
    shown = ", ".join(sets[:MOST_NAMED])
    if more := len(sets) - MOST_NAMED:
        shown += f" and {more} more" * (more > 0)
    return f"it holds {len(sets)} data set{'s' * (len(sets) > 1)}, give one: {shown}"


def _holds_manifest(entry: os.DirEntry[str]) -> bool:
    is_folder = entry.is_dir(follow_symlinks=False)
    return is_folder and (Path(entry.path) / MANIFEST).is_file()


def _check_manifest(manifest: Manifest) -> None:
    rows = sum(manifest.shard_sizes)
    if rows != manifest.n_records or not manifest.shards:
        raise DatasetError(
            f"n_records is {manifest.n_records}, the shards hold {rows}; the manifest is damaged"
        )
    for name in manifest.files:
        if not _FILE.fullmatch(name):
            raise DatasetError(
                f"file {name!r} is not one of a data set; the manifest is damaged or forged"
            )
    if manifest.is_complete and manifest.n_done < len(manifest.shards):
        raise DatasetError(
            "state is complete, but not every shard is done; the manifest is damaged"
        )


def _get(content: Any, key: str, kind: type) -> Any:
    value = content.get(key) if isinstance(content, dict) else None
    if not isinstance(value, kind) or isinstance(value, bool):
        raise DatasetError(
            f"'{key}' is missing or no {kind.__name__}; the manifest is damaged, restore it from "
            "a copy"
        )
    if isinstance(value, int) and value < 0:
        raise DatasetError(f"'{key}' is {value}; it cannot be negative")
    return value


def _count(content: Any, key: str, limit: int = COUNT_LIMIT) -> int:
    value: int = _get(content, key, int)
    if value > limit:
        raise DatasetError(
            f"'{key}' is {str(value)[:30]}, at most {limit} is possible; the manifest is damaged "
            "or forged"
        )
    return value


def _hash(value: Any, name: str) -> str:
    if not isinstance(value, str) or not _HASH.fullmatch(value):
        raise DatasetError(
            f"{name!r}: {str(value)[:80]!r} is no sha256; the manifest is damaged"
        )
    return value


def _choice(value: str, allowed: tuple[str, ...], name: str) -> str:
    if value not in allowed:
        raise DatasetError(
            f"{name} is {value[:40]!r}; allowed are {', '.join(allowed)}"
        )
    return value


def shard_entry(index: int, content: Any) -> ShardEntry:
    """One entry of the list of shards, every name and type checked."""
    name = _get(content, "name", str)
    # An exact match leaves no room for a path that leads out of the folder.
    if name != shard_name(index):
        raise DatasetError(
            f"shard {index} is named {name[:80]!r}; the only name allowed is {shard_name(index)!r}"
        )
    state = _get(content, "state", str)
    _choice(state, ("planned", "done", "failed"), f"state of {name}")
    digest = _get(content, "sha256", str)
    entry = ShardEntry(
        name=name,
        rows=_count(content, "rows", RECORDS_LIMIT),
        state=state,
        sha256=_hash(digest, name) if state == "done" else "",
        bytes=_count(content, "bytes"),
        n_failed=_count(content, "n_failed"),
    )
    if entry.rows == 0 or entry.n_failed > entry.rows:
        raise DatasetError(
            f"{name}: {entry.n_failed} failed of {entry.rows} records; the manifest is damaged"
        )
    return entry


def read_config(folder: Path) -> ConfigContent:
    """`config.yaml` as plain data: no tags, no interpolation, no aliases.

    DatasetError when it is anything else.
    """
    return read_config_file(Path(folder) / CONFIG, follow_links=False)


def read_config_file(path: Path, *, follow_links: bool = True) -> ConfigContent:
    """A configuration as plain data, see `read_config`; a file of its own may be a link."""
    content = _read_plain(path, follow_links=follow_links)
    if not isinstance(content, dict):
        raise DatasetError(f"{path} is no mapping; restore it from a copy")
    return content


def read_overrides(folder: Path) -> list[str]:
    """The overrides of a data set as they were typed.

    DatasetError when `overrides.yaml` is anything but a list of texts.
    """
    path = Path(folder) / OVERRIDES
    content = _read_plain(path, follow_links=False)
    if not isinstance(content, list) or not all(
        isinstance(word, str) for word in content
    ):
        raise DatasetError(f"{path} is no list of texts; restore it from a copy")
    return content


def _read_plain(path: Path, *, follow_links: bool) -> Any:
    """Content of a YAML file without tags, aliases and deep nesting."""
    text = read_text(path, limit=CONFIG_BYTES_LIMIT, follow_links=follow_links)
    try:
        _refuse_yaml_bombs(text, path)
        return yaml.load(text, Loader=LOADER)
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        raise DatasetError(
            f"{path} is no plain YAML ({str(error).splitlines()[0][:80]}); restore it from a copy"
        ) from error


def _refuse_yaml_bombs(text: str, path: Path) -> None:
    """Raise DatasetError for aliases, which expand without bound, and for very deep nesting."""
    depth = 0
    for event in yaml.parse(text, Loader=LOADER):
        if isinstance(event, yaml.AliasEvent):
            raise DatasetError(
                f"{path} uses YAML aliases; a gensig configuration has none"
            )
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > CONFIG_DEPTH_LIMIT:
            raise DatasetError(
                f"{path} is nested deeper than {CONFIG_DEPTH_LIMIT} levels; it is no gensig "
                "configuration"
            )
