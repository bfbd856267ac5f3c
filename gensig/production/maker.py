"""Makers of what a data-set folder lacks: its plan, and its shards."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from gensig.dataset.folder.layout import ConfigContent, ShardEntry
from gensig.dataset.plan import Plan
from gensig.options.configuration import Configuration
from gensig.plan.make import make_plan
from gensig.production.shard_writing import write_shard


@dataclass(frozen=True, slots=True, kw_only=True)
class Maker:
    """Functions that make parts of a folder, each with the bits that they had.

    Attributes
    ----------
    plan : takes folder and configuration
    check : takes the folder; raises GensigError where no shard can be made, with one line
    write : takes folder, number of a shard and ``counts``; executors pickle it
    """

    plan: Callable[[Path, ConfigContent], Plan]
    check: Callable[[Path], None]
    write: Callable[..., ShardEntry]


def _plan(_out: Path, config: ConfigContent) -> Plan:
    return make_plan(Configuration(config))


def _check(_out: Path) -> None:
    """A simulation needs nothing but the folder."""


SIMULATION = Maker(plan=_plan, check=_check, write=write_shard)
