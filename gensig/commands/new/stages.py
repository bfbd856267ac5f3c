"""A new gearbox of one stage or several, from the flags: speeds, torques, shafts and gears."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import Any

from gensig.commands.new.data_sheet import (
    DataSheet,
    GearOption,
    check_positive,
    gear_option,
)
from gensig.errors import ConfigError, GensigError
from gensig.systems.derived_sizes import bores

Pair = tuple[Any, Any]  # of the driving and the driven gear

# flags of one pair that several stages do not take, and what to do in their place
ONE_STAGE_FLAGS = {
    "bores": "edit bore_radius_mm in the table of gears",
    "supports": "edit system.support in the option of the system",
    "sensors": "records of a drive line have no housing",
}
OF_BOTH_GEARS = ("widths", "bores", "supports", "profile_shifts")


@dataclass(frozen=True, slots=True)
class Gearbox:
    """Gears in stages, the driving one first; each stage is a pair at its own speed and torque."""

    stages: Sequence[GearOption]

    @property
    def sheet(self) -> DataSheet:
        """The data sheet of the driving stage."""
        return self.stages[0].sheet

    @property
    def teeth(self) -> list[Pair]:
        """Teeth of the driving and the driven gear of each stage."""
        return [stage.sheet.teeth for stage in self.stages]

    @property
    def written_teeth(self) -> str:
        """Teeth as data sheets write them: 29/100 + 36/90."""
        return " + ".join(f"{pinion}/{wheel}" for pinion, wheel in self.teeth)

    @property
    def slowdowns(self) -> list[float]:
        """Speed of the input shaft over that of each shaft, (n_stages + 1,)."""
        return slowdowns(self.teeth)

    @property
    def diameters(self) -> list[float]:
        """Diameters in mm of the shafts of several stages, (n_stages + 1,)."""
        modules = [stage.sheet.module for stage in self.stages]
        return shaft_diameters(self.teeth, modules)

    @property
    def mesh_forces(self) -> list[float]:
        """Normal force of each mesh at the rated torque, N."""
        return [stage.machine.mesh_force for stage in self.stages]


def read_gearbox(arguments: Namespace) -> Gearbox:
    """The gearbox of the flags.

    Raises
    ------
    GensigError    for flags that do not fit the number of stages, and for gears that cannot be
        made or cannot mesh; of several stages it names the stage
    """
    teeth = _pairs(arguments.teeth)
    check_positive("--speed", arguments.speed)
    check_positive("--torque", arguments.torque)
    for flag in ("module", "widths", "bores", "supports"):
        check_positive(f"--{flag}", *(getattr(arguments, flag) or ()))
    if len(teeth) > 1:
        columns = _of_several(arguments, teeth)
    else:
        columns = _of_one(arguments)
    stages = []
    shafts = zip(teeth, slowdowns(teeth), strict=False)
    for number, (pair, slowdown) in enumerate(shafts):
        try:
            sheet = DataSheet(
                name=arguments.name,
                teeth=pair,
                speed=arguments.speed / slowdown,
                torque=arguments.torque * slowdown,
                helix_angle=arguments.helix or 0.0,
                pressure_angle=arguments.pressure_angle,
                addendum=arguments.addendum,
                **{name: column[number] for name, column in columns.items()},
            )
            stages.append(gear_option(sheet))
        except GensigError as error:
            if len(teeth) == 1:
                raise
            stage = f"stage {number + 1}, {pair[0]}/{pair[1]}"
            raise type(error)(f"{stage}: {error}") from None
    return Gearbox(stages)


def _of_one(arguments: Namespace) -> dict[str, Sequence[Any]]:
    """Values of a single pair, by the names of the data sheet."""
    columns: dict[str, Sequence[Any]] = {}
    for name in OF_BOTH_GEARS:
        given = getattr(arguments, name)
        if given is None:
            continue
        if len(given) > 2:
            raise ConfigError(
                f"--{name.replace('_', '-')} takes one number for both gears, "
                "or two: pinion and wheel"
            )
        columns[name] = [(given[0], given[-1])]
    if len(arguments.module) > 1:
        raise ConfigError(
            f"--module takes one number for a pair of gears, not {len(arguments.module)}; "
            "one a stage where --teeth has several stages"
        )
    return {"module": arguments.module, **columns}


def _of_several(
    arguments: Namespace, teeth: Sequence[Pair]
) -> dict[str, Sequence[Any]]:
    """Values of several stages, (stage,), by the names of the data sheet."""
    for flag, instead in ONE_STAGE_FLAGS.items():
        if getattr(arguments, flag) is not None:
            raise ConfigError(f"--{flag} is for one pair of gears; {instead}")
    if arguments.experiment != "plain":
        raise ConfigError(
            f"--experiment {arguments.experiment} is for one pair of gears: records of a drive "
            "line have no housing; leave it out"
        )
    for pair in teeth:
        check_positive("--teeth", *pair)
    n_stages = len(teeth)
    modules = _for_all("--module", arguments.module, n_stages, "stage")
    ends = pairwise(shaft_diameters(teeth, modules))
    columns: dict[str, Sequence[Any]] = {"module": modules, "bores": list(ends)}
    if arguments.widths is not None:
        widths = _for_all("--widths", arguments.widths, n_stages, "stage")
        columns["widths"] = [(width, width) for width in widths]
    if arguments.profile_shifts is not None:
        given = arguments.profile_shifts
        shifts = _for_all("--profile-shifts", given, 2 * n_stages, "gear")
        columns["profile_shifts"] = _pairs(shifts)
    return columns


def _pairs(values: Sequence[Any]) -> list[Pair]:
    """Values of driving and driven gear of each stage, from all in turn."""
    return list(zip(values[::2], values[1::2], strict=True))


def _for_all(
    flag: str, values: Sequence[float], count: int, one: str
) -> Sequence[float]:
    """So many values, from one for all or one each."""
    if len(values) not in (1, count):
        raise ConfigError(
            f"{flag} takes one number for all {one}s, or {count}: one a {one}"
        )
    return list(values) * (count // len(values))


def slowdowns(teeth: Sequence[Pair]) -> list[float]:
    """Speed of the input shaft over that of each shaft, (n_stages + 1,)."""
    steps = accumulate(
        teeth, lambda ratio, pair: ratio * pair[1] / pair[0], initial=1.0
    )
    return list(steps)


def shaft_diameters(teeth: Sequence[Pair], modules: Sequence[float]) -> list[float]:
    """Diameters in mm of the shafts, the input one first, (n_stages + 1,).

    Each stage has the bores of a single pair, ``derived_sizes.bores``. A shaft between two stages
    takes the smaller of both.
    """
    stages = [bores(pair, module) for pair, module in zip(teeth, modules, strict=True)]
    between = [min(stage[1], after[0]) for stage, after in pairwise(stages)]
    return [stages[0][0], *between, stages[-1][1]]
