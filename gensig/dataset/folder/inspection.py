"""What is in this file or folder: readable text, for data sets, shards and any other HDF5 file."""

from pathlib import Path

import h5py
import numpy as np

from gensig.dataset.cards.card import value_range
from gensig.dataset.folder.layout import MANIFEST, Manifest, read_manifest
from gensig.dataset.reader import Dataset, open_dataset
from gensig.dataset.storage.attributes import HDF5_ERRORS, read_attributes
from gensig.dataset.storage.guard import holds_its_data, open_file
from gensig.errors import DatasetError

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
            f"{path} does not exist; give a data-set folder or an HDF5 file"
        )
    with open_file(path) as file:
        try:
            return (
                "\n".join(
                    [
                        f"{_show(path)}: HDF5 file, {path.stat().st_size} bytes",
                        *_objects(file),
                    ]
                )
                + "\n"
            )
        except HDF5_ERRORS as error:
            raise DatasetError(
                f"{path} is damaged ({_show(error)}); restore it from a copy"
            ) from error


def _folder(folder: Path) -> str:
    manifest = read_manifest(folder)
    lines = [
        f"{_show(folder)}: data set, format version {manifest.schema_version}, {manifest.state}",
        *_how_to_finish(folder, manifest),
        *_manifest_lines(folder, manifest),
    ]
    if manifest.n_done:
        with open_dataset(folder, allow_incomplete=True) as data:
            lines += _dataset_lines(data)
    return "\n".join(lines) + "\n"


def _how_to_finish(folder: Path, manifest: Manifest) -> list[str]:
    if manifest.is_complete:
        return []
    done = f"{manifest.n_made} of {manifest.n_records} records"
    return [f"  done         {done}; `gensig resume {_show(folder)}` finishes it"]


def _manifest_lines(folder: Path, manifest: Manifest) -> list[str]:
    states = {
        state: sum(entry.state == state for entry in manifest.shards)
        for state in ("planned", "done", "failed")
    }
    n_bytes = sum(entry.bytes for entry in manifest.shards)
    return [
        f"  records      {manifest.n_records}, {manifest.n_failed} failed",
        f"  shards       {', '.join(f'{n} {state}' for state, n in states.items() if n)}; "
        f"{n_bytes} bytes",
        f"  made by      gensig {_show(manifest.generator_version)}, seed {manifest.seed}, "
        f"{_show(manifest.environment.get('created', ''))}",
        f"  identity     {manifest.identity}",
        f"  manifest     {_show(folder / MANIFEST)}",
    ]


def _dataset_lines(data: Dataset) -> list[str]:
    usable = data.usable
    duration = data.n_samples / data.sampling_rate
    units = " and ".join(
        map(_show, dict.fromkeys(data.attributes.get("channel_units", ["m/s^2"])))
    )
    of_what = (
        f", of the {_show(data.attributes['torque_of'])}"
        if "torque_of" in data.attributes
        else ""
    )
    lines = [
        f"  signal       acceleration ({len(data.channel_names)}, {data.n_samples}) float32, "
        f"{units}, {data.sampling_rate:g} Hz, {duration:g} s",
        f"  stored as    {data.sample_type}{' with a scale' * (data.sample_type == 'int16')}, "
        f"compression {data.compression}",
        f"  channels     {', '.join(map(_show, data.channel_names))}",
        f"  speed        {value_range(data.column('speed_rpm')[usable], 'r/min')}",
        f"  torque       {value_range(data.column('torque_nm')[usable], 'N m')}{of_what}",
        f"  splits       {', '.join(map(_show, data.protocols)) or 'none'}",
    ]
    for title, column in (
        ("classes", "label_name"),
        ("units", "unit_id"),
        ("specimens", "specimen_id"),
        ("states", "status"),
    ):
        lines.append(f"  {title:<12} {_counts(data.column(column))}")
    lines.append("  columns      " + ", ".join(map(_show, data.column_names)))
    lines.append("  attributes")
    return lines + [
        f"    {_show(name)} = {_show(value)}" for name, value in data.attributes.items()
    ]


def _counts(values: np.ndarray) -> str:
    names, counts = np.unique(values[values != ""], return_counts=True)
    shown = [
        f"{_show(name)} {count}"
        for name, count in zip(names[:12].tolist(), counts[:12].tolist(), strict=True)
    ]
    return f"{len(names)}: " + ", ".join(shown) + (", ..." if len(names) > 12 else "")


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
            link = group.get(key, getlink=True)
            item = group[key] if isinstance(link, h5py.HardLink) else None
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
    return lines if len(lines) < OBJECTS_LIMIT else [*lines[:OBJECTS_LIMIT], "  ..."]


def _dataset_notes(data: h5py.Dataset) -> str:
    found = read_attributes(data)
    unit = found.pop("unit", "")
    unit = f", {_show(unit)}" if unit else ""
    virtual = (
        ", virtual"
        if data.is_virtual
        else ", data in another file, not read"
        if data.external
        else ""
    )
    rest = "".join(f", {_show(name)}={_show(value)}" for name, value in found.items())
    small = data.size == 1 and data.dtype.kind in "iuf" and holds_its_data(data)
    return unit + virtual + rest + (f", value {data[()]}" if small else "")


def _show(value: object) -> str:
    """One printable line of at most `WIDTH` characters.

    Text from files cannot steer the terminal.
    """
    text = "".join(c if c.isprintable() else "?" for c in str(value))
    return text if len(text) <= WIDTH else text[: WIDTH - 3] + "..."
