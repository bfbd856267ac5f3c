"""Streams: records of a data set that are simulated on demand and never stored.

Their bits are those of ``generate``.
"""

from __future__ import annotations

import operator
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gensig.arrays import Flags, Integers
from gensig.dataset.plan import Plan
from gensig.dataset.schema import DEFAULTS, stored_reason
from gensig.dataset.splitting.protocols import make_splits, why_left_out
from gensig.dataset.splitting.splits import SUBSETS
from gensig.dynamics.integrator import Solver, records_together
from gensig.errors import ConfigError, DatasetError
from gensig.options.configuration import Configuration, whole_number
from gensig.plan.make import make_plan
from gensig.record.inputs import InputReader
from gensig.record.machines import read_machine
from gensig.record.simulate import Record, simulate_records
from gensig.sensing.chain import stands_for_channels

# Spawn key of the seeds of later epochs. The causes of a record and the splits have others.
EPOCH_STREAM = 9100


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class RecordStream:
    """The records of one plan, or a part of them, simulated in a loop; made by ``gensig.stream``.

    Holds plain data only, so that it can be pickled, forked and spawned. A record has ``signals``
    and ``values`` by the names that a shard has, every column and array with the bits that
    ``gensig generate`` would store.

    Attributes
    ----------
    config : Configuration      as composed, with the root seed
    epoch : int                 0 for the records of ``generate``, else a draw of as many others
    plan : Plan                 all records of the epoch
    numbers : (record,) int     records of this part, by their number in the plan

    Epoch ``k`` of root seed ``s`` is the data set of ``seed``: ``s`` itself for epoch 0, else the
    53 high bits of ``SeedSequence(s, spawn_key=(9100, k))``. Everything is drawn anew, units
    included: ``unit-0000`` of two epochs are different gears.
    """

    config: Configuration
    epoch: int
    plan: Plan
    numbers: Integers

    @property
    def seed(self) -> int:
        """The seed with which ``gensig generate`` makes this epoch."""
        return epoch_seed(self.config.seed, self.epoch)

    @property
    def class_names(self) -> list[str]:
        """``class_names[label]`` is the class."""
        return list(self.config["plan"]["classes"])

    @property
    def channels(self) -> list[str]:
        """Names along the channel axis."""
        sensing = self.config["sensing"]
        if stands_for_channels(sensing["channels"]):
            return list(read_machine(self.config).sensing.channel_names)
        if sensing["sensors"] is None:
            return list(sensing["channels"])
        return list(sensing["sensors"])

    channel_names = channels  # as a stored data set calls them

    @property
    def sampling_rate_hz(self) -> float:
        """Samples a second."""
        return float(self.config["sensing"]["sampling_rate_hz"])

    sampling_rate = sampling_rate_hz

    @property
    def n_samples(self) -> int:
        """Samples of one channel of one record."""
        return round(self.config["operating"]["duration_s"] * self.sampling_rate_hz)

    @property
    def usable(self) -> Flags:
        """(record,) True; records that fail are known only when they are made, by ``status``."""
        return np.ones(len(self), dtype=bool)

    @property
    def column_names(self) -> list[str]:
        """Names that ``column`` takes."""
        return sorted(self.plan.columns)

    def column(self, name: str) -> NDArray[Any]:
        """One value of the plan a record, (record,)."""
        if name not in self.plan.columns:
            raise DatasetError(
                f"the plan has no column {name!r}; it has {', '.join(self.column_names)}"
            )
        return self.plan.columns[name][self.numbers]

    @property
    def gear_names(self) -> list[str]:
        """Names of the gears: pinion and wheel, of a drive line all of the line."""
        return list(read_machine(self.config).gears)

    def n_teeth(self, gear: str) -> Integers:
        """Teeth of a gear, (record,): of each unit's gear, or of the one design."""
        name = f"n_teeth_{gear}"
        if name in self.plan.columns:
            return self.column(name)
        gears = read_machine(self.config).gears
        if gear not in gears:
            raise DatasetError(
                f"gear {gear!r} does not exist; there are {', '.join(gears)}"
            )
        return np.full(len(self), gears[gear].n_teeth, dtype=np.int64)

    @property
    def protocols(self) -> list[str]:
        """Names that ``split`` takes."""
        return sorted(make_splits(self.plan, self.seed))

    def split(self, protocol: str) -> dict[str, list[tuple[int, float, float]]]:
        """Subset -> list of (index in this part, start_fraction, stop_fraction).

        It is that of the stored data set.
        """
        tables = make_splits(self.plan, self.seed)
        if protocol not in tables:
            reason = why_left_out(self.plan, self.seed).get(
                protocol, f"the plan can have {', '.join(sorted(tables))}"
            )
            raise DatasetError(f"split {protocol!r} does not exist; {reason}")
        indices = {name: k for k, name in enumerate(self.column("record_id").tolist())}
        rows: dict[str, list[tuple[int, float, float]]] = {
            subset: [] for subset in SUBSETS
        }
        for name, start, stop, subset in tables[protocol].rows():
            if name in indices:
                rows[subset].append((indices[name], start, stop))
        return rows

    def take(self, records: ArrayLike) -> RecordStream:
        """Some records of this part: (record,) indices in it, or True for each chosen one."""
        chosen = np.asarray(records)
        if chosen.dtype != bool:
            chosen = chosen.astype(np.int64)
        return replace(self, numbers=self.numbers[chosen])

    def shard(self, index: int, count: int) -> RecordStream:
        """The part of worker ``index`` of ``count``; the parts are disjoint and together the whole.

        Conditions are dealt in turn, each whole: its records share the simulation of their
        healthy twin.
        """
        whole_number("count", count, at_least=1)
        if whole_number("index", index, at_least=0) >= count:
            raise ConfigError(f"index = {index} must be below count = {count}")
        condition = np.unique(self.column("condition_id"), return_inverse=True)[1]
        return self.take(condition % count == index)

    def at_epoch(self, epoch: int) -> RecordStream:
        """The same part of another epoch; its plan is drawn now."""
        if epoch == self.epoch:
            return self
        seed = epoch_seed(self.config.seed, epoch)
        plan = make_plan(self.config.with_entries(seed=seed))
        return replace(self, epoch=epoch, plan=plan)

    def epochs(self, count: int | None = None) -> Iterator[RecordStream]:
        """This epoch and those that follow, endless where ``count`` is None."""
        epoch = self.epoch
        while count is None or epoch < self.epoch + count:
            yield self.at_epoch(epoch)
            epoch += 1

    def __len__(self) -> int:
        return len(self.numbers)

    def __iter__(self) -> Iterator[Record]:
        together = records_together(self.config.section("solver").read(Solver))
        for first in range(0, len(self), together):
            yield from self._records(self.numbers[first : first + together])

    def __getitem__(self, index: int) -> Record:
        return self._records([self.numbers[operator.index(index)]])[0]

    def __repr__(self) -> str:
        share = f"{len(self)} of {self.plan.n_records} records"
        return f"RecordStream({share}, epoch {self.epoch}, classes {self.class_names})"

    def _records(self, numbers: Sequence[int] | Integers) -> list[Record]:
        rows = [self.plan.record(int(number)) for number in numbers]
        reader = InputReader(self.config.with_entries(seed=self.seed))
        return [_as_stored(record) for record in simulate_records(reader, rows)]


