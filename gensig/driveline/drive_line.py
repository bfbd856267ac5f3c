"""A drive line from two tables, or from a single pair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from gensig.driveline.linear.dampers import with_dampers
from gensig.driveline.linear.matrices import LineMatrices, line_matrices
from gensig.driveline.linear.modal import Modes, natural_modes
from gensig.driveline.linear.shaft_line import (
    GearMesh,
    LineGear,
    Node,
    Shaft,
    ShaftLine,
)
from gensig.driveline.options import Campbell, GearHolding, LineOptions, read_options
from gensig.driveline.shaft_tables import (
    TableRow,
    read_gears,
    read_shafting,
    shipped_tables,
    text_of,
)
from gensig.driveline.table_rows import (
    check_gears_in_mesh,
    check_whole,
    ends_of,
    gear_of,
    line_gear,
    mesh_of,
    motor_and_load,
    node_of,
    relief_of,
    rows_of_nodes,
    shaft_of,
)
from gensig.dynamics.pair import Rotor
from gensig.errors import ConfigError
from gensig.geometry.contact import SIDES, GearPair
from gensig.geometry.gear import Gear
from gensig.material import Material
from gensig.mesh.modification import PLAIN, FlankModification, PairModification
from gensig.options.configuration import Configuration
from gensig.systems.pair_machine import GearPairMachine, running_pair
from gensig.systems.registry import read_material
from gensig.systems.run import Run


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveLine:
    """A line with what its tables say beyond its matrices.

    ``numbers`` (node,) as the table counts them, rings of dampers on from there; ``pairs``
    (mesh,) the driving gear as pinion; ``record_mesh`` the numbers of the nodes whose mesh
    records are made of, None for the first; ``slices_helical`` whether helical meshes in time are
    sliced teeth; ``motor_node``, ``load_node`` those of a motor and its load, None where a branched
    line leaves them open; ``support_forces`` (gear,) N are those for which the supports of the
    gears are taken, empty without lateral motion; ``reliefs`` (gear,) the tip reliefs of the
    table, empty where it has none.
    """

    name: str
    line: ShaftLine
    numbers: tuple[int, ...]
    pairs: tuple[GearPair, ...]
    lateral: bool
    campbell: Campbell
    record_mesh: tuple[int, ...] | None = None
    slices_helical: bool = False
    motor_node: int | None = None
    load_node: int | None = None
    support_forces: tuple[float, ...] = ()
    reliefs: tuple[FlankModification, ...] = ()

    def relief(self, mesh: int) -> PairModification:
        """Tip reliefs of the two gears of a mesh by the table, the driving gear as pinion."""
        if not self.reliefs:
            return PLAIN
        ends = self.line.meshes[mesh]
        return PairModification(
            pinion=self.reliefs[ends.driving], wheel=self.reliefs[ends.driven]
        )

    def matrices(self, *, merge_rigid: bool = False) -> LineMatrices:
        """Mass, damping and stiffness, the meshes apart.

        Merged for integration, as the table has them for modes.
        """
        return line_matrices(self.line, merge_rigid=merge_rigid, lateral=self.lateral)

    def modes(self) -> Modes:
        """Natural modes with every mesh at its stiffness."""
        return natural_modes(self.matrices())

    @property
    def mesh_orders(self) -> tuple[float, ...]:
        """Tooth meshing frequency of every mesh over the speed of the first node, (mesh,)."""
        speed = np.abs(self.line.speed_ratio)
        gears = self.line.gears
        return tuple(
            float(speed[gears[mesh.driving].node] * gears[mesh.driving].n_teeth)
            for mesh in self.line.meshes
        )

    @property
    def campbell_orders(self) -> tuple[float, ...]:
        """Orders of the Campbell diagram.

        As given, or the turn, its double, every mesh and its double.
        """
        if self.campbell.orders is not None:
            return self.campbell.orders
        orders = 1.0, *self.mesh_orders
        return tuple(sorted({*orders, *(2.0 * order for order in orders)}))


def read_drive_line(config: Configuration) -> DriveLine:
    """Build the drive line of a configuration from its tables.

    Raises
    ------
    ConfigError    with file, row and column, for tables that make no machine
    """
    options = read_options(config.section("system"))
    if options.shafting_csv is None:
        raise ConfigError(
            "system.shafting_csv is required: give system.shafting_csv=FILE and "
            "system.gears_csv=FILE, your own (docs/howto/your_drive_line.md; gensig new gearbox "
            "writes both) or two of "
            f"{', '.join(shipped_tables())}"
        )
    files = ("shafting_csv", options.shafting_csv), ("gears_csv", options.gears_csv)
    texts = [text_of(f"system.{key}", file) for key, file in files if file is not None]
    material = read_material(config.section("material"))
    return _line_of_tables(options, material, tuple(texts))


@lru_cache(maxsize=16)
def _line_of_tables(
    options: LineOptions, material: Material, texts: tuple[str, ...]
) -> DriveLine:
    """The line of options and their files, which are read anew when their ``texts`` change."""
    assert options.shafting_csv is not None
    shafting = read_shafting("system.shafting_csv", options.shafting_csv)
    gear_rows = []
    if options.gears_csv is not None:
        gear_rows = read_gears("system.gears_csv", options.gears_csv)
    node_rows = rows_of_nodes(shafting)
    numbers = tuple(node_rows)
    if options.viscous_damper_node not in (None, *numbers):
        raise ConfigError(
            f"system.viscous_damper_node = {options.viscous_damper_node}: "
            f"{options.shafting_csv} has no such node"
        )
    shapes = [gear_of(row) for row in gear_rows]
    gears = [
        line_gear(row, shape, numbers, options, material)
        for row, shape in zip(gear_rows, shapes, strict=True)
    ]
    nodes = tuple(
        node_of(row, index, gears, shapes, options, material)
        for index, row in enumerate(node_rows.values())
    )
    shafts, meshes, pairs = _joints(shafting, numbers, gears, shapes, options)
    line = ShaftLine(
        nodes=nodes, shafts=tuple(shafts), gears=tuple(gears), meshes=tuple(meshes)
    )
    check_gears_in_mesh(gear_rows, line)
    check_whole(list(node_rows.values()), numbers, line)
    forces: tuple[float, ...] = ()
    if options.lateral:
        forces = _support_forces(line, options.support)
        line = _on_supports(line, forces, options.support, material)
    motor_node, load_node = motor_and_load(line, numbers, options)
    line, numbers = with_dampers(line, numbers, options.dampers)
    return DriveLine(
        name=options.name,
        line=line,
        numbers=numbers,
        pairs=tuple(pairs),
        lateral=bool(options.lateral),
        campbell=options.campbell,
        record_mesh=options.record_mesh,
        slices_helical=options.helical_meshes == "sliced",
        motor_node=motor_node,
        load_node=load_node,
        support_forces=forces,
        reliefs=tuple(relief_of(row) for row in gear_rows),
    )


def _support_forces(line: ShaftLine, holding: GearHolding) -> tuple[float, ...]:
    """Static force of every gear on its support, (gear,) N."""
    ratios = line.speed_ratio
    return tuple(
        holding.force_on(gear.base_radius, float(ratios[gear.node]))
        for gear in line.gears
    )


def _on_supports(
    line: ShaftLine,
    forces: Sequence[float],
    holding: GearHolding,
    material: Material,
) -> ShaftLine:
    """The line with its gears on supports for such forces, (gear,) N."""
    gears = []
    for gear, force in zip(line.gears, forces, strict=True):
        assert gear.mass is not None
        support = holding.for_gear(gear.mass, force, material)
        gears.append(replace(gear, support=support))
    return replace(line, gears=tuple(gears))


def _joints(
    shafting: list[TableRow],
    numbers: tuple[int, ...],
    gears: list[LineGear],
    shapes: list[Gear],
    options: LineOptions,
) -> tuple[list[Shaft], list[GearMesh], list[GearPair]]:
    """Shafts, meshes and gear pairs of the rows that join two nodes."""
    shafts, meshes, pairs = [], [], []
    for row in shafting:
        ends = ends_of(row, numbers)
        if ends is None:
            continue
        if row.text("edge_kind") == "gear_mesh":
            pair, mesh = mesh_of(row, ends, numbers, gears, shapes, options)
            pairs.append(pair)
            meshes.append(mesh)
        else:
            shafts.append(shaft_of(row, ends, options.loss_factor))
    return shafts, meshes, pairs


def drive_line_of_pair(system: GearPairMachine, name: str) -> DriveLine:
    """A single pair, with its motor and load, as a line of two to four nodes.

    Without the soft drive.
    The mesh is held at the mean stiffness of healthy teeth under the set torque.
    """
    running = running_pair(Run(system=system))
    pair = system.pair
    bodies, rotors = (running.pinion, running.wheel), (system.motor, system.load)
    sides = tuple(zip(SIDES, pair.gears.values(), bodies, rotors, strict=True))
    nodes = [Node(name=side, inertia=body.inertia) for side, _, body, _ in sides]
    gears = [
        LineGear(
            name=side,
            node=index,
            n_teeth=gear.n_teeth,
            base_radius=gear.base_radius,
            mass=body.mass,
            support=body.support,
        )
        for index, (side, gear, body, _) in enumerate(sides)
    ]
    shafts = []
    for index, (rotor_name, (_, _, body, rotor)) in enumerate(
        zip(("motor", "load"), sides, strict=True)
    ):
        if rotor is not None:
            shafts.append(_coupling(rotor, index, len(nodes), body.inertia))
            nodes.append(Node(name=rotor_name, inertia=rotor.inertia))
    mesh = GearMesh(
        driving=0,
        driven=1,
        stiffness=running.mean_mesh_stiffness,
        damping=running.mesh_damping,
        backlash=pair.backlash,
        pressure_angle=pair.working_pressure_angle,
    )
    n_teeth = pair.pinion.n_teeth
    return DriveLine(
        name=name,
        line=ShaftLine(
            nodes=tuple(nodes), shafts=tuple(shafts), gears=tuple(gears), meshes=(mesh,)
        ),
        numbers=tuple(range(1, len(nodes) + 1)),
        pairs=(pair,),
        lateral=True,
        campbell=Campbell(
            low_speed=0.0,
            high_speed=1.5 * system.operating.speed,
            orders=(1.0, *(float(n_teeth * harmonic) for harmonic in range(1, 5))),
        ),
    )


def _coupling(
    rotor: Rotor, gear_node: int, rotor_node: int, gear_inertia: float
) -> Shaft:
    return Shaft(
        first=gear_node,
        second=rotor_node,
        stiffness=rotor.coupling_stiffness,
        damping=rotor.coupling_damping(gear_inertia),
    )
