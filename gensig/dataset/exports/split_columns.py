"""Splits of an exported data set: stretches of each subset, and one text column a protocol."""

import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gensig.arrays import Integers
from gensig.dataset.reader import Dataset
from gensig.dataset.splitting.protocols import PROTOCOLS
from gensig.dataset.splitting.split_check import split_problems
from gensig.dataset.splitting.splits import SUBSETS, SplitTable
from gensig.errors import DatasetError

EVERY_CLEAN = "all"  # stands for every protocol that keeps units apart
ROUNDING = 1e-6  # of a sample


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stretches:
    """Stretches of records that a protocol deals to the subsets, in the order of the plan.

    Parameters
    ----------
    record : (stretch,) int64         index of the record, ascending
    start, stop : (stretch,) int64    samples of the record, ``stop`` exclusive
    subset : (stretch,) text          'train', 'validation' or 'test'
    cut : bool                        whether the protocol cuts records, or deals whole ones
    """

    record: Integers
    start: Integers
    stop: Integers
    subset: NDArray[np.str_]
    cut: bool

    def __len__(self) -> int:
        return len(self.record)

    def take(self, index: NDArray[np.generic] | slice) -> "Stretches":
        """Stretches of an index, a mask or a slice."""
        return Stretches(
            record=self.record[index],
            start=self.start[index],
            stop=self.stop[index],
            subset=self.subset[index],
            cut=self.cut,
        )

    @property
    def n_samples(self) -> int | None:
        """Number of samples of every stretch; None where they differ or there is none."""
        lengths = np.unique(self.stop - self.start)
        if len(lengths) != 1:
            return None
        return int(lengths[0])


def whole_records(data: Dataset) -> Stretches:
    """Every record of a data set as one stretch, in no subset."""
    n_records = data.n_records
    return Stretches(
        record=np.arange(n_records),
        start=np.zeros(n_records, dtype=np.int64),
        stop=np.full(n_records, data.n_samples),
        subset=np.full(n_records, ""),
        cut=False,
    )


def is_clean(protocol: str) -> bool:
    """True for a protocol that this version knows and that keeps units apart."""
    return protocol in PROTOCOLS and bool(PROTOCOLS[protocol].apart)


def clean_protocols(data: Dataset) -> list[str]:
    """Protocols of a data set that keep units apart, in the order of `Dataset.protocols`."""
    return list(filter(is_clean, data.protocols))


def hardest_protocol(data: Dataset) -> str:
    """The first clean protocol of a data set: `new_machine`, otherwise `by_unit`.

    Raises
    ------
    DatasetError    for a data set without any
    """
    clean = clean_protocols(data)
    if clean:
        return clean[0]
    reason = data.left_out.get("by_unit", "by_unit is missing")
    raise DatasetError(
        f"{data.folder} has no split that keeps machines apart ({reason}); make a set of more "
        "machines (plan.n_units), or name a protocol with --protocol"
    )


def read_protocols(data: Dataset, names: Sequence[str]) -> dict[str, Stretches]:
    """Checked stretches of some protocols by name.

    Parameters
    ----------
    data : Dataset
    names : protocols, each once or more; 'all' stands for every clean one

    Raises
    ------
    DatasetError    for a protocol that the data set lacks, and for a split with a group on two
                    sides that its protocol keeps apart
    """
    chosen: list[str] = []
    for name in names:
        chosen += clean_protocols(data) if name == EVERY_CLEAN else [name]
    # One after the other, so that the first that is wrong is named.
    return {name: _read_stretches(data, name) for name in dict.fromkeys(chosen)}


def _read_stretches(data: Dataset, protocol: str) -> Stretches:
    table = data.split_table(protocol)
    problems = split_problems(protocol, table, data.plan)
    if problems:
        raise DatasetError(
            f"{data.folder}: split {problems[0]}; nothing is exported: run `gensig verify "
            f"{data.folder}` and restore the file from a copy"
        )
    return _stretches(data, table)


def _stretches(data: Dataset, table: SplitTable) -> Stretches:
    """Whole samples of the rows of a checked table; a row without any is left out."""
    ids = data.plan.columns["record_id"]
    order = np.argsort(ids, kind="stable")
    record = order[np.searchsorted(ids, table.record_id, sorter=order)]
    start = np.ceil(table.start_fraction * data.n_samples - ROUNDING)
    stop = np.floor(table.stop_fraction * data.n_samples + ROUNDING)
    stretches = Stretches(
        record=record.astype(np.int64),
        start=start.astype(np.int64),
        stop=stop.astype(np.int64),
        subset=table.subset,
        cut=bool((table.start_fraction > 0).any() or (table.stop_fraction < 1).any()),
    )
    in_order = np.lexsort((stretches.start, stretches.record))
    stretches = stretches.take(in_order)
    return stretches.take(stretches.start < stretches.stop)


def split_column(data: Dataset, stretches: Stretches) -> NDArray[np.str_]:
    """Subset of every record as text, (record,).

    A protocol of whole records has 'train', 'validation', 'test' or, where the record is in no
    subset, ''. A protocol that cuts records has JSON: a list of [subset, start, stop], in samples.
    """
    if not stretches.cut:
        names = np.full(data.n_records, "", dtype=f"U{max(map(len, SUBSETS))}")
        names[stretches.record] = stretches.subset
        return names
    parts: list[list[tuple[str, int, int]]] = [[] for _ in range(data.n_records)]
    rows = zip(
        stretches.record.tolist(),
        stretches.subset.tolist(),
        stretches.start.tolist(),
        stretches.stop.tolist(),
        strict=True,
    )
    for record, subset, start, stop in rows:
        parts[record].append((subset, start, stop))
    return np.array([json.dumps(part) for part in parts])


def split_columns(
    data: Dataset, protocols: dict[str, Stretches]
) -> dict[str, NDArray[np.str_]]:
    """Columns ``split/<protocol>`` by name, each as `split_column`."""
    columns = {}
    for protocol, stretches in protocols.items():
        columns[f"split/{protocol}"] = split_column(data, stretches)
    return columns
