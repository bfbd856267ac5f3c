"""A data set as one Parquet file.  Needs the package pyarrow."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pyarrow import parquet

from gensig.dataset.exports import export_tables
from gensig.dataset.exports.arrow_rows import RowSource, text_columns
from gensig.dataset.exports.split_columns import whole_records
from gensig.dataset.reader import Dataset


def write_parquet(
    data: Dataset,
    path: Path,
    *,
    samples: bool,
    further: Mapping[str, NDArray[np.generic]],
) -> None:
    """Write one row a record; units are notes of the columns.

    Parameters
    ----------
    data : Dataset
    path : Path                    file to write
    samples : bool                 time signals too, as lists of fixed length
    further : name -> (record,)    further columns
    """
    rows = whole_records(data)
    signals: list[str] = []
    step = export_tables.ROWS_LIMIT
    if samples:
        signals = data.signal_names
        step = export_tables.rows_of_group(export_tables.record_bytes(data))
    source = RowSource(
        data=data, n_samples=data.n_samples, signals=signals, further=further
    )
    notes = {"gensig": export_tables.attributes_json(data.attributes)}
    schema = source.schema(rows, notes)
    texts = text_columns(schema)
    with parquet.ParquetWriter(path, schema, use_dictionary=texts) as writer:
        for batch in source.batches(rows, step):
            writer.write_batch(batch.replace_schema_metadata(schema.metadata))
