"""The linear frequency response against one degree of freedom by hand, and against the motion in time."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lsim

from gensig.dynamics.pair import PINION_X, WHEEL_Y, Rotor
from gensig.dynamics.response import accelerations

ROTORS = {"motor": Rotor(inertia=2e-3, coupling_stiffness=3e3, coupling_damping_ratio=0.05),
          "load": Rotor(inertia=8e-2, coupling_stiffness=1e4, coupling_damping_ratio=0.03)}  # fmt: skip


def force_on(dynamics, dof, n_lines=1):
    force = np.zeros((n_lines, len(dynamics.dofs)), dtype=complex)
    force[:, dof] = 1.0
    return force


def test_across_the_line_of_action_a_gear_is_one_mass_on_its_support(
    xiamen, dynamics_of
):
    dynamics, w = dynamics_of(xiamen), np.array([10.0, 1e3, 1e5])
    found = accelerations(dynamics, w, force_on(dynamics, PINION_X, 3))
    body = xiamen.pinion
    by_hand = -(w**2) / (
        body.support.stiffness_x - w**2 * body.mass + 1j * w * body.support.damping_x
    )
    assert_allclose(found[:, PINION_X], by_hand, rtol=1e-9, atol=0)
    assert np.all(np.delete(found, PINION_X, axis=1) == 0.0)


def test_far_above_every_mode_a_mass_is_free_and_far_below_the_support_is_a_spring(
    xiamen, dynamics_of
):
    dynamics, w = dynamics_of(xiamen), np.array([1e-3, 1e9])
    low, high = accelerations(dynamics, w, force_on(dynamics, WHEEL_Y, 2))[:, WHEEL_Y]
    assert_allclose(high, 1.0 / xiamen.wheel.mass, rtol=1e-3, atol=0)
    assert_allclose(
        low / w[0] ** 2, -1.0 / xiamen.wheel.support.stiffness_y, rtol=1e-3, atol=0
    )


@pytest.mark.parametrize("rotors", [{}, ROTORS], ids=["pair", "motor and load"])
@pytest.mark.parametrize("dof", ["pinion_y", "wheel_rotation"])
def test_the_motion_in_time_settles_to_it(xiamen, dynamics_of, rotors, dof):
    dynamics = replace(dynamics_of(xiamen), **rotors)
    system, direction, n = (
        dynamics.system(),
        dynamics.approach_direction(),
        len(dynamics.dofs),
    )
    mesh = np.outer(direction, direction)
    stiffness = system.stiffness + dynamics.mean_mesh_stiffness * mesh
    damping = system.damping + dynamics.mesh_damping * mesh
    place, w, step = dynamics.dofs.index(dof), 2.0 * np.pi * 240.0, 2e-6
    per_mass = 1.0 / system.mass[:, None]
    state = np.block(
        [[np.zeros((n, n)), np.eye(n)], [-per_mass * stiffness, -per_mass * damping]]
    )
    push = np.zeros((2 * n, 1))
    push[n + place] = 1.0 / system.mass[place]
    wanted = accelerations(dynamics, np.array([w]), force_on(dynamics, place))[0]
    still = np.linalg.solve(
        1j * w * np.eye(2 * n) - state, push[:, 0]
    )  # so that nothing has to settle
    times = np.arange(4000) * step
    force = np.cos(w * times)
    # an independent solution in time from that state on stays on it, for two periods
    _, _, motion = lsim(
        (state, push, np.eye(2 * n), np.zeros((2 * n, 1))), force, times, X0=still.real
    )
    found = (motion @ state[n:].T) + push[n:, 0] * force[:, None]
    expected = np.real(wanted * np.exp(1j * w * times)[:, None])
    assert_allclose(found, expected, rtol=0, atol=1e-4 * np.abs(expected).max())
    assert (
        np.abs(
            expected - np.real(1.05 * wanted * np.exp(1j * w * times)[:, None])
        ).max()
        > 1e-2 * np.abs(expected).max()
    )
