"""The two tables of a gearbox of several stages, with the origin of each value in their heads."""

from __future__ import annotations

import io
import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

from gensig.commands.new.experiment import ScaledRotor, scaled_rotor, short_text
from gensig.commands.new.stages import Gearbox
from gensig.commands.new.tip_relief import RELIEF_ORIGIN, tip_reliefs
from gensig.geometry.contact import SIDES
from gensig.systems.derived_sizes import BORE_SHARE, WIDTH_IN_MODULES
from gensig.text.csv_tables import write_records

Row: TypeAlias = dict[
    str, object
]  # cells by column; columns that are left out are empty

FIRST_GEAR = 3  # node of the input pinion
# inertias of the coupling halves over those of the machines, as in two_stage_shafting.csv
INPUT_HALF, OUTPUT_HALF = 0.04, 1.0 / 30.0
HEAD_WIDTH = 98
SHAFTING = (
    "node",
    "name",
    "inertia_kg_m2",
    "speed_ratio",
    "stiffness_nm_per_rad",
    "edge_from",
    "edge_to",
    "edge_kind",
    "teeth_from",
    "teeth_to",
    "backlash_um",
    "center_line_deg",
    "note",
)
GEARS = (
    "node",
    "name",
    "n_teeth",
    "normal_module_mm",
    "pressure_angle_deg",
    "helix_angle_deg",
    "face_width_mm",
    "profile_shift",
    "bore_radius_mm",
    "addendum_coefficient",
    "clearance_coefficient",
    "cutter_tip_radius_coefficient",
    "tip_relief_um",
    "tip_relief_height_mm",
)


@dataclass(frozen=True, slots=True)
class LineNodes:
    """Numbers and names of the nodes of a gearbox of so many stages, as the tables have them."""

    n_stages: int

    @property
    def meshes(self) -> list[tuple[int, int]]:
        """Driving and driven node of each stage."""
        firsts = [FIRST_GEAR + 2 * stage for stage in range(self.n_stages)]
        return [(first, first + 1) for first in firsts]

    @property
    def load(self) -> int:
        """The last node."""
        return FIRST_GEAR + 2 * self.n_stages + 1

    def gear(self, node: int) -> str:
        """Name of the gear on a node."""
        if node == FIRST_GEAR:
            return "Input pinion"
        if node == self.meshes[-1][1]:
            return "Output gear"
        return f"Idler gear {node - FIRST_GEAR}"


def gears_table(gearbox: Gearbox) -> str:
    """The table of the gears."""
    sheet, stages = gearbox.sheet, gearbox.stages
    given = ["teeth, modules"]
    assumed = []
    for value, name, otherwise in (
        (sheet.widths, "face widths", f"face widths of {WIDTH_IN_MODULES:g} modules"),
        (sheet.profile_shifts, "profile shifts", "no profile shifts"),
        (sheet.pressure_angle, "pressure angle", "pressure angle of ISO 53"),
        (sheet.addendum, "addendum", "addendum of ISO 53-A"),
    ):
        if value is None:
            assumed.append(otherwise)
        else:
            given.append(name)
    assumed.append("clearance and tip rounding of ISO 53-A")
    if sheet.helix_angle != 0.0:
        given.append("helix angle")
    head = [
        f"Gears of {sheet.name}, {gearbox.written_teeth} teeth, written by gensig new gearbox.",
        f"Given: {', '.join(given)}.",
        f"Assumed: {', '.join(assumed)}.",
        f"Derived: bores. In each stage the smaller gear's shaft has {BORE_SHARE:g} of its pitch "
        "diameter (assumed), both shafts are twisted to the same stress; a shaft between two "
        "stages has the smaller bore of both. Masses are those of steel discs; a column mass_kg "
        "replaces them.",
    ]
    reliefs = [tip_reliefs(option) for option in stages]
    if any(reliefs):
        head.append(f"Tip reliefs: {RELIEF_ORIGIN}.")
    nodes = LineNodes(len(gearbox.stages))
    rows: list[Row] = []
    for mesh, option, relief in zip(nodes.meshes, stages, reliefs, strict=True):
        for node, side in zip(mesh, SIDES, strict=True):
            values = option.gear | option.gear[side] | relief.get(side, {})
            row = {key: values[key] for key in GEARS if key in values}
            rows.append({**row, "node": node, "name": nodes.gear(node)})
    return _table(head, GEARS, rows)


