"""A data set as a folder that Hugging Face `datasets` opens: a configuration for each protocol.

The package `datasets` is not needed. Needs the package pyarrow.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import pyarrow
from pyarrow import parquet

from gensig.dataset.exports.arrow_rows import LABEL, RowSource, text_columns
from gensig.dataset.exports.export_tables import (
    attributes_json,
    record_bytes,
    rows_of_group,
)
from gensig.dataset.exports.hub_card import DATA, HubConfig, SubsetFiles, hub_card
from gensig.dataset.exports.hub_features import schema_features, schema_note
from gensig.dataset.exports.split_columns import Stretches
from gensig.dataset.folder.layout import CARD
from gensig.dataset.reader import Dataset
from gensig.dataset.splitting.splits import SUBSETS
from gensig.errors import DatasetError

FILE_BYTES = 500 * 1000**2  # of signals in one Parquet file, as `datasets` writes them


def write_hugging_face(
    data: Dataset, folder: Path, protocols: Mapping[str, Stretches]
) -> None:
    """Write a folder with a configuration for each protocol, and a card.

    Parameters
    ----------
    data : Dataset
    folder : Path    folder to make
    protocols : stretches of usable records by name; the first is the default

    Raises
    ------
    DatasetError    for a label that is no class, and a protocol without a usable record
    """
    label = data.column(LABEL)
    if label.min() < 0 or label.max() >= len(data.class_names):
        raise DatasetError(
            f"{data.folder}: labels from {label.min()} to {label.max()}, the classes are 0 to "
            f"{len(data.class_names) - 1}; run `gensig verify {data.folder}`"
        )
    folder.mkdir()
    (folder / DATA).mkdir()
    configs = []
    for protocol, rows in protocols.items():
        configs.append(_write_config(data, folder, protocol, rows))
    (folder / CARD).write_text(hub_card(data, configs), encoding="utf-8")


def _write_config(
    data: Dataset, folder: Path, protocol: str, rows: Stretches
) -> HubConfig:
    """Write the files of one protocol."""
    if not len(rows):
        raise DatasetError(
            f"{data.folder}: split {protocol} has no usable record; choose another protocol"
        )
    source = RowSource(
        data=data,
        n_samples=rows.n_samples,
        signals=data.signal_names,
        bounds=rows.cut,
        wide_label=True,
    )
    bare = source.schema(rows, {})
    features = schema_features(bare, LABEL, data.class_names)
    notes = {
        "huggingface": schema_note(features),
        "gensig": attributes_json(data.attributes),
    }
    schema = bare.with_metadata(notes)
    (folder / DATA / protocol).mkdir()
    subsets = {}
    for subset in SUBSETS:
        part = rows.take(rows.subset == subset)
        if len(part):
            path = folder / DATA / protocol / subset
            subsets[subset] = _write_subset(source, path, part, schema)
    n_left_out = data.n_records - len(np.unique(rows.record))
    return HubConfig(
        protocol=protocol,
        features=features,
        subsets=subsets,
        n_left_out=n_left_out,
        cut=rows.cut,
    )


def _write_subset(
    source: RowSource, path: Path, rows: Stretches, schema: pyarrow.Schema
) -> SubsetFiles:
    """Write the rows of one subset to files that begin with the name of ``path``."""
    row_bytes = _row_bytes(source.data, rows)
    rows_of_file = max(1, FILE_BYTES // row_bytes)
    n_files = -(-len(rows) // rows_of_file)
    step = rows_of_group(row_bytes)
    n_bytes = n_stored = 0
    for number in range(n_files):
        first = number * rows_of_file
        part = rows.take(slice(first, first + rows_of_file))
        file = path.with_name(f"{path.name}-{number:05d}-of-{n_files:05d}.parquet")
        with parquet.ParquetWriter(
            file, schema, use_dictionary=text_columns(schema)
        ) as writer:
            for table in _tables(source.batches(part, step), step, schema):
                n_bytes += table.nbytes
                writer.write_table(table)
        n_stored += file.stat().st_size
    return SubsetFiles(n_rows=len(rows), n_bytes=n_bytes, n_stored=n_stored)


def _row_bytes(data: Dataset, rows: Stretches) -> int:
    """Bytes of the time signals of the longest of some stretches."""
    longest = int((rows.stop - rows.start).max())
    return max(1, record_bytes(data) * longest // data.n_samples)


def _tables(
    batches: Iterator[pyarrow.RecordBatch], step: int, schema: pyarrow.Schema
) -> Iterator[pyarrow.Table]:
    """Batches of small shards together, at most ``step`` rows at once."""
    waiting: list[pyarrow.RecordBatch] = []
    n_waiting = 0
    for batch in batches:
        if n_waiting + batch.num_rows > step:
            yield pyarrow.Table.from_batches(waiting, schema)
            waiting, n_waiting = [], 0
        waiting.append(batch.replace_schema_metadata(schema.metadata))
        n_waiting += batch.num_rows
    yield pyarrow.Table.from_batches(waiting, schema)
