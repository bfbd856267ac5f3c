"""Nuisances at the bearings: locked to the shafts' angles, as strong as the linear machine answers, in any course."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lsim

from gensig.dynamics.response import accelerations
from gensig.operation.setpoint import Profile
from gensig.sensing.nuisance import draw_tones, read_nuisances
from gensig.sensing.tones import SENSE, Tones
from gensig.systems.nuisances import nuisance_acceleration
from gensig.systems.pair_machine import pair_dynamics
from gensig.systems.run import Run, Start

RATE, DURATION = 51200.0, 0.2
UNBALANCE = {"kind": "unbalance", "gear": "pinion", "iso21940_grade": 6.3, "used_share": [1.0, 1.0],
             "rated_speed_rpm": 1800, "rotor_mass_kg": None}  # fmt: skip
MESH = {"kind": "neighbour_mesh", "gear": "wheel", "n_teeth": 25, "n_teeth_mate": 72, "base_radius_mm": 29.4,
        "line_of_action_deg": 60, "dynamic_share": [0.01, 0.01], "n_harmonics": 3, "harmonic_exponent": 1.0,
        "sideband_share": [0.3, 0.3]}  # fmt: skip


def tones_of(run, part):
    rng = [np.random.default_rng([7, k]) for k in range(3)]
    units = {"gearbox": rng[0], "specimen": rng[1]}
    return draw_tones(read_nuisances([part]), pair_dynamics(run), units, rng[2])


def heard(run, tones, angle=None):
    times = np.arange(round(run.system.operating.duration * RATE)) / RATE
    angle = run.system.operating.nominal(times).angle if angle is None else angle
    return nuisance_acceleration(run, pair_dynamics(run), tones, angle)


@pytest.fixture(scope="module")
def at(machine):
    """A run at a speed, with courses if they are given."""

    def make(speed_rpm=1800.0, start=None, low_cutoff_hz=None, **courses):
        system = machine({"operating.speed_rpm": speed_rpm, "operating.duration_s": DURATION,
                          "sensing.sensor.low_cutoff_hz": low_cutoff_hz})  # fmt: skip
        return Run(
            system=replace(system, operating=replace(system.operating, **courses)),
            faults=(),
            start=start,
        )

    return make


def amplitudes(signal, angle, order):
    """Complex amplitudes (channel,) at one order, by least squares beside a mean."""
    waves = np.stack(
        [np.cos(order * angle), -np.sin(order * angle), np.ones_like(angle)], axis=1
    )
    found = np.linalg.lstsq(waves, signal.T, rcond=None)[0]
    return found[0] + 1j * found[1]


@pytest.mark.parametrize("gear", SENSE)
def test_unbalance_grows_with_the_square_of_the_speed_and_what_the_machine_answers(
    at, gear
):
    found = {}
    for speed in (900.0, 1800.0, 3600.0):
        run = at(speed)
        (tones,) = tones_of(run, {**UNBALANCE, "gear": gear})
        w = run.system.operating.speed * (1.0 if gear == "pinion" else 23 / 84)
        force = np.zeros((1, 6), dtype=complex)
        force[0, [0, 1] if gear == "pinion" else [3, 4]] = 1.0, -1j * SENSE[gear]
        answer = accelerations(pair_dynamics(run), np.array([w]), force)[
            0, [0, 1, 3, 4]
        ]
        angle = w * np.arange(round(DURATION * RATE)) / RATE
        measured = amplitudes(heard(run, [tones]), angle, 1.0)
        mine = [0, 1] if gear == "pinion" else [2, 3]
        found[speed] = (measured[mine] / answer[mine]) / w**2
        assert np.abs(measured[mine]).min() > 0.0
    for speed in (900.0, 3600.0):
        assert_allclose(np.abs(found[speed]), np.abs(found[1800.0]), rtol=1e-4, atol=0)
    mass, rated = (
        at().system.pinion.mass if gear == "pinion" else at().system.wheel.mass,
        1800 * 2 * np.pi / 60,
    )
    eccentricity = 6.3e-3 / (rated * (1.0 if gear == "pinion" else 23 / 84))
    assert_allclose(np.abs(found[1800.0]), mass * eccentricity, rtol=1e-4, atol=0)


def test_its_angle_is_fixed_to_tooth_0(at):
    """To begin a tooth later is to begin where the shaft stands a pitch later."""
    times = np.arange(4096) / RATE
    for gear, n_teeth in (("pinion", 23), ("wheel", 84)):
        run = at(start=Start(tooth_pinion=3, tooth_wheel=5, phase=0.25))
        (tones,) = tones_of(run, {**UNBALANCE, "gear": gear})
        angle = run.system.operating.speed * times
        later = replace(run, start=Start(tooth_pinion=4, tooth_wheel=6, phase=0.25))
        turned = heard(run, [tones], angle + 2 * np.pi / 23)  # a pitch of either gear
        assert_allclose(
            heard(later, [tones], angle),
            turned,
            rtol=0,
            atol=1e-9 * np.abs(turned).max(),
        )
        other = replace(
            run,
            start=Start(
                tooth_pinion=4 if gear == "wheel" else 3, tooth_wheel=5, phase=0.25
            ),
        )
        assert_allclose(
            heard(other, [tones], angle), heard(run, [tones], angle), rtol=0, atol=0
        )
        whole = replace(
            run,
            start=Start(tooth_pinion=3 + n_teeth, tooth_wheel=5 + n_teeth, phase=0.25),
        )
        if gear == "pinion":
            assert_allclose(
                heard(whole, [tones], angle),
                heard(run, [tones], angle),
                rtol=0,
                atol=1e-9,
            )


def test_a_neighbour_is_heard_at_its_orders_however_the_shaft_wobbles(at):
    run = at()
    (tones,) = tones_of(run, MESH)
    times = np.arange(round(DURATION * RATE)) / RATE
    angle = run.system.operating.speed * times + 0.02 * np.sin(2 * np.pi * 11.0 * times)
    signal, wheel = heard(run, [tones], angle), angle * 23 / 84
    waves = [np.ones_like(times)]
    for order in (25, 26, 24, 25 + 25 / 72, 25 - 25 / 72):
        for k in (0, 25, 50):
            waves += [np.cos((order + k) * wheel), np.sin((order + k) * wheel)]
    waves = np.array(waves).T
    rest = signal[2:].T - waves @ np.linalg.lstsq(waves, signal[2:].T, rcond=None)[0]
    assert rest.std() < 1e-4 * signal[2:].std()
    # by the clock the wobble smears the lines: order 75 swings by 0.4 rad
    steady = np.array([np.cos(order * run.system.operating.speed * 23 / 84 * times + phase) for order in (25, 50, 75)
                       for phase in (0.0, 1.5)]).T  # fmt: skip
    smeared = (
        signal[2:].T - steady @ np.linalg.lstsq(steady, signal[2:].T, rcond=None)[0]
    )
    assert smeared.std() > 1e-2 * signal[2:].std()


def test_on_a_ramp_it_is_what_the_force_does_in_time(at):
    """m e w(t)^2 cos(angle(t)) on the pinion's x, one mass on its support: an independent solution in time."""
    ramp = Profile(times=(0.0, DURATION), factors=(0.5, 1.5))
    run = at(3600.0, speed_profile=ramp)
    (tones,) = tones_of(run, UNBALANCE)
    times = np.arange(-2000, round(DURATION * RATE)) / RATE
    nominal = run.system.operating.nominal(times)
    force = (
        np.real(tones.force[0, 0] * np.exp(1j * nominal.angle))
        * (nominal.speed / run.system.operating.speed) ** 2
    )
    body = run.system.pinion
    c, k = body.support.damping_x / body.mass, body.support.stiffness_x / body.mass
    _, expected, _ = lsim(
        ([1.0 / body.mass, 0.0, 0.0], [1.0, c, k]), force, times - times[0]
    )
    found = heard(run, [tones])[0]
    # from 30 to 90 turns a second in 0.2 s, on a support that takes 11 ms to follow
    assert np.std(found - expected[2000:]) < 0.04 * expected[2000:].std()
    # the amplitude of the middle of the course throughout would be another
    steady = at(3600.0)
    plain = heard(steady, [tones], nominal.angle[2000:])[0]
    assert np.std(plain - expected[2000:]) > 0.2 * expected[2000:].std()


