"""Several stages of gears from one data sheet: speeds, torques and shafts from stage to stage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from gensig.commands.new.data_sheet import (
    DataSheet,
    GearOption,
    check_positive,
    gear_option,
)
from gensig.errors import GensigError
from gensig.systems.derived_sizes import bores

Pair = tuple[int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class StagedSheet:
    """Known values of gears in stages, in the units of data sheets.

    Parameters
    ----------
    teeth : of the driving and the driven gear of each stage
    modules : mm, one a stage
    speed, torque : r/min and N m of the input shaft
    widths : mm, one a stage; None: of the module
    profile_shifts : of both gears of each stage; None: 0
    helix_angle, pressure_angle, addendum : of all gears
    """

    name: str
    teeth: tuple[Pair, ...]
    modules: tuple[float, ...]
    speed: float
    torque: float
    widths: tuple[float, ...] | None = None
    profile_shifts: tuple[tuple[float, float], ...] | None = None
    helix_angle: float = 0.0
    pressure_angle: float | None = None
    addendum: float | None = None

    def __post_init__(self) -> None:
        for name in ("speed", "torque"):
            check_positive(f"--{name}", getattr(self, name))
        check_positive("--module", *self.modules)
        check_positive("--widths", *(self.widths or ()))
        for teeth in self.teeth:
            check_positive("--teeth", *teeth)

    @property
    def n_stages(self) -> int:
        """Stages of gears."""
        return len(self.teeth)

    @property
    def written_teeth(self) -> str:
        """Teeth as data sheets write them: 29/100 + 36/90."""
        return " + ".join(f"{pinion}/{wheel}" for pinion, wheel in self.teeth)

    @property
    def slowdowns(self) -> list[float]:
        """Speed of the input shaft over that of each shaft, (n_stages + 1,)."""
        ratios = [1.0]
        for pinion, wheel in self.teeth:
            ratios.append(ratios[-1] * wheel / pinion)
        return ratios


def shaft_diameters(sheet: StagedSheet) -> list[float]:
    """Diameters in mm of the shafts, the input one first, (n_stages + 1,).

    Each stage has the bores of a single pair, ``derived_sizes.bores``. A shaft between two stages
    takes the smaller of both.
    """
    stages = [
        bores(teeth, module)
        for teeth, module in zip(sheet.teeth, sheet.modules, strict=True)
    ]
    between = [min(stage[1], after[0]) for stage, after in pairwise(stages)]
    return [stages[0][0], *between, stages[-1][1]]


def stage_options(sheet: StagedSheet) -> list[GearOption]:
    """The gears of each stage as those of a single pair at its rated speed and torque.

    Raises
    ------
    GensigError    that names the stage, for gears that cannot be made or cannot mesh
    """
    stages = []
    ends = pairwise(shaft_diameters(sheet))
    for number, (teeth, bore) in enumerate(zip(sheet.teeth, ends, strict=True)):
        slowdown = sheet.slowdowns[number]
        widths, shifts = None, None
        if sheet.widths is not None:
            widths = (sheet.widths[number], sheet.widths[number])
        if sheet.profile_shifts is not None:
            shifts = sheet.profile_shifts[number]
        try:
            of_stage = DataSheet(
                name=sheet.name,
                teeth=teeth,
                module=sheet.modules[number],
                speed=sheet.speed / slowdown,
                torque=sheet.torque * slowdown,
                widths=widths,
                bores=bore,
                helix_angle=sheet.helix_angle,
                pressure_angle=sheet.pressure_angle,
                addendum=sheet.addendum,
                profile_shifts=shifts,
            )
            stages.append(gear_option(of_stage))
        except GensigError as error:
            stage = f"stage {number + 1}, {teeth[0]}/{teeth[1]}"
            raise type(error)(f"{stage}: {error}") from None
    return stages


def mesh_forces(stages: Sequence[GearOption]) -> list[float]:
    """Normal force of each mesh at the rated torque, N."""
    return [option.machine.mesh_force for option in stages]
