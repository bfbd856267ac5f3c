"""A line at rest: its meshes carry the set torques, on the flanks that these press together."""

from dataclasses import replace

import numpy as np
import pytest
from lane_tools import law_of, on_any_bodies
from numpy.testing import assert_allclose

from gensig.dynamics.motion.at_rest import at_rest as found_at_rest
from gensig.operation.options import read_operating
from gensig.plan.make import make_plan
from gensig.plan.request import read_request
from gensig.record.inputs import InputReader

FEW = "plan.n_records=5", "plan.n_units=5"
RAMPS = (
    "operating.speed_profile=[[-0.4,0.4],[0.4,1.6]]",
    "operating.torque_profile=[[-0.4,0.6],[0.4,1.4]]",
)
LINES = {
    "spur": ("experiment=two_stage",),
    "changing speed and torque": ("experiment=two_stage", *RAMPS),
    "helical": ("system=phm09_helical_two_stage", "plan.classes=[missing_tooth]"),
}


@pytest.fixture(scope="module", params=LINES)
def line(request):
    """One of the lines, its gears with the errors of their grade."""
    config = read_request([*LINES[request.param], *FEW]).config
    record = make_plan(config).record(3)
    run = InputReader(config).inputs(record).run
    return run.system.ready(run).dynamics


def at_rest(dynamics, system, force):
    """The deflection of the line, or one like it, under forces at time 0."""
    mean, scale = dynamics.reference_force, dynamics.mesh_stiffness
    return found_at_rest(system, mean, scale, 0.0, force)


def test_the_teeth_carry_what_the_springs_do_not(line):
    """By the mesh law of the compiled core."""
    force, system = still_forces(line), line.system
    still = at_rest(line, system, force)
    carried = force - system.governed_stiffness @ still
    loads = loads_of(system, carried)
    operating = read_operating(read_request([]).config.section("operating"))
    for mesh, load, usual in zip(
        system.meshes, loads, line.reference_force, strict=True
    ):
        teeth = mesh.teeth
        radius = teeth.pair.pinion.base_radius
        roll = teeth.start_roll + radius * still[mesh.turn]
        law = law_of(on_any_bodies(teeth, usual, operating).dynamics)
        found = law(roll, mesh.approach(still), 0.0, 0.0)[0]
        assert_allclose(found, load, rtol=1e-4)
        assert load > 0.5 * usual


def loads_of(system, carried):
    """Mesh forces that make up forces on the degrees of freedom."""
    reach = np.stack([mesh.push(len(carried)) for mesh in system.meshes])
    loads = np.linalg.lstsq(reach.T, carried, rcond=None)[0]
    assert_allclose(reach.T @ loads, carried, atol=1e-6 * np.abs(loads).max())
    return loads


def still_forces(line):
    """The torques at time 0, where those that change are the set ones, without friction."""
    return line.forces(np.zeros(1))[0] - line.friction_torque


def test_a_free_line_is_at_rest_in_the_motion_that_nothing_balances(line):
    free = replace(line.system, held=np.zeros_like(line.system.held))
    force = still_forces(line)
    force[0] += 5.0  # N m more than the load takes
    deflection = at_rest(line, free, force)
    rigid = free.mass * free.rotation
    share = (force @ free.rotation) / (rigid @ free.rotation)
    pushed = force - share * rigid - free.stiffness @ deflection
    assert (loads_of(free, pushed) > 0.0).all()