def shafting_table(gearbox: Gearbox) -> str:
    """The table of nodes, shafts, couplings and meshes."""
    torque, slowdowns = gearbox.sheet.torque, gearbox.slowdowns
    nodes = LineNodes(len(gearbox.stages))
    motor = scaled_rotor("motor", torque)
    load = scaled_rotor("load", torque * slowdowns[-1])
    speeds = [f"{1.0 / slowdown:.6g}" for slowdown in slowdowns]
    first, last = nodes.meshes[0][0], nodes.meshes[-1][1]
    shafts = _shafts(gearbox)
    input_half = short_text(INPUT_HALF * motor.inertia)
    output_half = short_text(OUTPUT_HALF * load.inertia)
    rows: list[Row] = [
        _node(1, "Motor", speeds[0], short_text(motor.inertia))
        | _edge(1, 2, "coupling", short_text(motor.stiffness)),
        _node(2, "Input coupling half", speeds[0], input_half)
        | _edge(2, first, "shaft", shafts[0].stiffness)
        | {"note": f"assumed; {shafts[0].size}"},
    ]
    for number, (driving, driven) in enumerate(nodes.meshes):
        pinion, wheel = gearbox.teeth[number]
        shaft = shafts[number + 1]
        rows += [
            _node(driving, nodes.gear(driving), speeds[number])
            | _edge(driving, driven, "gear_mesh")
            | {"teeth_from": pinion, "teeth_to": wheel, "center_line_deg": 0}
            | {"backlash_um": gearbox.stages[number].gear["backlash_um"]}
            | {"note": "teeth given"},
            _node(driven, nodes.gear(driven), speeds[number + 1])
            | _edge(driven, driven + 1, "shaft", shaft.stiffness)
            | {"note": shaft.size},
        ]
    rows += [
        _node(last + 1, "Output coupling half", speeds[-1], output_half)
        | _edge(last + 1, nodes.load, "coupling", short_text(load.stiffness)),
        _node(nodes.load, "Brake", speeds[-1], short_text(load.inertia)),
    ]
    return _table(_shafting_head(gearbox, motor, load), SHAFTING, rows)


def _shafting_head(
    gearbox: Gearbox, motor: ScaledRotor, load: ScaledRotor
) -> list[str]:
    sheet = gearbox.sheet
    return [
        f"A gearbox of {len(gearbox.stages)} stages, {gearbox.written_teeth} teeth, between a "
        f"motor and a brake: {sheet.name}, written by gensig new gearbox for {sheet.speed:g} "
        f"r/min and {sheet.torque:g} N m of the input shaft. Given: teeth, speed, torque.",
        f"Assumed: motor of {motor.origin}, brake of {load.origin}, bodies of one shape; couplings "
        f"of {motor.base_stiffness:g} and {load.base_stiffness:g} N m/rad there, in proportion to "
        f"the torque; coupling halves of {INPUT_HALF:g} and {OUTPUT_HALF:.2g} of motor and brake, "
        "as in two_stage_shafting.csv; all gears in a row (center_line_deg 0); backlash along the "
        "line of action by ISO/TR 10064-2, 2/3 (0.06 + 0.0005 a + 0.03 m) mm.",
        "Derived: shafts of steel, G pi d^4 / (32 L), as thick as the bores in the table of gears. "
        "Assumed: L from a coupling to the middle of its gear a face width and one and a half "
        "diameters, between two gears the mean of their widths and a diameter.",
        "An empty inertia is that of the gears on the node as steel discs with their bores; an "
        "empty mesh stiffness is that of ISO 6336-1, Method B.",
    ]


def _node(number: int, name: str, speed_ratio: str, inertia: str = "") -> Row:
    """Cells of a node; an inertia that is given is assumed."""
    cells: Row = {"node": number, "name": name, "speed_ratio": speed_ratio}
    if inertia:
        cells |= {"inertia_kg_m2": inertia, "note": "assumed"}
    return cells


def _edge(first: int, second: int, kind: str, stiffness: str = "") -> Row:
    """Cells of a joint."""
    return {
        "edge_from": first,
        "edge_to": second,
        "edge_kind": kind,
        "stiffness_nm_per_rad": stiffness,
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class _ShaftCells:
    """Stiffness of a shaft in N m/rad, and its size, as the table has them."""

    stiffness: str
    size: str


def _shafts(gearbox: Gearbox) -> list[_ShaftCells]:
    """The shafts, the input one first; free lengths as the head of the table says."""
    diameters, stages = gearbox.diameters, gearbox.stages
    widths = [option.gear["pinion"]["face_width_mm"] for option in stages]
    between = [
        0.5 * (before + after) + diameter
        for (before, after), diameter in zip(
            pairwise(widths), diameters[1:-1], strict=True
        )
    ]
    first = widths[0] + 1.5 * diameters[0]
    last = widths[-1] + 1.5 * diameters[-1]
    modulus = stages[0].machine.material.shear_modulus
    return [
        _ShaftCells(
            stiffness=short_text(torsional_stiffness(modulus, diameter, length)),
            size=f"shaft {diameter:g} mm thick and {length:.3g} mm long",
        )
        for diameter, length in zip(diameters, [first, *between, last], strict=True)
    ]


def torsional_stiffness(
    shear_modulus: float, diameter_mm: float, length_mm: float
) -> float:
    """Stiffness of a round shaft in torsion, G pi d^4 / (32 L), N m/rad; G in Pa."""
    diameter, length = 1e-3 * diameter_mm, 1e-3 * length_mm
    return shear_modulus * math.pi * diameter**4 / (32.0 * length)


def _table(head: Sequence[str], columns: Sequence[str], rows: Sequence[Row]) -> str:
    """A table as text: remarks, column names, rows."""
    remarks = [f"# {line}" for text in head for line in textwrap.wrap(text, HEAD_WIDTH)]
    stream = io.StringIO()
    write_records(stream, columns, rows)
    return "\n".join(remarks) + "\n" + stream.getvalue()
