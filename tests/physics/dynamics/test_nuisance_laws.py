"""Nuisances at the bearings: in phase with the shafts, as the linear machine responds."""

from dataclasses import replace

import numpy as np
import pytest
from closeness import assert_close
from scipy.signal import lsim

from gensig.dynamics.response import SENSE, accelerations, linear_pair
from gensig.operation.setpoint import Profile
from gensig.sensing.nuisance import draw_tones, read_nuisances
from gensig.sensing.tones import Tones
from gensig.systems.nuisances import nuisance_acceleration
from gensig.systems.pair_machine import running_pair
from gensig.systems.run import Run, Start

RATE = 51200.0
DURATION = 0.2
TIMES = np.arange(round(DURATION * RATE)) / RATE
RATIO = {"pinion": 1.0, "wheel": 23 / 84}
UNBALANCE = {
    "kind": "unbalance",
    "gear": "pinion",
    "iso21940_grade": 6.3,
    "used_share": [1.0, 1.0],
    "rated_speed_rpm": 1800,
    "rotor_mass_kg": None,
}
MESH = {
    "kind": "neighbour_mesh",
    "gear": "wheel",
    "n_teeth": 25,
    "n_teeth_mate": 72,
    "base_radius_mm": 29.4,
    "line_of_action_deg": 60,
    "dynamic_share": [0.01, 0.01],
    "n_harmonics": 3,
    "harmonic_exponent": 1.0,
    "sideband_share": [0.3, 0.3],
}


def tones_of(run, part):
    rng = [np.random.default_rng([7, k]) for k in range(3)]
    units = {"gearbox": rng[0], "specimen": rng[1]}
    return draw_tones(
        read_nuisances([part]),
        linear_pair(running_pair(run)),
        units,
        rng[2],
    )


def response(run, tones, angle=None):
    """Accelerations of the channels; by default at the nominal angle of the run."""
    if angle is None:
        angle = run.system.operating.nominal(TIMES).angle
    machine = linear_pair(running_pair(run))
    return nuisance_acceleration(run, machine, tones, angle)


def assert_same(signal, expected):
    assert_close(
        signal,
        expected,
        atol=1e-9 * np.abs(expected).max(),
    )


@pytest.fixture(scope="module")
def at(machine):
    """A run at a speed, with courses if they are given."""

    def make(speed_rpm=1800.0, start=None, low_cutoff_hz=None, **courses):
        system = machine(
            {
                "operating.speed_rpm": speed_rpm,
                "operating.duration_s": DURATION,
                "sensing.sensor.low_cutoff_hz": low_cutoff_hz,
            }
        )
        operating = replace(system.operating, **courses)
        return Run(
            system=replace(system, operating=operating),
            start=start,
        )

    return make


@pytest.mark.parametrize("gear", SENSE)
@pytest.mark.parametrize("speed_rpm", [900.0, 1800.0, 3600.0])
def test_unbalance_grows_with_the_square_of_the_speed(at, gear, speed_rpm):
    """m e w^2 times the response of the machine."""
    run = at(speed_rpm)
    axes = {"pinion": [0, 1], "wheel": [2, 3]}[gear]
    dofs = np.array([0, 1, 3, 4])
    w = run.system.operating.speed * RATIO[gear]
    force = np.zeros((1, 6), dtype=complex)
    force[0, dofs[axes]] = 1.0, -1j * SENSE[gear]
    unit = accelerations(running_pair(run).dynamics, np.array([w]), force)[
        0, dofs[axes]
    ]

    tones = tones_of(run, {**UNBALANCE, "gear": gear})
    signal = response(run, tones, w * TIMES / RATIO[gear])[axes]

    turns = np.exp(-1j * w * TIMES)
    constant = np.ones_like(TIMES)
    waves = np.stack([turns.conj(), turns, constant], axis=1)
    amplitude = 2.0 * np.linalg.lstsq(waves, signal.T.astype(complex), rcond=None)[0][0]
    rated = 1800 * 2 * np.pi / 60 * RATIO[gear]
    expected = getattr(run.system, gear).mass * 6.3e-3 / rated

    assert_close(np.abs(amplitude / unit) / w**2, expected, 1e-4)