def open_stream(config: Configuration, *, epoch: int = 0) -> RecordStream:
    """All examples of a composed configuration; reference records are left out.

    ``out``, ``executor`` and the storage of samples change nothing.

    Raises
    ------
    GensigError    for whatever ``make_plan`` refuses
    """
    config = config.with_entries(out=None)
    _ = InputReader(config).dataset  # refuses what no data set has
    plan = make_plan(config.with_entries(seed=epoch_seed(config.seed, epoch)))
    return RecordStream(
        config=config,
        epoch=epoch,
        plan=plan,
        numbers=np.flatnonzero(~plan.is_reference),
    )


def epoch_seed(seed: int, epoch: int) -> int:
    """Seed of one epoch, a whole number that every JSON reader takes exactly.

    See `RecordStream`.
    """
    if whole_number("epoch", epoch, at_least=0) == 0:
        return seed
    sequence = np.random.SeedSequence(seed, spawn_key=(EPOCH_STREAM, epoch))
    return int(sequence.generate_state(1, np.uint64)[0]) >> 11


def _as_stored(record: Record) -> Record:
    """The record with the values that a shard fills in, and its reason cut as in a shard."""
    values = {**DEFAULTS, **record.values}
    values["status_reason"] = stored_reason(values["status_reason"])
    return replace(record, values=values)
