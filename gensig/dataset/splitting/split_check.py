"""Check of split tables against the groups that their protocols keep apart."""

from collections.abc import Sequence

import numpy as np

from gensig.dataset.plan import Plan
from gensig.dataset.splitting.protocols import PROTOCOLS
from gensig.dataset.splitting.splits import SplitTable


def split_problems(protocol: str, table: SplitTable, plan: Plan) -> list[str]:
    """Groups on two sides of a split that its protocol keeps apart; one line each.

    No part of a record is ever given twice. Clean protocols also keep apart whole records, and
    with them their noise seeds, which follow from the record alone, and the groups of
    `Protocol.apart`. Of a protocol that this version does not know, only the first is asked.
    """
    ids = plan.columns["record_id"]
    order = np.argsort(ids, kind="stable")
    rank = np.searchsorted(ids, table.record_id, sorter=order)
    record = order[np.minimum(rank, plan.n_records - 1)]
    unknown = table.record_id[ids[record] != table.record_id]
    if unknown.size:
        return [f"{protocol}: record {str(unknown[0])[:40]!r} is not in the plan"]
    problems = []
    if twice := _overlapping(record, table):
        problems.append(f"{protocol}: a part of record {ids[twice[0]]} is given twice")
    references = ids[record[plan.is_reference[record]]]
    if references.size:
        problems.append(
            f"{protocol}: record {references[0]} is a reference record, which no subset may have"
        )
    known = PROTOCOLS.get(protocol)
    if known is None or not known.apart:
        return problems
    sides = np.unique(table.subset, return_inverse=True)[1]
    for column in ("record_id", *known.apart):
        if column not in plan.columns:
            problems.append(
                f"{protocol}: the plan has no column {column}, which it keeps apart"
            )
            continue
        names, group = np.unique(plan.columns[column], return_inverse=True)
        seen = np.zeros((len(names), 3), dtype=bool)
        seen[group[record], sides] = True
        torn = names[seen.sum(axis=1) > 1]
        if torn.size:
            problems.append(
                f"{protocol}: {column} {torn[0]} is in more than one subset ({torn.size} such)"
            )
    return problems


def _overlapping(record: np.ndarray, table: SplitTable) -> Sequence[int]:
    """Records of which two rows share a part."""
    order = np.lexsort((table.start_fraction, record))
    record = record[order]
    overlaps = table.start_fraction[order][1:] < table.stop_fraction[order][:-1]
    return record[1:][(record[1:] == record[:-1]) & overlaps].tolist()
