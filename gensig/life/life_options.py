"""Options of lives: history, snapshots, end, drift and the parameters of growth laws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gensig.errors import ConfigError
from gensig.faults.base import Growth
from gensig.faults.registry import FAULTS
from gensig.life.crack_growth import CrackGrowthOptions
from gensig.life.drift import Drift
from gensig.life.growth import GrowthOptions
from gensig.life.load_history import DrawnBlocks
from gensig.life.pit_growth import PitGrowthOptions
from gensig.life.snapshots import SPACINGS
from gensig.life.spread import Spread
from gensig.options.configuration import Configuration
from gensig.units import read, to_si, unit

RUN_TO_FAILURE = "run_to_failure"
NO_LIFE = "none"
BLOCK_COLUMNS = ("begin_h", "end_h", "speed_rpm", "torque_nm")


@dataclass(frozen=True, slots=True, kw_only=True)
class WearGrowthOptions(GrowthOptions):
    """Differences between units in wear, whose law and end are those of the group ``wear``."""

    rate_scatter: float

    def __post_init__(self) -> None:
        self.spread  # noqa: B018  checks the number

    @property
    def spread(self) -> Spread:
        """How units differ; a flank begins new."""
        return Spread(rate_scatter=self.rate_scatter, start_scatter=0.0)


OPTIONS: Mapping[Growth, type[GrowthOptions]] = {
    Growth.PARIS: CrackGrowthOptions,
    Growth.PITS: PitGrowthOptions,
    Growth.ARCHARD: WearGrowthOptions,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class LifeOptions:
    """Lives of the units of a data set, times in s.

    Parameters
    ----------
    n_setpoints : speeds and loads of one life
    horizon : clock time at which a life that has not failed is censored
    snapshot_count, snapshot_spacing, snapshot_every : as in ``snapshot_times``
    drawn : how blocks are drawn
    blocks : (begin s, end s, speed rad/s, torque N m) each, the same for every unit; None draws
        them
    drift : by configuration key
    laws : by the kind of the fault that grows
    """

    n_setpoints: int
    horizon: float = unit("h")
    snapshot_count: int
    snapshot_spacing: str
    snapshot_every: float | None = unit("h")
    drawn: DrawnBlocks
    blocks: tuple[tuple[float, ...], ...] | None
    drift: Mapping[str, Drift]
    laws: Mapping[str, GrowthOptions]

    def __post_init__(self) -> None:
        if self.n_setpoints < 1:
            raise ConfigError(
                f"life.n_setpoints = {self.n_setpoints} must be at least 1"
            )
        if not self.horizon > 0.0:
            raise ConfigError(
                f"life.horizon_h = {self.horizon / 3600.0:g} must be positive"
            )
        if self.snapshot_count < 3:
            raise ConfigError(
                f"life.snapshot_count = {self.snapshot_count}: a life needs 3 snapshots or more"
            )
        if self.snapshot_spacing not in SPACINGS:
            raise ConfigError(
                f"life.snapshot_spacing = {self.snapshot_spacing!r}; allowed: {', '.join(SPACINGS)}"
            )
        if self.snapshot_every is not None and not (
            self.snapshot_every > 0.0 and self.snapshot_spacing == "linear"
        ):
            raise ConfigError(
                f"life.snapshot_every_h = {self.snapshot_every / 3600.0:g} must be positive, and "
                "goes with "
                f"life.snapshot_spacing=linear only"
            )


def runs_to_failure(config: Configuration) -> bool:
    """Whether the units of a configuration live; those of earlier versions have no ``life``."""
    return config.get("life", {"kind": NO_LIFE})["kind"] != NO_LIFE


def read_life(life: Mapping[str, Any]) -> LifeOptions:
    """Options from the boundary keys of the group ``life``.

    Raises
    ------
    ConfigError    for keys or values that make no life
    """
    if life.get("kind") != RUN_TO_FAILURE:
        raise ConfigError(
            f"life.kind = {life.get('kind')!r}; allowed: {NO_LIFE}, {RUN_TO_FAILURE}"
        )
    own = {key: value for key, value in life.items() if key != "kind"}
    laws: dict[str, GrowthOptions] = {}
    for kind, fault in FAULTS.items():
        if fault.growth is Growth.NONE:
            continue
        values = own.pop(kind, None)
        if values is not None:
            laws[kind] = read(OPTIONS[fault.growth], values, f"life.{kind}")
    drift = own.pop("drift", None) or {}
    if not isinstance(drift, Mapping):
        raise ConfigError(
            f"life.drift = {drift!r} must be a group of configuration keys, each with change, "
            "time_h and scatter"
        )
    drawn = DrawnBlocks(
        shortest=_hours(own, "block_low_h"),
        longest=_hours(own, "block_high_h"),
        gap_chance=_number("life.gap_chance", own.pop("gap_chance", None)),
        gap_shortest=_hours(own, "gap_low_h"),
        gap_longest=_hours(own, "gap_high_h"),
    )
    return read(
        LifeOptions,
        {key: value for key, value in own.items() if key != "blocks"},
        "life",
        drawn=drawn,
        blocks=_blocks(own.get("blocks")),
        drift={
            key: read(Drift, values, f"life.drift.{key}")
            for key, values in drift.items()
        },
        laws=laws,
    )


def _hours(own: dict[str, Any], key: str) -> float:
    return _number(f"life.{key}", own.pop(key, None)) * to_si(key, 1.0)


def _number(key: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
        raise ConfigError(f"{key} = {value!r} is not a number")
    return float(value)


def _blocks(rows: Any) -> tuple[tuple[float, ...], ...] | None:
    """Blocks in SI as listed; None where they are drawn."""
    if rows is None:
        return None
    shape = f"a list of [{', '.join(BLOCK_COLUMNS)}]"
    if not isinstance(rows, list | tuple) or not rows:
        raise ConfigError(
            f"life.blocks = {rows!r} must be {shape}, or null to draw them"
        )
    found = []
    for place, row in enumerate(rows):
        if not isinstance(row, list | tuple) or len(row) != len(BLOCK_COLUMNS):
            raise ConfigError(
                f"life.blocks.{place} = {row!r}: life.blocks must be {shape}"
            )
        numbers = zip(BLOCK_COLUMNS, row, strict=True)
        found.append(
            tuple(
                to_si(key, _number(f"life.blocks.{place}.{key}", value))
                for key, value in numbers
            )
        )
    return tuple(found)
