"""Rows of the tables of a drive line as its nodes, gears, shafts and meshes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from gensig.driveline.linear.shaft_line import (
    GearMesh,
    LineGear,
    Node,
    Shaft,
    ShaftLine,
)
from gensig.driveline.options import LineOptions, LossFactors
from gensig.driveline.shaft_tables import EDGE_KINDS, TableRow
from gensig.dynamics.pair import solid_disc
from gensig.errors import ConfigError, GensigError
from gensig.geometry.contact import GearPair
from gensig.geometry.gear import Gear
from gensig.material import Material
from gensig.mesh.iso6336 import mesh_stiffness
from gensig.mesh.modification import FlankModification

MOST_NODES_TOLD = 12  # in a message
RATIO_TOLERANCE = 1e-3  # relative, of a speed ratio that a table gives beside its teeth


def rows_of_nodes(shafting: list[TableRow]) -> dict[int, TableRow]:
    """Rows that hold a node, by its number, in the order of the table."""
    rows: dict[int, TableRow] = {}
    for row in shafting:
        number = row.whole("node")
        if number is None:
            if row.text("inertia"):
                raise ConfigError(
                    f"{row.location('node')}: it is empty, but the row has an inertia; "
                    "number the node"
                )
            continue
        if number in rows:
            raise ConfigError(
                f"{row.location('node')}: node {number} is there already, "
                f"in row {rows[number].line}"
            )
        rows[number] = row
    if not rows:
        raise ConfigError(
            f"{shafting[0].table}: there is no node; give each inertia a row with its number"
        )
    return rows


def node_of(
    row: TableRow,
    index: int,
    gears: list[LineGear],
    shapes: list[Gear],
    options: LineOptions,
    material: Material,
) -> Node:
    """A disc: its inertia as given, or of solid discs where it is empty and gears sit on it."""
    number = row.whole("node")
    inertia = row.positive("inertia")
    if inertia is None:
        shapes_on_node = [
            shape
            for gear, shape in zip(gears, shapes, strict=True)
            if gear.node == index
        ]
        if not shapes_on_node:
            remedy = "give one"
            if options.gears_csv is None:
                remedy = "give one, or system.gears_csv with its gear"
            raise ConfigError(
                f"{row.location('inertia')}: it is empty and node {number} has no gear "
                f"to derive it from; {remedy}"
            )
        inertia = sum(_disc(shape, material)[1] for shape in shapes_on_node)
    if number == options.viscous_damper_node:
        # Den Hartog, Mechanical Vibrations: at the best damping J + J_ring / 2 meets the fixed
        # point
        inertia *= 0.5
    return Node(
        name=row.text("name") or f"node {number}",
        inertia=inertia,
        location=row.location("inertia"),
    )


def _disc(gear: Gear, material: Material) -> tuple[float, float]:
    return solid_disc(
        gear.pitch_radius, gear.bore_radius, gear.face_width, material.density_kg_per_m3
    )


def gear_of(row: TableRow) -> Gear:
    """Geometry of one gear.

    What the table leaves out is an ISO 53 rack, no shift, a bore of half the pitch radius.
    """
    helix, module = (
        row.given(key, row.number(key)) for key in ("helix_angle", "normal_module")
    )
    n_teeth = round(row.given("n_teeth", row.whole("n_teeth")))
    row.given("face_width", row.positive("face_width"))
    if not module > 0.0 or not abs(helix) < 0.5 * math.pi:
        raise ConfigError(
            f"{row.location('normal_module')}: module must be positive, "
            "helix angle below 90 degrees"
        )
    defaults = {
        "profile_shift": 0.0,
        "addendum_coefficient": 1.0,
        "clearance_coefficient": 0.25,
        "cutter_tip_radius_coefficient": 0.38,
        "bore_radius": 0.25 * module * n_teeth / math.cos(helix),
    }
    given = {key: row.number(key) for key in defaults if row.text(key)}
    try:
        return Gear(
            name=row.text("name") or f"gear on node {row.text('node')}",
            n_teeth=n_teeth,
            normal_module=module,
            helix_angle=abs(helix),
            pressure_angle=row.given("pressure_angle", row.number("pressure_angle")),
            face_width=row.given("face_width", row.positive("face_width")),
            **defaults | given,  # type: ignore[arg-type]
        )
    except GensigError as error:
        raise row.error(error, f"{row.location()}: {error}") from None


def relief_of(row: TableRow) -> FlankModification:
    """Tip relief of both flanks of one gear; none where its cells are empty."""
    try:
        return FlankModification(
            tip_relief=row.not_negative("tip_relief", 0.0),
            tip_relief_height=row.not_negative("tip_relief_height", 0.0),
        )
    except GensigError as error:
        raise ConfigError(f"{row.location('tip_relief')}: {error}") from None


def line_gear(
    row: TableRow,
    shape: Gear,
    numbers: tuple[int, ...],
    options: LineOptions,
    material: Material,
) -> LineGear:
    """A gear on its node, with its mass (of a solid disc where it is empty), without a support."""
    number = round(row.given("node", row.whole("node")))
    if number not in numbers:
        raise ConfigError(
            f"{row.location('node')}: {options.shafting_csv} has no node {number}; "
            f"{_nodes(numbers)}"
        )
    mass = row.positive("mass") or _disc(shape, material)[0]
    return LineGear(
        name=shape.name,
        node=numbers.index(number),
        n_teeth=shape.n_teeth,
        base_radius=shape.base_radius,
        mass=mass,
    )


def _nodes(numbers: tuple[int, ...]) -> str:
    return f"the table has {told_nodes(numbers)}"


def told_nodes(numbers: tuple[int, ...]) -> str:
    """The nodes of a table, for a message: all of them, or the first and how many."""
    if len(numbers) <= MOST_NODES_TOLD:
        return ", ".join(map(str, numbers))
    return f"{len(numbers)} nodes, {min(numbers)} to {max(numbers)}"


def ends_of(row: TableRow, numbers: tuple[int, ...]) -> tuple[int, int] | None:
    """Numbers of the nodes that a row joins, None where it joins none."""
    ends = row.whole("edge_from"), row.whole("edge_to")
    kind = row.text("edge_kind")
    if ends == (None, None) and not kind:
        for column in ("stiffness", "mesh_stiffness"):
            if row.text(column):
                raise ConfigError(
                    f"{row.location(column)}: a stiffness without edge_from, edge_to and edge_kind"
                )
        return None
    if kind not in EDGE_KINDS:
        raise ConfigError(
            f"{row.location('edge_kind')}: '{kind}'; allowed: {', '.join(EDGE_KINDS)}"
        )
    first, second = (
        round(row.given(key, end))
        for key, end in zip(("edge_from", "edge_to"), ends, strict=True)
    )
    for column, number in (("edge_from", first), ("edge_to", second)):
        if number not in numbers:
            raise ConfigError(
                f"{row.location(column)}: there is no node {number}; {_nodes(numbers)}"
            )
    if first == second:
        raise ConfigError(
            f"{row.location('edge_to')}: node {first} is joined to itself"
        )
    return numbers.index(first), numbers.index(second)


def shaft_of(row: TableRow, ends: tuple[int, int], losses: LossFactors) -> Shaft:
    """A joint of two nodes of one speed: a shaft, a coupling or a rigid compound."""
    kind = row.text("edge_kind")
    for column in ("teeth_from", "teeth_to", "mesh_stiffness", "backlash"):
        if row.text(column):
            raise ConfigError(
                f"{row.location(column)}: that is of a gear_mesh, and edge_kind is {kind}"
            )
    stiffness = row.positive("stiffness")
    if kind != "rigid":
        row.given("stiffness", stiffness)
    usual = {"shaft": losses.shaft, "coupling": losses.coupling, "rigid": 0.0}[kind]
    return Shaft(
        first=ends[0],
        second=ends[1],
        stiffness=stiffness,
        rigid=kind == "rigid",
        damping=row.not_negative("damping", 0.0),
        loss_factor=row.not_negative("loss_factor", usual),
        location=row.location("edge_to"),
    )


def mesh_of(
    row: TableRow,
    ends: tuple[int, int],
    numbers: tuple[int, ...],
    gears: list[LineGear],
    shapes: list[Gear],
    options: LineOptions,
) -> tuple[GearPair, GearMesh]:
    """Two gears in mesh.

    A torsional stiffness k stands for k / (r_b1 r_b2) along the line of action.
    """
    driving, driven = (
        _gear_at(row, node, numbers[node], end, gears, options)
        for node, end in zip(ends, ("from", "to"), strict=True)
    )
    backlash = row.not_negative("backlash", options.backlash)
    _check_fit(row, shapes[driving], shapes[driven])
    try:
        wheel = replace(shapes[driven], helix_angle=-shapes[driven].helix_angle)
        pair = GearPair(pinion=shapes[driving], wheel=wheel, backlash=backlash)
        stiffness = _mesh_stiffness(row, pair)
    except GensigError as error:
        names = f"{gears[driving].name} and {gears[driven].name}"
        raise row.error(error, f"{row.location('edge_to')}: {names}: {error}") from None
    if row.text("damping"):
        raise ConfigError(
            f"{row.location('damping')}: torsional damping is of shafts; a gear_mesh has "
            "its loss_factor"
        )
    return pair, GearMesh(
        driving=driving,
        driven=driven,
        stiffness=stiffness,
        loss_factor=row.not_negative("loss_factor", options.loss_factor.gear_mesh),
        backlash=backlash,
        center_line=row.number("center_line") or 0.0,
        pressure_angle=pair.working_pressure_angle,
        location=row.location("edge_to"),
    )


def _check_fit(row: TableRow, driving: Gear, driven: Gear) -> None:
    """Raise for two gears of unlike teeth, with the sizes of both as the gears table has them."""
    sizes = {
        "normal_module_mm": (1e3 * driving.normal_module, 1e3 * driven.normal_module),
        "pressure_angle_deg": _degrees(driving.pressure_angle, driven.pressure_angle),
        "helix_angle_deg": _degrees(driving.helix_angle, driven.helix_angle),
    }
    unlike = [
        f"{name} {first:g} and {second:g}"
        for name, (first, second) in sizes.items()
        if not math.isclose(first, second, rel_tol=1e-9, abs_tol=1e-9)
    ]
    if unlike:
        raise ConfigError(
            f"{row.location('edge_to')}: {driving.name} and {driven.name} cannot mesh: they "
            f"have {', '.join(unlike)}; give both the same, or join other nodes"
        )


def _degrees(*angles: float) -> tuple[float, ...]:
    return tuple(map(math.degrees, angles))


def _mesh_stiffness(row: TableRow, pair: GearPair) -> float:
    """As the table has it, N/m; by ISO 6336-1, Method B, where it has none."""
    torsional, linear = row.positive("stiffness"), row.positive("mesh_stiffness")
    if torsional is not None and linear is not None:
        raise ConfigError(
            f"{row.location('mesh_stiffness')}: the row has a torsional stiffness too; "
            "give one of them"
        )
    if torsional is not None:
        return torsional / (pair.pinion.base_radius * pair.wheel.base_radius)
    if linear is not None:
        return linear
    if (
        pair.pinion.n_teeth > pair.wheel.n_teeth
    ):  # the standard's gear 1 is the smaller one, whichever drives
        pair = replace(pair, pinion=pair.wheel, wheel=pair.pinion)
    return mesh_stiffness(pair) * pair.face_width


def _gear_at(
    row: TableRow,
    node: int,
    number: int,
    end: str,
    gears: list[LineGear],
    options: LineOptions,
) -> int:
    """Index of the gear on a node that the row means.

    ConfigError where the tables contradict each other.
    """
    n_teeth = row.whole(f"teeth_{end}")
    candidates = [index for index, gear in enumerate(gears) if gear.node == node]
    if options.gears_csv is None:
        raise ConfigError(
            f"{row.location('edge_kind')}: gear_mesh needs a table of gears; give system.gears_csv"
        )
    if not candidates:
        raise ConfigError(
            f"{row.location(f'edge_{end}')}: system.gears_csv = {options.gears_csv} has "
            f"no gear on node {number}"
        )
    matching = [
        index for index in candidates if n_teeth in (None, gears[index].n_teeth)
    ]
    if not matching:
        has = ", ".join(
            f"{gears[index].name} with {gears[index].n_teeth}" for index in candidates
        )
        raise ConfigError(
            f"{row.location(f'teeth_{end}')}: {n_teeth}, but on node {number} the gears "
            f"table has {has} teeth"
        )
    if len(matching) > 1:
        raise ConfigError(
            f"{row.location(f'teeth_{end}')}: node {number} has {len(matching)} such gears; "
            "say which by teeth"
        )
    return matching[0]


def check_gears_in_mesh(rows: list[TableRow], line: ShaftLine) -> None:
    """Raise for a gear that no row of the line puts in mesh."""
    meshing = {index for mesh in line.meshes for index in (mesh.driving, mesh.driven)}
    for index, row in enumerate(rows):
        if index not in meshing:
            raise ConfigError(
                f"{row.location('node')}: {line.gears[index].name} meshes with nothing; "
                "leave it out"
            )


def check_whole(
    rows: list[TableRow], numbers: tuple[int, ...], line: ShaftLine
) -> None:
    """Raise for a line that falls apart, and for speed ratios that the teeth contradict."""
    if len(line.parts) > 1:
        lost = line.parts[1]
        named = ", ".join(
            [str(numbers[node]) for node in lost[:5]] + ["..."] * (len(lost) > 5)
        )
        plural = "s" * (len(lost) > 1)
        raise ConfigError(
            f"{rows[lost[0]].location('edge_from')}: nothing joins "
            f"node{plural} {named} to node "
            f"{numbers[0]}: the line falls into {len(line.parts)} parts with a rigid "
            "mode each; join them"
        )
    for row, number, ratio in zip(rows, numbers, np.abs(line.speed_ratio), strict=True):
        given = row.positive("speed_ratio")
        if given is not None and not math.isclose(
            given, ratio, rel_tol=RATIO_TOLERANCE
        ):
            raise ConfigError(
                f"{row.location('speed_ratio')}: {given:g} contradicts the tooth counts, "
                f"by which node {number} turns at "
                f"{ratio:.6g} of node {numbers[0]}"
            )


def motor_and_load(
    line: ShaftLine, numbers: tuple[int, ...], options: LineOptions
) -> tuple[int | None, int | None]:
    """Numbers of the nodes of a motor and its load: as given, or the ends of the line.

    A line without branches has two ends. The first node, if it is one, takes the motor; the other
    end takes the load. None where a branched line leaves them open.
    """
    motor, load = options.motor_node, options.load_node
    ends = [
        number for number in line_ends(line, numbers) if number not in (motor, load)
    ]
    if motor is None and numbers[0] in ends:
        motor = numbers[0]
        ends.remove(motor)
    if load is None and motor is not None and len(ends) == 1:
        load = ends[0]
    return motor, load


def line_ends(line: ShaftLine, numbers: tuple[int, ...]) -> tuple[int, ...]:
    """Numbers of the nodes that are joined to one other only, in the order of the table."""
    joined: list[set[int]] = [set() for _ in numbers]
    joints = [(shaft.first, shaft.second) for shaft in line.shafts]
    joints += [
        (line.gears[mesh.driving].node, line.gears[mesh.driven].node)
        for mesh in line.meshes
    ]
    for first, second in joints:
        joined[first].add(second)
        joined[second].add(first)
    return tuple(
        number for number, mates in zip(numbers, joined, strict=True) if len(mates) == 1
    )
