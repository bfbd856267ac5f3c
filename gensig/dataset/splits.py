"""Train, validation and test: clean protocols that keep groups apart, and the leaky one shown beside them."""

import csv
import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gensig.dataset.atomic import read_text
from gensig.dataset.layout import TEXT_BYTES_LIMIT
from gensig.dataset.plan import Plan
from gensig.errors import DatasetError

SUBSETS = ("train", "validation", "test")
N_WINDOWS = 8
MIN_SPECIMENS = 4

HEADER = ("record_id", "start_fraction", "stop_fraction", "subset")
# One random stream a protocol; adding one leaves the others alone.
_STREAMS = {"random_window_leaky": 9001, "by_unit": 9002, "cross_specimen": 9003}
_ATTEMPTS = 200


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SplitTable:
    """Which part of which record belongs to which subset; one row a (part of a) record.

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
        writer = csv.writer(buffer, lineterminator="\n")
        writer.writerow(HEADER)
        columns = (self.record_id, self.start_fraction, self.stop_fraction, self.subset)
        writer.writerows(zip(*(column.tolist() for column in columns), strict=True))
        return buffer.getvalue()


def make_splits(plan: Plan, seed: int) -> dict[str, SplitTable]:
    """The protocols this plan can have; one whose subsets could not all hold every class is left out.

    Parameters
    ----------
    plan : Plan    with `label` and, for the clean protocols, `unit_id` and `specimen_id`
    seed : int     the same plan and seed give the same splits

    Returns
    -------
    protocol -> SplitTable, a subset of 'random_window_leaky', 'by_unit', 'cross_specimen'
    """
    makers: dict[str, Callable[[Plan, np.random.Generator], SplitTable | None]] = {
        "random_window_leaky": _random_windows,
        "by_unit": lambda plan, rng: _by_group(plan, "unit_id", len(SUBSETS), rng),
        "cross_specimen": lambda plan, rng: _by_group(plan, "specimen_id", MIN_SPECIMENS, rng),
    }
    tables = {}
    for protocol, make in makers.items():
        sequence = np.random.SeedSequence(seed, spawn_key=(_STREAMS[protocol],))
        table = make(plan, np.random.Generator(np.random.Philox(sequence)))
        if table is not None:
            tables[protocol] = table
    return tables


def _random_windows(plan: Plan, rng: np.random.Generator) -> SplitTable:
    """Eight windows of every record scattered over the subsets, so that a record is on every side: leaks on purpose."""
    n = plan.n_records
    # 5 windows train; the other three 2 + 1 or 1 + 2, which gives shares of 62.5 / 18.75 / 18.75 % on average.
    subset = np.tile([0, 0, 0, 0, 0, 1, 2, 0], (n, 1))
    subset[:, 7] = rng.integers(1, 3, size=n)
    subset = rng.permuted(subset, axis=1).ravel()
    start = np.tile(np.arange(N_WINDOWS) / N_WINDOWS, n)
    return SplitTable(
        record_id=np.repeat(plan.columns["record_id"], N_WINDOWS),
        start_fraction=start,
        stop_fraction=start + 1 / N_WINDOWS,
        subset=np.array(SUBSETS)[subset],
    )


def _by_group(plan: Plan, column: str, min_groups: int, rng: np.random.Generator) -> SplitTable | None:
    """Whole groups dealt 60 / 20 / 20; None when no deal gives every class to every subset."""
    if column not in plan.columns or "label" not in plan.columns:
        return None
    names, group = np.unique(plan.columns[column], return_inverse=True)
    if len(names) < max(min_groups, len(SUBSETS)):
        return None
    n_held_out = max(1, round(0.2 * len(names)))
    counts = [len(names) - 2 * n_held_out, n_held_out, n_held_out]
    classes, label = np.unique(plan.columns["label"], return_inverse=True)
    in_order = np.repeat(np.arange(len(SUBSETS)), counts)
    for _ in range(_ATTEMPTS):
        subset = rng.permutation(in_order)[group]
        present = np.zeros((len(SUBSETS), len(classes)), dtype=bool)
        present[subset, label] = True
        if present.all():
            return SplitTable(
                record_id=plan.columns["record_id"],
                start_fraction=np.zeros(plan.n_records, dtype=int),
                stop_fraction=np.ones(plan.n_records, dtype=int),
                subset=np.array(SUBSETS)[subset],
            )
    return None


def read_split(path: Path) -> SplitTable:
    """Read one `splits/<protocol>.csv`; DatasetError names the file and what is wrong with it."""
    text = read_text(path, limit=TEXT_BYTES_LIMIT * 4)
    try:
        header, *rows = csv.reader(io.StringIO(text, newline=""), strict=True)
        if tuple(header) != HEADER:
            raise ValueError(f"header is {','.join(header)[:80]}, expected {','.join(HEADER)}")
        ids, starts, stops, subsets = zip(*rows, strict=True)
        start, stop = np.array(starts, dtype=float), np.array(stops, dtype=float)
        if not ((start >= 0) & (start < stop) & (stop <= 1)).all():
            raise ValueError("fractions must be 0 <= start < stop <= 1")
        unknown = set(subsets) - set(SUBSETS)
        if unknown:
            raise ValueError(f"subset {min(unknown)[:40]!r} is unknown; allowed are {', '.join(SUBSETS)}")
    except (csv.Error, ValueError) as error:
        raise DatasetError(f"{path} is no split table ({error}); restore it from a copy") from error
    return SplitTable(record_id=np.array(ids), start_fraction=start, stop_fraction=stop, subset=np.array(subsets))
