"""Forced vibration by orders: reciprocity, power, exact solutions, integration in time,
waterfalls.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from closeness import assert_close
from engine_cases import (
    RPM,
    SPEED,
    engine_line,
    option,
    ratios,
    response_of,
    torques_of,
)
from refusals import refused

from gensig.driveline.excitation.cycle import cycle_angles
from gensig.driveline.linear.forced import (
    Elements,
    closed_line,
    cycle_orders,
    disturbance_response,
    over_cycle,
    run_of_speeds,
    steady_response,
)
from gensig.dynamics.linear_system import LinearSystem
from gensig.errors import SimulationError

NODES = tuple(ratios())
N = 2880


def chain(loss_factor=0.0, damping=0.0, grounded=True):
    """Three discs on two shafts, the first on a third to ground."""
    used = slice(1 - grounded, None)
    directions = np.array([[1.0, 0, 0], [1, -1, 0], [0, 1, -1]])[used]
    stiffness = np.array([3e4, 2e4, 1e4])[used]
    springs = Elements(
        directions=directions,
        stiffness=stiffness,
        loss=loss_factor * stiffness,
    )
    line = LinearSystem(
        mass=np.diag([0.5, 0.3, 0.2]),
        stiffness=springs.stiffness_matrix(),
        loss=springs.loss_matrix(),
        damping=damping * springs.stiffness_matrix(),
    )
    return line, springs


def cycle_torque(seed=0, n_orders=12, n_dofs=3):
    parts = np.random.default_rng(seed).standard_normal((2, n_dofs, n_orders))
    amplitudes = parts[0] + 1j * parts[1]
    return over_cycle(amplitudes, N), amplitudes


def test_orders_of_a_torque_give_it_back():
    torque, amplitudes = cycle_torque()
    mean, computed = cycle_orders(torque + 3.0, 12)
    assert_close(mean, 3.0, 1e-12)
    assert_close(computed, amplitudes, 1e-9)

    angle = cycle_angles(N)
    by_hand = sum(
        np.real(c * np.exp(0.5j * k * angle))
        for k, c in enumerate(amplitudes[0], start=1)
    )
    assert_close(torque[0], by_hand, atol=1e-9)


@pytest.mark.parametrize("damper", ["as_printed", "half_ring"])
def test_response_here_to_a_torque_there_is_that_there_to_one_here(damper):
    line, _, _ = engine_line(damper)
    frequencies = 2 * np.pi * np.array([14.0, 28.3, 162.0, 563.0])
    receptance = np.linalg.inv(line.dynamic_stiffness(frequencies))
    scale = np.abs(receptance).max(axis=(1, 2), keepdims=True)

    assert np.max(np.abs(receptance - np.swapaxes(receptance, 1, 2)) / scale) < 1e-9

    force = np.zeros((4, 67), dtype=complex)
    force[:, 13] = 1.0
    assert_close(
        line.response(force, frequencies),
        receptance[:, :, 13],
        1e-6,
        atol=1e-9 * scale.max(),
    )


def test_one_disc_on_a_shaft_is_the_closed_form():
    one = LinearSystem(
        mass=np.array([[2.0]]),
        stiffness=np.array([[800.0]]),
        loss=np.array([[40.0]]),
        damping=np.array([[3.0]]),
    )
    w = np.array([5.0, 20.0, 70.0])
    computed = one.response(np.ones((3, 1), dtype=complex), w)[:, 0]

    assert_close(
        computed,
        1.0 / (800 + 40j + 3j * w - 2 * w**2),
        1e-12,
    )


def test_mean_power_in_is_what_the_damping_takes():
    line, _ = chain(loss_factor=0.05, damping=1e-4)
    torque, amplitudes = cycle_torque()
    speed = 60.0
    computed = steady_response(line, torque, speed, n_orders=12)
    power_in = 0.5 * np.sum(np.real(np.conj(computed.speed_deviation) * amplitudes))
    w = speed * computed.orders
    lost = line.loss[..., None] * w + line.damping[..., None] * w**2
    power_lost = 0.5 * np.real(
        np.einsum(
            "io,ijo,jo->",
            np.conj(computed.angle),
            lost,
            computed.angle,
        )
    )

    assert power_in > 0.0
    assert_close(power_in, power_lost, 1e-9)


def test_slow_torques_bend_the_line_statically_and_fast_ones_move_the_masses():
    line, springs = chain()
    torque, amplitudes = cycle_torque(n_orders=2)
    slow = steady_response(line, torque, 1e-3, n_orders=2)

    assert_close(
        slow.angle,
        np.linalg.solve(line.stiffness, amplitudes),
        1e-6,
    )

    fast = steady_response(line, torque, 1e6, n_orders=2)
    assert_close(
        fast.angle,
        -np.linalg.solve(line.mass, amplitudes) / np.square(1e6 * fast.orders),
        1e-4,
    )

    mean, carried = slow.element_forces(springs)
    assert_close(mean, 0.0, atol=1e-9)
    assert_close(
        carried[2], -amplitudes[2], 1e-4
    )  # the last shaft carries what acts on the last disc


def test_mean_torques_are_carried_through_and_must_balance():
    line, springs = chain(grounded=False)
    torque, _ = cycle_torque()
    torque[0] += 50.0
    torque[2] -= 50.0
    computed = steady_response(line, torque, 60.0, n_orders=12)
    mean, _ = computed.element_forces(springs)

    assert_close(mean, [50.0, 50.0], 1e-9)
    assert abs(np.sum(np.diag(line.mass) * computed.twist)) < 1e-12

    torque[2] += 1.0
    with refused(
        "the mean torques leave 0.5774 N m on a line that nothing holds",
        SimulationError,
    ):
        steady_response(line, torque, 60.0, n_orders=12)


def test_fluctuation_is_half_the_peak_to_peak():
    computed = response_of(option())
    speeds = computed.speed_over_cycle(28_800)
    assert_close(
        computed.fluctuation(),
        0.5 * np.ptp(speeds, axis=1),
        2e-3,
    )
    assert_close(speeds.mean(axis=1), 0.0, atol=1e-9)


def test_more_orders_than_usual_change_little():
    line, _, _ = engine_line()
    torque = torques_of(option()).on(NODES)
    few, usual, many = (
        steady_response(line, torque, SPEED, n_orders=n).fluctuation()
        for n in (60, 200, 400)
    )

    assert_close(
        few[[2, 13]],
        many[[2, 13]],
        0.01,
    )
    assert_close(
        usual[[2, 13, 44, 64]],
        many[[2, 13, 44, 64]],
        0.005,
    )


def test_waterfall_lines_rise_with_the_speed_and_resonate_at_the_modes():
    line, _, _ = engine_line()
    speeds = np.arange(675.0, 1726.0, 150.0) * RPM

    def torques(speed):
        return torques_of(option(), speed, 0.0).on(NODES)

    flywheel, pump_gear = run_of_speeds(
        line,
        torques,
        speeds,
        [13, 44],
        n_orders=60,
    )

    assert flywheel.angle.shape == (len(speeds), 60)

    fifth = flywheel.angle[:, 9]  # order 5 meets the second mode, 68.7 Hz, at 825 r/min
    assert abs(speeds[np.argmax(fifth)] / RPM - 825.0) <= 50.0
    assert fifth.max() > 3.0 * fifth[0]

    frequencies = np.arange(0.0, 400.0, 0.5)
    spectra = pump_gear.spectra(frequencies)
    assert spectra.shape == (len(speeds), len(frequencies))

    for row, speed in zip(spectra, speeds, strict=True):
        bins = np.rint(np.arange(1, 61) * 0.5 * speed / (2 * np.pi) / 0.5).astype(int)
        assert set(np.flatnonzero(row)) <= set(bins)
    at_once = response_of(option(), speed=speeds[3], torque=0.0)
    assert_close(flywheel.fluctuation[3], at_once.fluctuation()[13], 5e-4)


def test_a_disturbance_at_5_hz_moves_the_flywheel_more_than_its_own_turns():
    line, _, _ = engine_line()
    moved = disturbance_response(line, 16, 0.05 * 12680.0, 2 * np.pi * 5.0)
    turning = response_of(option())

    assert (
        np.abs(moved[13]) > np.abs(turning.angle[13]).max()
    )  # as the paper's figure 12 has it

    doubled = disturbance_response(line, 16, 0.10 * 12680.0, 2 * np.pi * 5.0)
    assert_close(doubled, 2.0 * moved, 1e-12)


def test_meshes_given_apart_are_springs_of_the_line():
    whole, springs = chain(loss_factor=0.05, damping=1e-4)
    direction = springs.directions[2:]
    mesh = direction.T @ direction
    apart = SimpleNamespace(
        mass=whole.mass,
        damping=whole.damping - 1.0 * mesh,
        stiffness=whole.stiffness - 1e4 * mesh,
        loss_stiffness=whole.loss - 500.0 * mesh,
        directions=direction,
        mesh_stiffness=np.array([1e4]),
        mesh_loss_factor=np.array([0.05]),
        mesh_damping=np.array([1.0]),
    )
    line, meshes = closed_line(apart)
    for name in ("mass", "damping", "stiffness", "loss"):
        assert_close(getattr(line, name), getattr(whole, name), atol=1e-9)

    assert_close(meshes.loss, [500.0], 1e-7)


def test_matrices_and_orders_that_make_no_line_are_refused():
    line, _ = chain()
    skew = line.stiffness + np.eye(3, k=1)
    torque = np.zeros((3, 64))
    for impossible, message in (
        (
            lambda: replace(line, stiffness=skew),
            "stiffness must be symmetric",
        ),
        (
            lambda: replace(line, loss=np.zeros((2, 2))),
            "loss (2, 2) must be a finite matrix (3, 3)",
        ),
        (
            lambda: cycle_orders(torque, 40),
            "n_orders = 40 must lie in 1..31",
        ),
        (
            lambda: over_cycle(np.zeros((3, 12), dtype=complex), 24),
            "24 points of a cycle cannot hold 12 orders",
        ),
        (
            lambda: steady_response(line, torque, 0.0, n_orders=4),
            "must be positive",
        ),
    ):
        with refused(message, ValueError):
            impossible()
    one = np.eye(1)
    zero = np.zeros((1, 1))
    undamped = LinearSystem(mass=one, stiffness=one, loss=zero, damping=zero)

    with refused("excited at its natural frequency", SimulationError):
        undamped.response(np.ones((1, 1), dtype=complex), np.array([1.0]))
