"""Designs of a plan's units: values of gears that are drawn once a unit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from gensig.errors import ConfigError, GeometryError
from gensig.geometry.contact import GearPair
from gensig.mesh.modification import sound_teeth
from gensig.record.inputs import InputReader
from gensig.record.options import (
    CROSSED,
    GEAR_KEYS,
    SEPARATE,
    TORQUE_KEY,
    UNIT_LOAD,
)
from gensig.record.streams import Stream, stream
from gensig.systems.registry import SLICED

MOST_DRAWS = 100  # of one unit, until its gears can be made


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitDesigns:
    """Designs of the units of a plan; units take them in turn.

    Attributes
    ----------
    values : drawn values by configuration key, one mapping a design; one empty mapping where the
        plan draws none
    torques : torque of the pinion in N m at a unit load of 1 N/mm2, one a design; empty where the
        plan draws the torque itself
    """

    values: tuple[Mapping[str, float], ...]
    torques: tuple[float, ...]

    def of(self, unit: int, drawn: Mapping[str, float]) -> dict[str, float]:
        """All values of a condition of a unit: those of its design, and those drawn for it."""
        design = unit % len(self.values)
        values = {**self.values[design], **drawn}
        if self.torques:
            values[TORQUE_KEY] *= self.torques[design]
        return values

    def readers(self, reader: InputReader) -> list[InputReader]:
        """Readers of the designs, with the sizes of their gears."""
        return [reader.with_values(values) for values in self.values]


def draw_designs(reader: InputReader, n_units: int) -> UnitDesigns:
    """Draw the design of every unit, each from a stream of its own.

    A unit whose gears cannot be made or cannot mesh is drawn again from its stream.

    Raises
    ------
    ConfigError    for a unit whose gears can never be made
    """
    values: tuple[Mapping[str, float], ...] = ({},)
    if reader.plan.varies_gears:
        values = tuple(_draw_design(reader, unit) for unit in range(n_units))
    torques: tuple[float, ...] = ()
    if reader.plan.draws_unit_load:
        readers = (reader.with_values(design) for design in values)
        torques = tuple(unit_load_torque(each.parts.pair) for each in readers)
    return UnitDesigns(values=values, torques=torques)


def check_designs(reader: InputReader) -> None:
    """Raise ConfigError for plans whose gears cannot differ, or have no unit load."""
    options = reader.plan
    if reader.is_line and options.draws_unit_load:
        raise ConfigError(
            f"plan.vary.{TORQUE_KEY}: of = '{UNIT_LOAD}' is the load of one gear pair, and a "
            "drive line has several; draw the torque itself"
        )
    if not options.varies_gears:
        return
    key = next(key for key in options.vary if key.startswith(GEAR_KEYS))
    if not options.has_separate_machines:
        raise ConfigError(
            f"plan.vary: '{key}' is drawn once a machine, but with plan.machines={CROSSED} "
            f"machines share their gears; give plan.machines={SEPARATE}, or several sets with -m"
        )
    if reader.is_line:
        raise ConfigError(
            f"plan.vary: '{key}': a drive line has its gears from tables; take "
            "system=spur_pair or helical_pair, or make a set for each table"
        )
    if reader.system_kind == SLICED and reader.dataset.store_mesh_state:
        raise ConfigError(
            f"plan.vary: '{key}': the arrays of dataset.store_mesh_state differ with the gears "
            f"of system={SLICED}; give dataset.store_mesh_state=false, or take system=spur_pair"
        )


def _draw_design(reader: InputReader, unit: int) -> dict[str, float]:
    """Values of the first design of a unit's stream that can be made."""
    rng = stream(reader.seed, Stream.GEAR_DESIGN, unit)
    reason = ""
    for _ in range(MOST_DRAWS):
        values = {
            key: distribution.values_at(rng.random(1))[0]
            for key, distribution in reader.plan.unit_vary.items()
        }
        try:
            parts = reader.with_values(values).parts
            parts.pair.require_continuous_drive()
            sound_teeth(parts.pair, parts.modification)
        except GeometryError as error:
            reason = str(error)
        else:
            return values
    raise ConfigError(
        f"plan.vary: none of {MOST_DRAWS} designs drawn for machine {unit} can be made; narrow the "
        f"distributions of {GEAR_KEYS}*. The last: {reason}"
    )


def unit_load_torque(pair: GearPair) -> float:
    """Torque of the pinion at a unit load of 1 N/mm2, N m.

    The unit load is F_t / (b m_n), with the tangential force at the reference circle and the
    smaller face width.

    Source: Dudley's unit load (Dudley, Handbook of Practical Gear Design).
    """
    width = min(gear.face_width for gear in pair.gears.values())
    area = width * pair.pinion.normal_module
    return 1e6 * area * pair.pinion.pitch_radius
