"""Torsional dampers: Den Hartog's optima, the line solved again, limits, losses."""

from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close

from gensig.driveline.linear.damper_tuning import response_at_nodes, tune_dampers
from gensig.driveline.linear.dampers import TorsionalDamper, with_dampers
from gensig.driveline.linear.forced import (
    Elements,
    closed_line,
    steady_response,
)
from gensig.driveline.linear.matrices import line_matrices
from gensig.driveline.linear.modal import natural_modes
from gensig.driveline.linear.shaft_line import Node, Shaft, ShaftLine
from gensig.dynamics.linear_system import LinearSystem

# of the spring that holds the one disc, whose inertia is 1: its frequency is 1 rad/s
STIFFNESS = 1.0
RATIOS = (0.1, 0.3)


def one_disc():
    """A disc on a spring to the ground under one harmonic torque of 1 N m at half the speed."""
    one = np.eye(1)
    zero = np.zeros((1, 1))
    line = LinearSystem(
        mass=one,
        stiffness=STIFFNESS * one,
        loss=zero,
        damping=zero,
    )
    spring = Elements(
        directions=one,
        stiffness=np.array([STIFFNESS]),
        loss=np.zeros(1),
    )
    torque = np.cos(2.0 * np.pi * np.arange(64) / 64)[None]
    speeds = 2.0 * np.linspace(0.5, 1.6, 441) + 1e-4
    return response_at_nodes(
        line,
        spring,
        0,
        lambda _: torque,
        speeds,
        {1: 0},
        n_orders=1,
    )


def peak(seen, *dampers):
    return seen.largest_force(dampers, n_points=64).max()


@pytest.mark.parametrize("ratio", RATIOS)
def test_the_tuned_damper_of_one_disc_is_den_hartogs(ratio):
    """Mechanical Vibrations, 3.3: frequency 1 / (1 + mu), peak sqrt(1 + 2 / mu), damping sqrt(3 mu
    / 8 / (1 + mu)).
    """
    seen = one_disc()
    (computed,) = tune_dampers(seen, [ratio])
    assert_close(computed.ring_inertia, ratio, 1e-3)  # the larger the better
    assert_close(
        peak(seen, computed),
        np.sqrt(1.0 + 2.0 / ratio),
        0.02,
    )

    rate = np.sqrt(computed.stiffness / computed.ring_inertia)
    assert_close(rate, 1.0 / (1.0 + ratio), 0.005)

    damping_ratio = computed.damping / (2.0 * computed.ring_inertia * rate)
    assert_close(
        damping_ratio,
        np.sqrt(3.0 * ratio / (8.0 * (1.0 + ratio))),
        0.02,
    )

    other = replace(computed, stiffness=1.2 * computed.stiffness)
    assert peak(seen, other) > 1.1 * peak(seen, computed)


@pytest.mark.parametrize("ratio", RATIOS)
def test_the_viscous_damper_of_one_disc_is_den_hartogs(ratio):
    """Mechanical Vibrations, 3.3 (Houdaille): peak 1 + 2 / mu at c = 2 J_ring / sqrt(2 (1 + mu) (2
    + mu)).
    """
    seen = one_disc()
    (computed,) = tune_dampers(seen, [ratio], viscous=True)
    assert computed.stiffness == 0.0
    assert_close(peak(seen, computed), 1.0 + 2.0 / ratio, 2e-3)
    assert_close(
        computed.damping,
        2.0 * ratio / np.sqrt(2.0 * (1.0 + ratio) * (2.0 + ratio)),
        0.02,
    )


def chain(*dampers):
    """Three discs on two shafts, one more disc behind a soft one, with dampers."""
    nodes = tuple(
        Node(name=f"disc {place}", inertia=inertia)
        for place, inertia in enumerate((0.4, 0.2, 0.3, 1.0))
    )
    stiffness = (9e3, 2e4, 5e3)
    shafts = tuple(
        Shaft(
            first=place,
            second=place + 1,
            stiffness=one,
            loss_factor=0.03,
        )
        for place, one in enumerate(stiffness)
    )
    return with_dampers(
        ShaftLine(nodes=nodes, shafts=shafts),
        (1, 2, 3, 4),
        dampers,
    )


DAMPERS = (
    TorsionalDamper(node=2, ring_inertia=0.05, damping=3.0, stiffness=0.0),
    TorsionalDamper(node=3, ring_inertia=0.1, damping=1.0, stiffness=900.0),
)
SPRING = np.array([[0.0, 1.0, -1.0, 0.0]])


def test_dampers_on_top_of_a_solution_are_the_line_solved_again():
    rng = np.random.default_rng(1)
    torque = rng.normal(size=(4, 64))
    torque -= torque.mean(axis=1, keepdims=True)
    speeds = (60.0, 180.0, 400.0)
    bare, _ = closed_line(line_matrices(chain()[0]))
    elements = Elements(
        directions=SPRING,
        stiffness=np.array([2e4]),
        loss=np.array([600.0]),
    )
    seen = response_at_nodes(
        bare,
        elements,
        0,
        lambda speed: torque,
        speeds,
        {2: 1, 3: 2},
        n_orders=20,
    )
    damped, numbers = chain(*DAMPERS)

    assert numbers == (1, 2, 3, 4, 5, 6)

    whole, _ = closed_line(line_matrices(damped))
    loads = np.vstack([torque, np.zeros((2, 64))])
    longer = Elements(
        directions=np.hstack([SPRING, np.zeros((1, 2))]),
        stiffness=np.array([2e4]),
        loss=elements.loss,
    )
    again = [
        steady_response(whole, loads, speed, n_orders=20).element_forces(longer)[1][0]
        for speed in speeds
    ]

    assert_close(seen.force_with(DAMPERS), again, 1e-9)
    assert not np.allclose(seen.force_with(()), again, rtol=1e-2)


def test_a_ring_that_a_fluid_holds_turns_freely_and_shifts_no_mode():
    bare = natural_modes(line_matrices(chain()[0]))
    damped = natural_modes(line_matrices(chain(DAMPERS[0])[0]))
    assert (bare.n_rigid, damped.n_rigid) == (1, 2)
    assert_close(damped.frequency[2:], bare.frequency[1:], 1e-9)
    assert np.all(damped.damping_ratio[2:] > bare.damping_ratio[1:])

    line, _ = chain(DAMPERS[0])
    assert len(line.parts) == 1  # in the mean the ring turns with its node
    assert_close(line.speed_ratio, 1.0, 1e-7)

    sprung = natural_modes(line_matrices(chain(DAMPERS[1])[0]))
    assert sprung.n_rigid == 1
    assert len(sprung.frequency) == len(bare.frequency) + 1
