"""Split tables: the subset of each part of each record, and their CSV files."""

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gensig.dataset.columns import COLUMNS
from gensig.dataset.folder.layout import RECORDS_LIMIT
from gensig.dataset.storage.atomic import read_text, require_digest
from gensig.errors import DatasetError
from gensig.text.csv_tables import read_rows, write_rows

SUBSETS = ("train", "validation", "test")
SPLIT_BYTES_LIMIT = 1024**3
PARTS_LIMIT, PART_BYTES = 64, 128  # of a record; of a row that names one
LONGEST_ID = COLUMNS["record_id"].n_bytes
HEADER = ("record_id", "start_fraction", "stop_fraction", "subset")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SplitTable:
    """Assignment of records, or parts of them, to subsets; one row a part.

    Parameters
    ----------
    record_id : (row,) text
    start_fraction, stop_fraction : (row,)    part of the record, 0 to 1
    subset : (row,) text                      'train', 'validation' or 'test'
    """

    record_id: np.ndarray
    start_fraction: np.ndarray
    stop_fraction: np.ndarray
    subset: np.ndarray

    def to_csv(self) -> str:
        """The table as CSV, floats in shortest round-trip form."""
        buffer = io.StringIO()
        write_rows(buffer, [HEADER, *self.rows()])
        return buffer.getvalue()

    def rows(self) -> Iterator[tuple[str, float, float, str]]:
        """Rows of the table as plain Python values."""
        columns = (getattr(self, name).tolist() for name in HEADER)
        return zip(*columns, strict=True)


def read_split(
    path: Path, *, n_records: int = RECORDS_LIMIT, sha256: str | None = None
) -> SplitTable:
    """Read one `splits/<protocol>.csv`; DatasetError names the file and what is wrong with it.

    Parameters
    ----------
    n_records : of the plan; bounds what is read, 64 parts a record and never over 1 GiB
    sha256 : a file of another digest is refused
    """
    most = PART_BYTES * (1 + PARTS_LIMIT * n_records)
    text = read_text(path, limit=min(most, SPLIT_BYTES_LIMIT))
    if sha256 is not None:
        require_digest(path, text, sha256)
    try:
        header, *rows = read_rows(io.StringIO(text, newline=""))
        if tuple(header) != HEADER:
            raise ValueError(
                f"header is {','.join(header)[:80]}, expected {','.join(HEADER)}"
            )
        ids, starts, stops, subsets = zip(*rows, strict=True)
        if longest := max(ids, key=len)[LONGEST_ID:]:
            raise ValueError(f"a record_id has {LONGEST_ID + len(longest)} characters")
        start, stop = np.array(starts, dtype=float), np.array(stops, dtype=float)
        if not ((start >= 0) & (start < stop) & (stop <= 1)).all():
            raise ValueError("fractions must be 0 <= start < stop <= 1")
        unknown = set(subsets) - set(SUBSETS)
        if unknown:
            raise ValueError(
                f"subset {min(unknown)[:40]!r} is unknown; allowed are {', '.join(SUBSETS)}"
            )
    except (csv.Error, ValueError) as error:
        raise DatasetError(
            f"{path} is no split table ({error}); restore it from a copy"
        ) from error
    return SplitTable(
        record_id=np.array(ids),
        start_fraction=start,
        stop_fraction=stop,
        subset=np.array(subsets),
    )
