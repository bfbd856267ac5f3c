"""Predicted size and time of a data set, from a few records made now."""

from __future__ import annotations

import math
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from gensig.dataset.folder.failures import commonest
from gensig.dataset.plan import Plan, plan_text
from gensig.execution.base import read_n_workers
from gensig.options.configuration import Section
from gensig.plan.make import describe_design, make_plan, varied_keys
from gensig.plan.notes import n_different
from gensig.production.shard_writing import block_length, open_shard
from gensig.record.inputs import InputReader
from gensig.record.simulate import Record, forget_twins, simulate_records
from gensig.text.amounts import duration_text, size_text

# Bytes of index, cards and configuration; more for each shard, record (splits) and class (figure).
OTHER_BYTES, BYTES_PER_SHARD, BYTES_PER_RECORD, BYTES_PER_CLASS = (
    42_000,
    3_000,
    380,
    40_000,
)

CLOSING = 2.0  # s for index, cards and figures, most of it the import of matplotlib


class FailedRecordsWarning(UserWarning):
    """Records that a plan was timed with failed, as others of the data set will."""


def predict(
    reader: InputReader,
    *,
    table: Plan | None = None,
    on_plan: Callable[[Plan, int], None] = lambda _plan, _n_timed: None,
) -> dict[str, str]:
    """Facts of a data set that is not made yet, by name, as text; ``varies`` has a line a key.

    A block of its first records is simulated and stored in a temporary folder. Time is that of a
    machine like this one with as many workers; start-up is counted for the workers of this
    machine.

    Parameters
    ----------
    table : the plan, if it is made already, which then costs no time any more
    on_plan : called with the plan and the number of records, before the first is made
    """
    started = time.process_time()  # what a process spends before its first record
    begin = time.monotonic()
    if table is None:
        table = make_plan(reader.config)
    planning = time.monotonic() - begin
    first = table.rows(0)[: block_length(reader.machine())]
    probe = [table.record(int(index)) for index in first]
    on_plan(table, len(probe))
    begin = time.monotonic()
    simulate_records(reader, probe[:1])  # compiles, or loads what was compiled
    workers = min(_n_processes(reader.config["executor"]), table.n_shards)
    # Workers import once more what this process has imported, and load what was compiled.
    n_imports = min(workers, 2)
    start_up = planning + started * n_imports + time.monotonic() - begin
    forget_twins()
    begin = time.monotonic()
    records = simulate_records(reader, probe)
    _warn_of_failed(records)
    n_bytes = _stored_bytes(reader, table, records)
    seconds = time.monotonic() - begin
    rounds: float = math.ceil(table.n_shards / workers)
    whole = seconds * max(table.shard_sizes()) / len(probe)
    spread = table.n_records / max(table.shard_sizes()) / workers
    if rounds >= 2 * spread:
        rounds = spread
    total = start_up + CLOSING + whole * rounds
    examples = table.examples()
    classes = Counter(str(name) for name in examples.columns["label_name"])
    return {
        "records": f"{examples.n_records:,}",
        **_references(table),
        "classes": ", ".join(f"{name} {count:,}" for name, count in classes.items()),
        "machines": f"{n_different(table, 'unit_id'):,}",
        "gears": f"{n_different(table, 'specimen_id'):,} set(s)",
        "gearboxes": f"{n_different(table, 'gearbox_id'):,}",
        "conditions": f"{n_different(examples, 'condition_id'):,}",
        "design": describe_design(reader),
        "repeats": f"{reader.plan.n_repeats}",
        "varies": _varied(reader),
        "shards": f"{table.n_shards} of at most {max(table.shard_sizes())} records",
        "bytes": f"{n_bytes:,} ({size_text(n_bytes)})",
        "time": f"about {duration_text(total)} on {workers} worker(s), "
        f"from {seconds / len(probe):.3g} s a record measured now",
    }


def _varied(reader: InputReader) -> str:
    """Varied keys with their ranges, a line each."""
    varied = varied_keys(reader)
    if not varied:
        return "no key; records differ in start, noise and, by machine, in their errors"
    width = max(map(len, varied))
    return "\n".join(f"{key:<{width}}  {text}" for key, text in varied.items())


def _references(table: Plan) -> dict[str, str]:
    """Number of reference records, where there are any."""
    n_reference = int(np.count_nonzero(table.is_reference))
    if not n_reference:
        return {}
    each = n_reference // n_different(table, "unit_id")
    return {
        "references": f"{n_reference:,} more ({each} a machine, healthy, in no split)"
    }


def _warn_of_failed(records: Sequence[Record]) -> None:
    reasons = [
        str(record.values["status_reason"])
        for record in records
        if record.values.get("status") == "failed"
    ]
    if reasons:
        warnings.warn(
            f"{len(reasons)} of {len(records)} records made to time the plan failed: "
            f"{commonest(reasons)}",
            FailedRecordsWarning,
            stacklevel=3,
        )


def _n_processes(executor: Section) -> int:
    """Shards made at a time, also where the rest of ``executor`` is not known yet."""
    return read_n_workers(executor["n_workers"]) * (executor.get("shard_count") or 1)


def _stored_bytes(reader: InputReader, table: Plan, records: list[Record]) -> int:
    """Bytes of all files, from two shards of different length and usual sizes of the others."""
    params = [
        name.removeprefix("params/")
        for name in table.columns
        if name.startswith("params/")
    ]
    sizes = []
    with tempfile.TemporaryDirectory() as folder:
        for n in (1, len(records)):
            with open_shard(Path(folder) / f"{n}.h5", reader, n, params) as writer:
                for row, record in enumerate(records[:n]):
                    writer.write(row, record.signals, record.values)
            sizes.append(writer.n_bytes)
    single, many = sizes
    per_record: float = single
    if len(records) > 1:
        per_record = (many - single) / (len(records) - 1)
    shards = table.n_shards * (single - per_record) + table.n_records * per_record
    n_classes = len(reader.plan.classes)
    other = (
        OTHER_BYTES
        + BYTES_PER_SHARD * table.n_shards
        + BYTES_PER_RECORD * table.n_records
        + BYTES_PER_CLASS * n_classes
    )
    return round(shards + len(plan_text(table)) + other)