def test_torque_courses_move_what_the_load_pushes_and_no_more(at):
    half = Profile(times=(-1.0, 1.0), factors=(0.5, 0.5))
    for part, factor in ((MESH, 0.5), (UNBALANCE, 1.0)):
        run = at()
        tones = tones_of(run, part)
        whole, less = heard(run, tones), heard(at(torque_profile=half), tones)
        assert_allclose(less, factor * whole, rtol=0, atol=1e-9 * np.abs(whole).max())


def test_a_lead_in_goes_on_where_the_record_begins(at):
    run = at(low_cutoff_hz=5.0)
    assert run.system.sensing.n_lead > 1000
    tones = tones_of(run, MESH)
    n_lead, times = run.system.sensing.n_lead, np.arange(round(DURATION * RATE)) / RATE
    long = heard(run, tones, run.system.operating.nominal(times).angle + 0.003)
    assert long.shape == (4, n_lead + len(times))
    again = np.arange(-n_lead, len(times)) / RATE
    whole = heard(at(), tones, run.system.operating.nominal(again).angle + 0.003)
    assert_allclose(long, whole, rtol=0, atol=1e-9 * np.abs(whole).max())


def test_tones_above_the_usable_band_are_left_out(at):
    run = at()
    high = 1.01 * 20000.0 / 30.0
    tones = [
        Tones(gear="pinion", base=np.array([order]), multiple=np.array([[1]]), force=np.ones((1, 3), complex),
              follows="nothing")
        for order in (high, high / 1.02)
    ]  # fmt: skip
    assert np.all(heard(run, tones[:1]) == 0.0)
    assert np.all(heard(run, tones[1:])[:2].std(axis=1) > 0.0)
