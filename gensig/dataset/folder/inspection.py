"""Descriptions in text of data sets, shards and other HDF5 files."""

from pathlib import Path

import h5py
import numpy as np

from gensig.dataset.cards.facts import gear_facts, value_range
from gensig.dataset.folder.layout import MANIFEST, SHARDS, Manifest, read_manifest
from gensig.dataset.folder.quick_check import check_opening
from gensig.dataset.reader import Dataset, open_dataset
from gensig.dataset.storage.atomic import at_work
from gensig.dataset.storage.attributes import HDF5_ERRORS, read_attributes
from gensig.dataset.storage.guard import holds_its_data, open_file
from gensig.errors import DatasetError
from gensig.text.escaping import escaped

WIDTH = 100
OBJECTS_LIMIT = 500


def inspect(path: Path) -> str:
    """Text on a data-set folder, a shard or any HDF5 file; links are named, never followed.

    Raises
    ------
    DatasetError    when there is nothing at `path`, or it is neither a data set nor HDF5
    """
    path = Path(path)
    if path.is_dir():
        return _folder(path)
    if not path.exists():
        raise DatasetError(
            f"{path} does not exist; give a data-set folder, an HDF5 file or a CSV"
        )
    with open_file(path) as file:
        try:
            title = f"{_show(path)}: HDF5 file, {path.stat().st_size} bytes"
            return "\n".join([title, *_objects(file), ""])
        except HDF5_ERRORS as error:
            raise DatasetError(
                f"{path} is damaged ({_show(error)}); restore it from a copy"
            ) from error


def _folder(folder: Path) -> str:
    manifest = read_manifest(folder)
    check_opening(folder, manifest)
    name = _show(folder)
    version = f"format version {manifest.schema_version}"
    lines = [f"{name}: data set, {version}, {manifest.state}"]
    if not manifest.is_complete:
        done = f"{manifest.n_made} of {manifest.n_records} records"
        lines.append(f"  done         {done}; {_going_on(folder)}")
    lines += _manifest_lines(folder, manifest)
    if manifest.n_done:
        with open_dataset(folder, allow_incomplete=True) as data:
            lines += _dataset_lines(data)
    return "\n".join([*lines, ""])


def _going_on(folder: Path) -> str:
    """Words on who finishes a data set that is incomplete."""
    try:
        with at_work(folder / SHARDS, others=False):
            return f"`gensig resume {_show(folder)}` finishes it"
    except DatasetError:
        return "another process is at work in it"


def _manifest_lines(folder: Path, manifest: Manifest) -> list[str]:
    states = [entry.state for entry in manifest.shards]
    counts = [
        f"{states.count(state)} {state}"
        for state in ("planned", "done", "failed")
        if state in states
    ]
    n_bytes = sum(entry.bytes for entry in manifest.shards)
    return [
        f"  records      {manifest.n_records}, {manifest.n_failed} failed",
        f"  shards       {', '.join(counts)}; {n_bytes} bytes",
        f"  made by      gensig {_show(manifest.generator_version)}, seed {manifest.seed}, "
        f"{_show(manifest.environment.get('created', ''))}",
        f"  identity     {manifest.identity}",
        f"  manifest     {_show(folder / MANIFEST)}",
    ]


def _dataset_lines(data: Dataset) -> list[str]:
    usable = data.usable
    duration = data.n_samples / data.sampling_rate
    units = dict.fromkeys(data.attributes.get("channel_units", ["m/s^2"]))
    of_what = ""
    if "torque_of" in data.attributes:
        of_what = f", of the {_show(data.attributes['torque_of'])}"
    lines = [
        f"  signal       acceleration ({len(data.channel_names)}, {data.n_samples}) float32, "
        f"{' and '.join(map(_show, units))}, {data.sampling_rate:g} Hz, {duration:g} s",
        f"  stored as    {data.sample_type}{' with a scale' * (data.sample_type == 'int16')}, "
        f"compression {data.compression}",
        f"  channels     {', '.join(map(_show, data.channel_names))}",
        f"  speed        {value_range(data.column('speed_rpm')[usable], 'r/min')}",
        f"  torque       {value_range(data.column('torque_nm')[usable], 'N m')}{of_what}",
        f"  splits       {', '.join(map(_show, data.protocols)) or 'none'}",
    ]
    for title, column in (
        ("classes", "label_name"),
        ("machines", "unit_id"),
        ("gear sets", "specimen_id"),
        ("states", "status"),
    ):
        lines.append(f"  {title:<12} {_counts(data.column(column))}")
    for title, fact in gear_facts(data).items():
        lines.append(f"  {title:<12} {_show(fact)}")
    lines.append("  columns      " + ", ".join(map(_show, data.column_names)))
    lines.append("  attributes")
    return lines + [
        f"    {_show(name)} = {_show(value)}" for name, value in data.attributes.items()
    ]


def _counts(values: np.ndarray) -> str:
    names, counts = np.unique(values[values != ""], return_counts=True)
    pairs = zip(names[:12].tolist(), counts[:12].tolist(), strict=True)
    shown = [f"{_show(name)} {count}" for name, count in pairs]
    shown += ["..."] * (len(names) > 12)
    return f"{len(names)}: {', '.join(shown)}"


def _objects(file: h5py.File) -> list[str]:
    lines = [
        f"  attribute {_show(name)} = {_show(value)}"
        for name, value in read_attributes(file).items()
    ]
    pending: list[tuple[str, h5py.Group]] = [("", file)]
    seen = {file.id.__hash__()}  # hard links can make a file its own descendant
    while pending and len(lines) < OBJECTS_LIMIT:
        prefix, group = pending.pop()
        for key in group:
            name = f"{prefix}/{key}"
            link, item = group.get(key, getlink=True), None
            if isinstance(link, h5py.HardLink):
                item = group[key]
            if isinstance(item, h5py.Group):
                if item.id.__hash__() not in seen:
                    seen.add(item.id.__hash__())
                    pending.append((name, item))
                    lines.append(f"  {_show(name)}/")
            elif isinstance(item, h5py.Dataset):
                lines.append(
                    f"  {_show(name)} {item.shape} {_show(item.dtype)}{_dataset_notes(item)}"
                )
            else:
                lines.append(f"  {_show(name)} -> {type(link).__name__}, not followed")
    if len(lines) < OBJECTS_LIMIT:
        return lines
    return [*lines[:OBJECTS_LIMIT], "  ..."]


def _dataset_notes(data: h5py.Dataset) -> str:
    attributes = read_attributes(data)
    notes = [""]
    if unit := attributes.pop("unit", ""):
        notes.append(_show(unit))
    if data.is_virtual:
        notes.append("virtual")
    elif data.external:
        notes.append("data in another file, not read")
    notes += [f"{_show(name)}={_show(value)}" for name, value in attributes.items()]
    if data.size == 1 and data.dtype.kind in "iuf" and holds_its_data(data):
        notes.append(f"value {data[()]}")
    return ", ".join(notes)


def _show(value: object) -> str:
    """One printable line of at most `WIDTH` characters.

    Text from files cannot steer the terminal.
    """
    text = escaped(str(value))
    if len(text) > WIDTH:
        return f"{text[: WIDTH - 3]}..."
    return text