@pytest.mark.parametrize("gear", SENSE)
def test_its_angle_is_fixed_to_tooth_0(at, gear):
    """A start one tooth later is a start at which the shaft is a pitch further."""
    run = at()
    tones = tones_of(run, {**UNBALANCE, "gear": gear})
    angle = run.system.operating.speed * TIMES[:4096]

    def started(pinion, wheel, angle=angle):
        start = Start(tooth_pinion=pinion, tooth_wheel=wheel, phase=0.25)
        return response(replace(run, start=start), tones, angle)

    first = started(3, 5)
    assert_same(started(4, 6), started(3, 5, angle + 2 * np.pi / 23))
    assert_same(started(3 + 23, 5 + 84), first)
    other_gear = {"pinion": (3, 6), "wheel": (4, 5)}[gear]
    assert_close(started(*other_gear), first)


def test_a_neighbour_has_its_orders_on_a_shaft_with_wobble(at):
    run = at()
    tones = tones_of(run, MESH)
    steady = run.system.operating.speed * TIMES
    angle = steady + 0.02 * np.sin(2 * np.pi * 11.0 * TIMES)
    signal = response(run, tones, angle)[2:].T

    def left(angle, orders):
        """Part of the signal that waves of some orders of the wheel do not explain."""
        phase = np.outer(angle * RATIO["wheel"], [0, *orders])
        waves = np.hstack([np.cos(phase), np.sin(phase)])
        rest = signal - waves @ np.linalg.lstsq(waves, signal, rcond=None)[0]
        return rest.std() / signal.std()

    sides = np.array([25, 26, 24, 25 + 25 / 72, 25 - 25 / 72])
    orders = (sides[:, None] + [0, 25, 50]).ravel()

    assert left(angle, orders) < 1e-4
    # over time the wobble smears the lines: order 75 swings by 0.4 rad
    assert left(steady, orders) > 1e-2


def test_on_a_ramp_it_is_the_response_in_time(at):
    """m e w(t)^2 cos(angle(t)) on the pinion's x, one mass on its support, solved in time."""
    run = at(3600.0, speed_profile=Profile(times=(0.0, DURATION), factors=(0.5, 1.5)))
    body = run.system.pinion
    operating = run.system.operating
    tones = tones_of(run, UNBALANCE)
    times = np.arange(-2000, len(TIMES)) / RATE
    nominal = operating.nominal(times)
    wave = np.real(tones[0].force[0, 0] * np.exp(1j * nominal.angle))
    force = wave * (nominal.speed / operating.speed) ** 2
    support = body.support
    system = [1.0, 0.0, 0.0], [body.mass, support.damping_x, support.stiffness_x]
    expected = lsim(system, force, times - times[0])[1][2000:]

    # from 30 to 90 turns a second in 0.2 s, on a support that follows in 11 ms
    assert np.std(response(run, tones)[0] - expected) < 0.04 * expected.std()
    # the amplitude of the mean speed would be another
    constant = response(at(3600.0), tones, nominal.angle[2000:])[0]
    assert np.std(constant - expected) > 0.2 * expected.std()


def test_only_loads_follow_torque_courses(at):
    half = Profile(times=(-1.0, 1.0), factors=(0.5, 0.5))
    for part, factor in ((MESH, 0.5), (UNBALANCE, 1.0)):
        tones = tones_of(at(), part)
        assert_same(
            response(at(torque_profile=half), tones),
            factor * response(at(), tones),
        )


def test_a_lead_in_continues_into_the_record(at):
    run = at(low_cutoff_hz=5.0)
    tones = tones_of(run, MESH)
    n_lead = run.system.sensing.n_lead

    assert n_lead > 1000

    operating = run.system.operating
    times = np.arange(-n_lead, len(TIMES)) / RATE
    led = response(run, tones, operating.nominal(TIMES).angle + 0.003)

    assert led.shape == (4, len(times))
    assert_same(
        led,
        response(at(), tones, operating.nominal(times).angle + 0.003),
    )


def test_tones_above_the_usable_band_are_left_out(at):
    run = at()
    highest = 20000.0 / 30.0
    for order, is_kept in (
        (1.01 * highest, False),
        (0.99 * highest, True),
    ):
        tone = Tones(
            gear="pinion",
            base=np.array([order]),
            multiple=np.array([[1]]),
            force=np.ones((1, 3), complex),
            follows="nothing",
        )
        assert np.all(response(run, [tone])[:2].std(axis=1) > 0.0) == is_kept


def test_forces_of_equal_order_on_two_shafts_add_up(at):
    """Each follows the angle of its own shaft."""
    run = at()
    tones = [
        Tones(
            gear=gear,
            base=np.array([2.0]),
            multiple=np.array([[1]]),
            force=np.ones((1, 3), complex),
            follows="nothing",
        )
        for gear in RATIO
    ]
    apart = sum(response(run, [tone]) for tone in tones)
    together = response(run, tones)
    assert_close(together, apart, atol=1e-5 * np.abs(apart).max())
