"""The linear frequency response against one degree of freedom, and against the motion in time."""

from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close

from gensig.dynamics.pair import PINION_ROTATION, PINION_X, Rotor
from gensig.dynamics.response import accelerations, natural_frequencies

ROTORS = {
    "motor": Rotor(
        inertia=2e-3,
        coupling_stiffness=3e3,
        coupling_damping_ratio=0.05,
    ),
    "load": Rotor(
        inertia=8e-2,
        coupling_stiffness=1e4,
        coupling_damping_ratio=0.03,
    ),
}


def responses(running, frequencies, dof):
    """Accelerations (line, dof) under a unit force on one degree of freedom."""
    force = np.zeros((len(frequencies), len(running.dofs)), dtype=complex)
    force[:, dof] = 1.0
    return accelerations(running.dynamics, np.array(frequencies), force)


def test_across_the_line_of_action_a_gear_is_one_mass_on_its_support(
    xiamen, running_of
):
    w = np.array([10.0, 1e3, 1e5])
    body = xiamen.pinion
    response = responses(running_of(xiamen), w, PINION_X)
    stiffness = body.support.stiffness_x
    damping = body.support.damping_x
    expected = -(w**2) / (stiffness - w**2 * body.mass + 1j * w * damping)

    assert_close(response[:, PINION_X], expected, 1e-9)
    assert np.all(np.delete(response, PINION_X, axis=1) == 0.0)


@pytest.mark.parametrize("rotors", [{}, ROTORS], ids=["pair", "motor and load"])
@pytest.mark.parametrize("name", ["pinion_y", "wheel_rotation"])
def test_it_solves_the_equations_of_motion(xiamen, running_of, rotors, name):
    """M x'' + C x' + K x = F with the mesh as a spring and a damper."""
    running = replace(running_of(xiamen), **rotors)
    system = running.equations
    direction = running.approach_direction()
    dof = running.dofs.index(name)
    w = 2.0 * np.pi * 240.0

    acceleration = responses(running, [w], dof)[0]

    speed = acceleration / (1j * w)
    moved = speed / (1j * w)
    mesh = running.mean_mesh_stiffness * moved + running.mesh_damping * speed
    held = system.governed_stiffness @ moved + system.governed_damping @ speed
    force = system.mass * acceleration + held + direction * (direction @ mesh)

    assert_close(force, np.eye(len(force))[dof], atol=1e-9)


def test_a_machine_resonates_at_its_natural_frequencies(xiamen, running_of):
    """Displacement under a force on the pinion, at modes of little damping."""
    running = running_of(xiamen)
    frequency, damping = natural_frequencies(running.dynamics)
    assert np.all(np.diff(frequency) > 0.0)
    assert np.all((damping > 0.0) & (damping < 1.0))
    light = [w for w, ratio in zip(frequency, damping, strict=True) if ratio < 0.2]
    assert light
    for natural in light:
        grid = 2.0 * np.pi * natural * np.linspace(0.8, 1.2, 401)
        answer = np.abs(responses(running, grid, PINION_ROTATION))[:, PINION_ROTATION]
        highest = grid[(answer / grid**2).argmax()] / (2.0 * np.pi)
        assert_close(highest, natural, 0.05)
