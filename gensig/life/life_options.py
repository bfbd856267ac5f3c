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
from gensig.units import check_choice, check_positive, is_number, read, to_si, unit

RUN_TO_FAILURE = "run_to_failure"
NO_LIFE = "none"
DRAWN = {
    "block_low_h": "shortest",
    "block_high_h": "longest",
    "gap_chance": "gap_chance",
    "gap_low_h": "gap_shortest",
    "gap_high_h": "gap_longest",
}
BLOCK_COLUMNS = ("begin_h", "end_h", "speed_rpm", "torque_nm")


@dataclass(frozen=True, slots=True, kw_only=True)
class WearGrowthOptions(GrowthOptions):
    """Differences between units in wear, whose law and end are those of the group ``wear``.

    A flank begins new.
    """

    start_scatter = 0.0
    rate_scatter: float


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
        check_positive(self, "life.", "horizon")
        if self.snapshot_count < 3:
            raise ConfigError(
                f"life.snapshot_count = {self.snapshot_count}: a life needs 3 snapshots or more"
            )
        check_choice("life.snapshot_spacing", self.snapshot_spacing, SPACINGS)
        every = self.snapshot_every
        if every is not None and not (
            every > 0.0 and self.snapshot_spacing == "linear"
        ):
            raise ConfigError(
                f"life.snapshot_every_h = {every / 3600.0:g} must be positive, and goes with "
                "life.snapshot_spacing=linear only"
            )


def runs_to_failure(life: Mapping[str, Any] | None) -> bool:
    """True where the group ``life`` lets units fail; earlier versions have none."""
    return life is not None and life["kind"] != NO_LIFE


def read_life(life: Mapping[str, Any]) -> LifeOptions:
    """Options from the boundary keys of the group ``life``.

    Raises
    ------
    ConfigError    for keys or values that make no life
    """
    rest = dict(life)
    kind = rest.pop("kind", None)
    if kind != RUN_TO_FAILURE:
        raise ConfigError(f"life.kind = {kind!r}; allowed: {NO_LIFE}, {RUN_TO_FAILURE}")
    laws: dict[str, GrowthOptions] = {}
    for name, fault in FAULTS.items():
        values = None
        if fault.growth is not Growth.NONE:
            values = rest.pop(name, None)
        if values is not None:
            laws[name] = read(OPTIONS[fault.growth], values, f"life.{name}")
    drift = rest.pop("drift", None) or {}
    if not isinstance(drift, Mapping):
        raise ConfigError(
            f"life.drift = {drift!r} must be a group of configuration keys, "
            "each with change, time_h and scatter"
        )
    drawn = DrawnBlocks(
        **{
            field: _number(f"life.{key}", rest.pop(key, None)) * to_si(key, 1.0)
            for key, field in DRAWN.items()
        }
    )
    blocks = _blocks(rest.pop("blocks", None))
    drifts = {
        key: read(Drift, values, f"life.drift.{key}") for key, values in drift.items()
    }
    return read(
        LifeOptions, rest, "life", drawn=drawn, blocks=blocks, drift=drifts, laws=laws
    )


def _number(key: str, value: Any) -> float:
    if not is_number(value):
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
    blocks = []
    for index, row in enumerate(rows):
        where = f"life.blocks.{index}"
        if not isinstance(row, list | tuple) or len(row) != len(BLOCK_COLUMNS):
            raise ConfigError(f"{where} = {row!r}: life.blocks must be {shape}")
        numbers = zip(BLOCK_COLUMNS, row, strict=True)
        blocks.append(
            tuple(
                to_si(key, _number(f"{where}.{key}", value)) for key, value in numbers
            )
        )
    return tuple(blocks)
