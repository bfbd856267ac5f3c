"""A drive line as nodes, shafts and meshes: what it derives, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refused

from gensig.driveline.linear.matrices import line_matrices
from gensig.driveline.linear.shaft_line import (
    GearMesh,
    LineGear,
    Node,
    Shaft,
    ShaftLine,
)
from gensig.dynamics.pair import Support
from gensig.errors import ConfigError

SUPPORT = Support(stiffness_x=1e8, stiffness_y=2e8, damping_x=10.0, damping_y=20.0)


def gear(name: str, node: int, n_teeth: int, module: float = 2e-3) -> LineGear:
    return LineGear(
        name=name,
        node=node,
        n_teeth=n_teeth,
        base_radius=0.47 * module * n_teeth,
        mass=1.0,
        support=SUPPORT,
    )


def branched(**changes) -> ShaftLine:
    """Motor, pinion 20 that drives wheels 40 and 60, a rigid hub behind the first."""
    parts = {
        "nodes": tuple(
            Node(name=name, inertia=inertia)
            for name, inertia in (
                ("motor", 0.1),
                ("pinion", 1e-3),
                ("left", 5e-3),
                ("right", 8e-3),
                ("hub", 2e-3),
            )
        ),
        "shafts": (
            Shaft(first=0, second=1, stiffness=1e4, damping=0.3, loss_factor=0.05),
            Shaft(first=2, second=4, stiffness=1e9, rigid=True),
        ),
        "gears": (gear("p", 1, 20), gear("l", 2, 40), gear("r", 3, 60)),
        "meshes": (
            GearMesh(
                driving=0,
                driven=1,
                stiffness=3e8,
                loss_factor=0.1,
                pressure_angle=0.35,
                backlash=1e-4,
            ),
            GearMesh(
                driving=0, driven=2, stiffness=4e8, pressure_angle=0.35, center_line=2.0
            ),
        ),
    }
    return ShaftLine(**{**parts, **changes})


def test_speed_ratios_have_their_sign():
    assert_allclose(
        branched().speed_ratio, [1.0, 1.0, -0.5, -1.0 / 3.0, -0.5], rtol=1e-15
    )
    assert branched().parts == ((0, 1, 2, 3, 4),)
    assert branched().n_loops == 0


def test_an_idler_turns_the_other_way_and_does_not_change_the_ratio():
    line = ShaftLine(
        nodes=tuple(Node(name=name, inertia=1.0) for name in "abc"),
        gears=(gear("a", 0, 20), gear("b", 1, 37), gear("c", 2, 40)),
        meshes=(
            GearMesh(driving=0, driven=1, stiffness=1.0),
            GearMesh(driving=1, driven=2, stiffness=1.0),
        ),
    )
    assert_allclose(line.speed_ratio, [1.0, -20 / 37, 0.5], rtol=1e-15)


def test_a_loop_that_turns_is_counted_and_one_that_locks_is_refused():
    nodes = tuple(Node(name=name, inertia=1.0) for name in ("in", "out"))
    meshes = (
        GearMesh(driving=0, driven=1, stiffness=1e8),
        GearMesh(driving=2, driven=3, stiffness=1e8, location="row 7"),
    )
    gears = (gear("a", 0, 20), gear("b", 1, 40), gear("c", 0, 30), gear("d", 1, 60))
    assert ShaftLine(nodes=nodes, gears=gears, meshes=meshes).n_loops == 1
    locks = r"row 7: this joint closes a loop that locks.* out at -0\.491803.*at -0\.5"
    with pytest.raises(ConfigError, match=locks):
        ShaftLine(nodes=nodes, gears=(*gears[:3], gear("d", 1, 61)), meshes=meshes)
    with refused("loop that locks"):  # three gears in a ring turn no way
        ShaftLine(
            nodes=(*nodes, Node(name="third", inertia=1.0)),
            gears=tuple(gear(str(place), place, 20) for place in range(3)),
            meshes=tuple(
                GearMesh(driving=a, driven=b, stiffness=1.0)
                for a, b in ((0, 1), (1, 2), (2, 0))
            ),
        )


def test_what_falls_apart_has_a_part_and_a_rigid_motion_each():
    line = branched(shafts=(branched().shafts[1],))
    assert line.parts == ((0,), (1, 2, 3, 4))
    matrices = line_matrices(line)
    assert matrices.rigid.shape == (2, 4)
    assert_allclose(
        matrices.whole_stiffness @ matrices.rigid.T,
        0.0,
        atol=1e-9 * np.abs(matrices.whole_stiffness).max(),
    )


def test_matrices_are_what_the_parts_say():
    matrices = line_matrices(branched(), merge_rigid=False)
    assert matrices.names == ("motor", "pinion", "left", "right", "hub")
    assert_allclose(np.diag(matrices.mass), [0.1, 1e-3, 5e-3, 8e-3, 2e-3], rtol=0)
    assert_allclose(
        matrices.stiffness[:2, :2], 1e4 * np.array([[1, -1], [-1, 1]]), rtol=0
    )
    assert_allclose(
        matrices.damping[:2, :2], 0.3 * np.array([[1, -1], [-1, 1]]), rtol=0
    )
    assert_allclose(
        matrices.loss_stiffness,
        0.05 * matrices.stiffness * (np.arange(5) < 2),
        rtol=0,
    )
    radius = 0.47 * 2e-3
    assert_allclose(
        matrices.directions,
        radius * np.array([[0, 20, -40, 0, 0], [0, 20, 0, -60, 0]]),
        rtol=1e-14,
    )
    assert_allclose(matrices.rigid, [[1, 1, 0.5, 1 / 3, 0.5]], rtol=1e-14)
    assert_allclose(matrices.backlash, [1e-4, 0.0], rtol=0)
    assert_allclose(
        matrices.mesh_mass[1],
        radius**-2 / (20**2 / 1e-3 + 60**2 / 8e-3),
        rtol=1e-12,
    )


def test_a_rigid_compound_is_one_disc_for_integration():
    matrices = line_matrices(branched())
    assert matrices.names == ("motor", "pinion", "left + hub", "right")
    assert_allclose(np.diag(matrices.mass), [0.1, 1e-3, 7e-3, 8e-3], rtol=1e-14)
    assert_allclose(matrices.expand @ [1, 2, 3, 4], [1, 2, 3, 4, 3], rtol=0)
    without = branched(
        shafts=(
            branched().shafts[0],
            Shaft(first=2, second=4, stiffness=None, rigid=True),
        )
    )
    assert len(line_matrices(without, merge_rigid=False).names) == 4


def test_three_nodes_in_a_row_of_rigid_shafts_become_one():
    rigid = tuple(
        Shaft(first=a, second=b, stiffness=None, rigid=True)
        for a, b in ((2, 3), (0, 1), (1, 2))
    )
    line = ShaftLine(
        nodes=tuple(Node(name=name, inertia=1.0) for name in "abcd"), shafts=rigid
    )
    assert line.compounds(merge_rigid=False) == ((0, 1, 2, 3),)


def test_lateral_motion_is_in_frames_along_the_first_mesh_of_a_gear():
    matrices = line_matrices(branched(), lateral=True)
    assert matrices.names[4:] == ("p x", "p y", "l x", "l y", "r x", "r y")
    one, other = matrices.directions[:, 4:]
    assert_allclose(one, [0, -1, 0, 1, 0, 0], atol=1e-15)
    # the second mesh is turned by 2 rad about the pinion and the right gear has its own frame
    assert_allclose(other, [np.sin(2.0), -np.cos(2.0), 0, 0, 0, 1], atol=1e-15)
    assert_allclose(matrices.coordinate_node, [0, 1, 2, 3, 4, 1, 1, 2, 2, 3, 3])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"nodes": ()}, "at least one node"),
        (
            {"shafts": (Shaft(first=0, second=9, stiffness=1.0),)},
            "there is no node 9, only 0..4",
        ),
        (
            {"meshes": (GearMesh(driving=0, driven=3, stiffness=1.0),)},
            "there is no gear 3",
        ),
        ({"gears": (gear("a", 7, 20),), "meshes": ()}, "a: there is no node 7"),
        ({"gears": (gear("a", 0, 20), gear("b", 0, 40))}, "turn with the same node"),
        (
            {"gears": (gear("a", 0, 20), gear("b", 1, 40, 3e-3), gear("c", 2, 40))},
            "not as their teeth, 20 and 40",
        ),
    ],
)
def test_what_joins_nothing_is_refused(changes, message):
    changes.setdefault("shafts", ())
    with refused(message):
        branched(**changes)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: Node(name="a", inertia=0.0, location="row 3"),
            "row 3: inertia 0 kg m2 must be positive",
        ),
        (lambda: Node(name="a", inertia=float("nan")), "a: inertia nan"),
        (lambda: Shaft(first=1, second=1, stiffness=1.0), "joins a node to itself"),
        (lambda: Shaft(first=0, second=1, stiffness=None), "no stiffness"),
        (
            lambda: Shaft(first=0, second=1, stiffness=-1.0),
            "stiffness -1 N m/rad must not be negative",
        ),
        (
            lambda: Shaft(first=0, second=1, stiffness=0.0),
            "neither stiffness nor damping",
        ),
        (
            lambda: Shaft(first=0, second=1, stiffness=1.0, damping=-1.0),
            "damping -1 must not be negative",
        ),
        (
            lambda: GearMesh(driving=0, driven=1, stiffness=0.0),
            "mesh stiffness 0 N/m must be positive",
        ),
        (
            lambda: GearMesh(driving=0, driven=1, stiffness=1.0, loss_factor=-0.1),
            "loss factor -0.1",
        ),
        (
            lambda: GearMesh(driving=0, driven=1, stiffness=1.0, backlash=-0.1),
            "backlash -0.1",
        ),
        (
            lambda: replace(gear("a", 0, 20), n_teeth=0),
            "a: teeth (0) and base radius",
        ),
        (lambda: replace(gear("a", 0, 20), mass=0.0), "a: mass 0 kg"),
    ],
)
def test_what_cannot_be_is_refused(make, message):
    with refused(message):
        make()


def test_lateral_motion_needs_mass_and_support():
    loose = (replace(gear("p", 1, 20), support=None), *branched().gears[1:])
    with refused("p: its lateral motion needs a mass and a support"):
        line_matrices(branched(gears=loose), lateral=True)
    soft = (
        replace(gear("p", 1, 20), support=replace(SUPPORT, stiffness_x=0.0)),
        *branched().gears[1:],
    )
    with refused("p: its support needs stiffness along both axes"):
        line_matrices(branched(gears=soft), lateral=True)
