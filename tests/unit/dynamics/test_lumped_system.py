"""Linear part of the equations of motion."""

from dataclasses import replace

import numba
import numpy as np
import pytest
from closeness import assert_close
from lane_tools import BRIEF, laws, motion_of, right_hand_side

from gensig.dynamics._vector import LANES
from gensig.dynamics.backends.nystroem.machine_lanes import pack
from gensig.dynamics.bodies import HOUSING, Bodies, Motion, Spring
from gensig.dynamics.equations import Equations
from gensig.errors import SimulationError

OSCILLATOR = Bodies(
    motions=(Motion("a", 2.0), Motion("b", 3.0)),
    springs=(Spring(0, HOUSING, 50.0, 4.0), Spring(0, 1, 0.0, 0.0)),
)
SOFT = {
    "gear.pinion.support.stiffness_x_n_per_m": 0.0,
    "gear.wheel.support.damping_y_ns_per_m": 0.0,
}
STIFF = {
    "gear.pinion.support.stiffness_x_n_per_m": 9e5,
    "operating.torque_nm": 31.0,
}
ROTORS = {
    "system.motor.inertia_kg_m2": 2e-3,
    "system.load.inertia_kg_m2": 5e-2,
}
LIGHT = {
    **ROTORS,
    "system.motor.coupling_stiffness_nm_per_rad": 500,
    "system.load.coupling_damping_ratio": 0.2,
}


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        (
            {"motions": (Motion("a", 1.0), Motion("b", 0.0))},
            "mass or inertia of 'b' must be positive",
        ),
        ({"springs": (Spring(0, 1, -1.0, 0.0),)}, "spring of 'a' would feed energy in"),
        ({"springs": (Spring(1, HOUSING, 1.0, -1.0),)}, "'b' .* damping -1"),
        ({"springs": (Spring(1, 0, np.nan, 0.0),)}, "stiffness nan"),
        ({"springs": (Spring(1, 0, 1.0, np.nan),)}, "damping nan"),
    ],
)
def test_impossible_bodies_are_refused(changes, text):
    with pytest.raises(SimulationError, match=text):
        replace(OSCILLATOR, **changes)


def test_a_spring_acts_on_both_ends_and_the_housing_stands_still():
    between = Spring(0, 1, 7.0, 0.5, loss=0.2)
    bodies = replace(OSCILLATOR, springs=(*OSCILLATOR.springs, between))
    assert bodies.stiffness.tolist() == [[57.0, -7.0], [-7.0, 7.0]]
    assert bodies.damping.tolist() == [[4.5, -0.5], [-0.5, 0.5]]
    assert bodies.loss.tolist() == [[0.2, -0.2], [-0.2, 0.2]]


def test_rates_of_an_oscillator():
    """The body that is held decays with 1/s and swings at 5 rad/s; the other turns freely."""
    oscillator = Equations(
        mass=OSCILLATOR.mass,
        stiffness=OSCILLATOR.stiffness,
        damping=OSCILLATOR.damping,
        rotation=np.zeros(2),
        held=np.zeros(2),
        held_damping=0.0,
        meshes=(),
        sources=(),
        reference=1,
        angles=(1,),
    )
    rates = oscillator.rates(np.zeros(0))
    turning = rates[np.imag(rates) > 0.0]
    assert_close(turning, [-1.0 + 1j * np.sqrt(24.0)], 1e-9)
    assert (rates == 0.0).sum() == 2


@pytest.mark.parametrize(
    "kinds",
    [(SOFT, {}, STIFF), (ROTORS, LIGHT, {**STIFF, **ROTORS})],
    ids=["pair", "rotors"],
)
@pytest.mark.parametrize("name", ["stiffness", "damping"])
def test_a_group_holds_the_matrices_of_each_machine(machine, dynamics_of, kinds, name):
    """Also where a machine lacks an entry of its neighbour; empty lanes repeat the first."""
    machines = [dynamics_of(machine(changes)) for changes in kinds]
    group = pack(machines, 1e-6)
    n = len(machines[0].dofs)

    row, column = group.coupled.reshape(-1, 2).T
    assert len(row) == {6: 0, 8: 2}[n]

    diagonal = getattr(group, name)
    others = {"stiffness": group.sprung, "damping": group.damped}[name]
    for lane, running in enumerate([*machines, machines[0]]):
        matrix = np.diag(diagonal[lane::LANES])
        matrix[row, column] = matrix[column, row] = others[lane::LANES]
        held = group.held[lane::LANES]
        slowed = {"stiffness": 1.0, "damping": group.held_damping[lane]}[name]
        matrix += slowed * np.outer(held, held)
        assert_close(matrix, getattr(running.equations, f"governed_{name}"), 1e-15)


def test_one_compiled_program_takes_every_machine(machine, dynamics_of):
    """Arrays of another layout would be compiled anew, for most of a minute."""
    course = {"operating.speed_profile": [[0, 1], [1, 2]]}
    groups = [pack([dynamics_of(machine(each))], 1e-6) for each in ({}, ROTORS, course)]
    assert len({numba.typeof(group) for group in groups}) == 1


@pytest.mark.parametrize(
    "time",
    [0.0, (10**8 + 6) * BRIEF],
    ids=["recentred", "as_it_is"],
)
@pytest.mark.parametrize(
    "changes",
    [{}, ROTORS, LIGHT],
    ids=["pair", "rotors", "light"],
)
def test_the_compiled_right_hand_side_is_that_of_the_matrices(
    machine, running_of, changes, time
):
    """M q'' = f - K q - C v + mesh forces, also in a step that recentres the rotations."""
    running = running_of(machine(changes))
    rng = np.random.default_rng(6)
    system = running.equations
    n = len(running.dofs)
    pinion, wheel = (gear.base_radius for gear in running.table.pair.gears.values())
    for _ in range(10):
        q = rng.uniform(0.8, 1.5) * running.dynamics.static_start(0.0)
        q += 1e-3 * rng.standard_normal() * system.rotation
        q[[0, 3]] += 1e-5 * rng.standard_normal(2)
        q[6:] += 1e-4 * rng.standard_normal(n - 6)
        v = 1e-3 * rng.standard_normal(n) + rng.standard_normal() * system.rotation

        (law,) = laws(running, motion_of(running, time, q, v))
        normal, friction, moment_p, moment_w, along = law[:5]
        mesh = np.zeros(n)
        mesh[:3] = (
            friction,
            normal,
            pinion * (along - normal) + moment_p,
        )
        mesh[3:6] = (
            -friction,
            -normal,
            wheel * normal + moment_w,
        )
        held = system.governed_stiffness @ q + system.governed_damping @ v
        expected = running.dynamics.forces(np.zeros(1))[0] - held + mesh

        force = system.mass * right_hand_side(running, time, q, v)
        stiff = np.abs(system.governed_stiffness) @ np.abs(q)
        terms = np.abs(running.dynamics.forces(np.zeros(1))[0]) + stiff + np.abs(mesh)
        assert normal > 0
        assert_close(force / terms, expected / terms, atol=1e-9)
