"""An engine's line in time: sweeps against the linear line, and root stress under forces that are
known.
"""

from functools import lru_cache

import numpy as np
import pytest
from closeness import assert_close
from engine_cases import RPM, SPEED
from refusals import refused

from gensig.driveline.engine_dampers import (
    ToothLoad,
    dynamic_root_stress,
    mesh_between,
    read_mesh_strength,
)
from gensig.driveline.engine_line import read_engine_line
from gensig.driveline.in_time import RATE, TimeResponse
from gensig.driveline.linear.forced import run_of_speeds
from gensig.driveline.sweep import amplitude_spectra, sweep_course, sweep_response
from gensig.driveline.time_root_stress import root_stress_in_time, typical_largest
from gensig.options.compose import compose

ENGINE = ("system=engine_gear_train", "excitation=engine_v20")
LOW = 770.0 * RPM
HIGH = 880.0 * RPM
SECONDS = 2.5
ORDER_5 = 9
FLYWHEEL = 14


@lru_cache(maxsize=2)
def engine(*words):
    return read_engine_line(compose("generate", (*ENGINE, *words)))


@pytest.fixture(scope="module")
def passage():
    """Sweep through the second mode, which order 5 meets at 825 r/min; teeth do not part."""
    line = engine("system.backlash_um=0", "system.loss_factor.gear_mesh=0")
    return line, sweep_response(
        line,
        LOW,
        HIGH,
        SECONDS,
        0.0,
        teeth={},
        nodes=(FLYWHEEL,),
        n_orders=20,
    )


def test_a_sweep_of_a_line_without_play_is_the_linear_line(passage):
    line, sweep = passage
    torques = [line.on_line(line.torques(speed, 0.0)) for speed in sweep.up.speeds]
    (steady,) = run_of_speeds(
        line.linear()[0],
        lambda speed: torques[int(np.abs(sweep.up.speeds - speed).argmin())],
        sweep.up.speeds,
        [FLYWHEEL - 1],
        n_orders=20,
    )
    both = 0.5 * (sweep.up.angle + sweep.down.angle)[0, :, ORDER_5]

    assert_close(both, steady.angle[:, ORDER_5], 0.15)  # the bins are 18 r/min wide
    assert sweep.energy_residual < 1e-3
    assert_close(sweep.up.speeds, sweep.down.speeds, 1e-7)


def test_a_resonance_is_met_late_either_way(passage):
    _, sweep = passage
    up, down = (
        float(way.speeds @ way.angle[0, :, ORDER_5] / way.angle[0, :, ORDER_5].sum())
        for way in (sweep.up, sweep.down)
    )
    assert up > down + 0.5 * RPM

    at = sweep.difference[0]
    assert at[0] < 0.0 < at[-1]  # below the resonance it is already more going down


def test_the_course_goes_up_and_comes_back():
    course = sweep_course(70.0, 180.0, 3.0, 500.0)
    assert_close(
        np.interp(
            [-1.0, 0.0, 1.5, 3.0, 4.5, 6.0, 7.0],
            course.time,
            course.speed,
        ),
        [70, 70, 125, 180, 125, 70, 70],
        1e-7,
    )
    assert np.all(course.torque == 500.0)


@pytest.mark.parametrize(
    ("low", "high", "seconds", "message"),
    [
        (
            650,
            1750,
            0.2,
            "too few cycles at its low end; give 0.81 s or more",
        ),
        (
            1750,
            650,
            5.0,
            "from a positive speed up to a higher one",
        ),
    ],
)
def test_speeds_that_make_no_sweep_are_refused(low, high, seconds, message):
    with refused(message):
        sweep_response(
            engine(),
            low * RPM,
            high * RPM,
            seconds,
            0.0,
            teeth={},
            nodes=(FLYWHEEL,),
            n_orders=10,
        )


def test_a_steady_line_has_its_amplitude_in_the_spectrum():
    time = np.arange(round(0.5 * RATE)) / RATE
    frequencies, spectra = amplitude_spectra(
        np.array([0.3 * np.sin(2 * np.pi * 40.0 * time) + 5.0 * time + 2.0])
    )
    assert frequencies[spectra[0].argmax()] == 40.0
    assert_close(spectra[0].max(), 0.3, 1e-4)


def motion(speed, force, n_cycles):
    """A run in which one mesh carries a force that repeats over the cycle, (point,) N."""
    n_samples = int(n_cycles * 4.0 * np.pi / speed * RATE)
    crank = speed / RATE * np.arange(n_samples)
    nothing = np.zeros((1, n_samples))
    angle = 4.0 * np.pi / len(force) * np.arange(len(force))
    mesh_force = np.zeros((8, n_samples)) + np.interp(
        crank, angle, force, period=4.0 * np.pi
    )
    return TimeResponse(
        time=crank / speed,
        crank_angle=crank,
        speed=nothing,
        angle=nothing,
        mesh_force=mesh_force,
        fluctuation=np.zeros(1),
        cycle_fluctuation=np.zeros(1),
        contact_loss=np.zeros(8),
        back_contact=np.zeros(8),
        least_force=mesh_force.min(axis=1),
        greatest_force=mesh_force.max(axis=1),
        energy_residual=0.0,
    )


@pytest.fixture(scope="module")
def pump_drive():
    line = engine()
    mesh = mesh_between(line, (21, 45))
    return (
        line,
        mesh,
        read_mesh_strength(compose("generate", ENGINE), line, mesh),
    )


def test_root_stress_in_time_of_a_force_that_repeats_is_that_of_one_cycle(pump_drive):
    line, mesh, strength = pump_drive
    force = 1500.0 + 4000.0 * np.cos(4.0 * np.pi * np.arange(5760) / 5760)
    load = ToothLoad(speed=SPEED, force=force)
    once = dynamic_root_stress(strength, line, mesh, load)
    response = motion(load.speed, force, 4.1)
    computed = root_stress_in_time(strength, line, mesh, response)

    assert_close(
        computed.gears["wheel"].stress,
        once.gears["wheel"].stress,
        1e-4,
    )

    passes = computed.passes["wheel"]
    one = once.passes["wheel"]
    assert 3 * 54 <= len(passes) <= 4 * 54
    assert_close(
        passes[54:108].max(),
        one.max(),
        2e-3,
    )
    assert_close(typical_largest(passes, 54), one.max(), 2e-3)

    atol = 0.01 * one.max()
    shifted = [np.roll(one, -shift, axis=0) for shift in range(54)]
    (alike, *_) = [
        turn for turn in shifted if np.allclose(turn[:50], passes[:50], atol=atol)
    ]

    assert_close(alike, passes[54:108], atol=atol)


@pytest.mark.parametrize(
    ("force", "n_cycles", "message"),
    [
        (1000.0, 1.02, "two cycles of the crank at least"),
        (
            -1000.0,
            3.0,
            "nothing closes its driving flanks in time",
        ),
    ],
)
def test_a_run_without_root_stress_is_refused(pump_drive, force, n_cycles, message):
    line, mesh, strength = pump_drive
    response = motion(SPEED, np.full(64, force), n_cycles)
    with refused(message):
        root_stress_in_time(strength, line, mesh, response)
