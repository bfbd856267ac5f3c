"""A force law in two files: ``force_law_example`` and an entry of ``FORCE_LAWS``."""

from dataclasses import replace

import lane_tools
import numpy as np
import pytest
from force_law_example import Stop, StopLaw
from refusals import refused

from gensig.dynamics.backends.nystroem.method import FORCE_LAWS
from gensig.dynamics.decimation import in_band_error
from gensig.dynamics.motion.dynamics import Dynamics
from gensig.dynamics.pair import PINION_Y, WHEEL_Y
from gensig.errors import SimulationError

RATE = 51200.0
QUICK = {"solver.max_error": None, "operating.drive_frequency_hz": 20}
STIFFNESS, PRELOAD = 2e7, 1e-4  # N/m, m
CHANNELS = ("pinion_x", "pinion_y", "wheel_y", "wheel_rotation")


def with_stop(pair, clearance):
    """The pair with a stop between both gears along the line of action."""
    stop = Stop(
        first=PINION_Y, second=WHEEL_Y, clearance=clearance, stiffness=STIFFNESS
    )
    return replace(pair, system=replace(pair.system, elements=(stop,)))


def with_spring(pair):
    """The pair with a spring in place of a stop that is always pressed by ``PRELOAD``."""
    along = np.zeros(len(pair.dofs))
    along[[PINION_Y, WHEEL_Y]] = 1.0, -1.0
    stiffness = pair.system.stiffness + STIFFNESS * np.outer(along, along)
    return replace(
        pair,
        system=replace(pair.system, stiffness=stiffness),
        friction_torque=pair.friction_torque - STIFFNESS * PRELOAD * along,
    )


def motion(*machines, **options):
    """Accelerations (channel, sample) of machines side by side."""
    return lane_tools.motions(*machines, channels=CHANNELS, **options)


@pytest.fixture(scope="module")
def pair(machine, dynamics_of):
    return dynamics_of(machine(QUICK))


@pytest.fixture(autouse=True)
def stops(monkeypatch):
    monkeypatch.setitem(FORCE_LAWS, Stop.law, StopLaw())


@pytest.fixture(autouse=True)
def same_start(pair, monkeypatch):
    """All machines settle from the rest of the pair, and as long."""
    begin, settling_time = Dynamics.start, pair.settling_time
    monkeypatch.setattr(Dynamics, "start", lambda _, time: begin(pair, time))
    monkeypatch.setattr(Dynamics, "settling_time", settling_time)


def test_a_stop_that_is_always_pressed_is_a_spring(pair):
    found, expected = (
        motion(each)[0][None] for each in (with_stop(pair, -PRELOAD), with_spring(pair))
    )
    assert in_band_error(found, expected, RATE)[0] < 1e-9
    assert in_band_error(motion(pair)[0][None], expected, RATE)[0] > 0.1


def test_a_stop_that_is_never_reached_changes_nothing(pair):
    far, nearly = motion(with_stop(pair, 1.0), with_stop(pair, -PRELOAD))
    assert in_band_error(far[None], motion(pair)[0][None], RATE)[0] < 1e-12
    assert in_band_error(nearly[None], far[None], RATE)[0] > 0.1


def test_a_stop_that_is_hit_converges_with_the_step(pair):
    """At its clearance in the middle of the vibration, touched and left all the time."""
    clearance = pair.rest[PINION_Y] - pair.rest[WHEEL_Y]
    hit = with_stop(pair, clearance)
    five, ten, exact, pressed = (
        motion(each, oversampling=steps)[0][None]
        for each, steps in (
            (hit, 5),
            (hit, 10),
            (hit, 40),
            (with_stop(pair, -PRELOAD), 40),
        )
    )
    errors = [in_band_error(coarse, exact, RATE)[0] for coarse in (five, ten)]
    assert errors[0] < 1e-3
    assert errors[1] < 0.3 * errors[0]
    assert in_band_error(pressed, exact, RATE)[0] > 10.0 * errors[0]


def test_an_element_without_a_law_is_refused(pair, monkeypatch):
    monkeypatch.delitem(FORCE_LAWS, Stop.law)
    with refused("no force law 'stop'; there are: none", SimulationError):
        motion(with_stop(pair, 0.0))
